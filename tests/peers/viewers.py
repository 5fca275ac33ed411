"""Whether a clip, or a bag that is a folder, shows a moving robot to readers that know nothing of twinalign.

    python tests/peers/viewers.py session/clip_00.mcap bags/clip_00 [--rerun]

Reads with `mcap` and `mcap-protobuf-support` (own clips: Foxglove's own schemas) or `rosbags` (bags), and with --rerun also with Rerun's
loader (`pip install rerun-sdk`). Holds: the URDF is XML in which every joint's links are there; every link hangs on one root through
/tf and /tf_static; frames lie where the URDF puts them at the joints of the nearest state; links move; quaternions have length 1.
"""
import argparse
import json
import math
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

# Frames are calculated from the very state that is beside them: in double precision they agree.
NEAR = 1e-6


def turn(w, x, y, z):
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def pose(position, rotation):
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rotation, position
    return out


def rpy(roll, pitch, yaw):
    of = lambda axis, angle: turn(math.cos(angle / 2), *(math.sin(angle / 2) * np.eye(3)[axis]))
    return of(2, yaw) @ of(1, pitch) @ of(0, roll)


class Seen:
    """What was read: frames by time, the URDF, joints by time."""

    def __init__(self):
        self.urdf, self.moving, self.fixed, self.states, self.topics = None, [], {}, [], {}

    def frame(self, time, parent, child, position, wxyz, fixed):
        assert abs(np.linalg.norm(wxyz) - 1) < 1e-9, f"{child}: {wxyz}"
        of = (parent, child, pose(position, turn(*wxyz)))
        if fixed:
            self.fixed[child] = of
        else:
            self.moving.append((time, *of))


def own_clip(path):
    """By Foxglove's libraries."""
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory
    seen, factory = Seen(), DecoderFactory()
    with open(path, "rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            seen.topics[channel.topic] = schema.name
            if channel.topic == "/robot_description":
                assert (schema.name, schema.encoding, channel.message_encoding) == ("std_msgs/msg/String", "ros2msg", "cdr")
                length = int.from_bytes(message.data[4:8], "little")
                seen.urdf = message.data[8:8 + length - 1].decode()
                continue
            if channel.topic not in ("/tf", "/tf_static", "/arm/state"):
                continue
            said = factory.decoder_for(channel.message_encoding, schema)(message.data)
            if channel.topic == "/arm/state":
                seen.states.append((message.log_time, None, list(said.q)))
                continue
            for frame in said.transforms:
                p, r = frame.translation, frame.rotation
                seen.frame(message.log_time, frame.parent_frame_id, frame.child_frame_id, [p.x, p.y, p.z],
                           [r.w, r.x, r.y, r.z], channel.topic == "/tf_static")
    return seen


def bag(path):
    """By rosbags."""
    from rosbags.highlevel import AnyReader
    seen = Seen()
    with AnyReader([Path(path)]) as reader:
        seen.topics = {connection.topic: connection.msgtype for connection in reader.connections}
        for connection, time, raw in reader.messages():
            if connection.topic not in ("/robot_description", "/tf", "/tf_static", "/joint_states"):
                continue
            said = reader.deserialize(raw, connection.msgtype)
            if connection.topic == "/robot_description":
                seen.urdf = said.data
            elif connection.topic == "/joint_states":
                seen.states.append((time, list(said.name), list(said.position)))
            else:
                for frame in said.transforms:
                    p, r = frame.transform.translation, frame.transform.rotation
                    seen.frame(time, frame.header.frame_id, frame.child_frame_id, [p.x, p.y, p.z], [r.w, r.x, r.y, r.z],
                               connection.topic == "/tf_static")
    return seen


def joints_of(urdf):
    """Of each child link: parent, kind, origin, axis, name of the joint; in the order of the file."""
    root = ET.fromstring(urdf)
    links = {link.get("name") for link in root.findall("link")}
    numbers = lambda text: [float(word) for word in text.split()]
    out = {}
    for joint in root.findall("joint"):
        parent, child = joint.find("parent").get("link"), joint.find("child").get("link")
        assert {parent, child} <= links, f"{joint.get('name')} hangs on links that are not there"
        origin, axis = joint.find("origin"), joint.find("axis")
        at = np.eye(4)
        if origin is not None:
            at = pose(numbers(origin.get("xyz", "0 0 0")), rpy(*numbers(origin.get("rpy", "0 0 0"))))
        axis = np.array(numbers(axis.get("xyz")) if axis is not None else [1, 0, 0])
        out[child] = (parent, joint.get("type"), at, axis / np.linalg.norm(axis), joint.get("name"))
    return links, out


def judged(seen):
    assert seen.urdf, f"no /robot_description among {sorted(seen.topics)}"
    links, joints = joints_of(seen.urdf)
    own = [frame for frame in seen.moving if not frame[2].startswith("twin/")]
    frames = {child: parent for _, parent, child, _ in own} | {child: parent for child, (parent, _, _) in seen.fixed.items()}
    up = lambda name: up(frames[name]) if name in frames else name
    roots = {up(link) for link in links}
    assert len(roots) == 1, f"frames hang on {roots}"
    chain = [name for _, (_, kind, _, _, name) in joints.items() if kind in ("revolute", "continuous", "prismatic")]
    times = np.array([time for time, _, _ in seen.states])
    farthest, travel = 0.0, {}
    for time, parent, child, at in own:
        before, kind, origin, axis, name = joints[child]
        assert before == parent, f"{child} hangs on {parent}, in the URDF on {before}"
        _, names, q = seen.states[int(np.argmin(np.abs(times - time)))]
        position = q[(names or chain).index(name)]
        if kind == "prismatic":
            moved = pose(axis * position, np.eye(3))
        else:
            moved = pose(np.zeros(3), turn(math.cos(position / 2), *(math.sin(position / 2) * axis)))
        farthest = max(farthest, np.abs(origin @ moved - at).max())
        travel.setdefault(child, []).append(at)
    assert farthest < NEAR, f"frames lie {farthest} from where the URDF puts them"
    moves = {child: float(np.abs(np.array(list_) - list_[0]).max()) for child, list_ in travel.items()}
    assert max(moves.values()) > 1e-3, f"nothing moves: {moves}"
    span = 1e-9 * (own[-1][0] - own[0][0])
    per_second = (len(own) / len(moves) - 1) / span
    return {"links": len(links), "root": roots.pop(), "moving": len(moves), "frames_per_second": round(per_second, 1),
            "farthest_from_urdf": farthest, "camera": any("camera" in child for child in seen.fixed),
            "twin": any(frame[2].startswith("twin/") for frame in seen.moving)}


def by_rerun(path):
    """What Rerun's own loader makes of the file: entities with transforms, and links of the URDF that it draws."""
    program = Path(sys.executable).with_name("rerun")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "clip.rrd"
        quiet = {"check": True, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
        subprocess.run([program, "mcap", "convert", path, "-o", out], **quiet)
        chunks = subprocess.run([program, "rrd", "print", "-v", out], **quiet).stdout.splitlines()
    entity = lambda chunk: chunk.split(" - ")[1]
    transforms = sorted({entity(chunk) for chunk in chunks if "@Transform3D:" in chunk})
    drawn = {entity(chunk) for chunk in chunks if "/visual_geometries/" in chunk}
    assert "/tf" in transforms and drawn, f"Rerun sees transforms on {transforms} and draws {drawn}"
    return {"transforms": transforms, "drawn_links": len(drawn), "pinholes": sum("@Pinhole:" in chunk for chunk in chunks)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", nargs="+", metavar="CLIP|BAG")
    parser.add_argument("--rerun", action="store_true", help="asks Rerun's loader, too")
    given = parser.parse_args()
    for path in map(Path, given.recordings):
        answer = {"recording": str(path), **judged(bag(path) if path.is_dir() else own_clip(path))}
        if given.rerun:
            answer["rerun"] = by_rerun(path if path.is_file() else next(path.glob("*.mcap")))
        print(json.dumps(answer))


if __name__ == "__main__":
    main()
