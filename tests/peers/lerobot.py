"""Whether LeRobot's own loader reads what `calibration export-episodes --to lerobot` has written: numbers against the clips, read
here without any code of the twin, and pictures bit for bit against those of `--to png`.

    python3.12 -m venv lerobot && lerobot/bin/pip install "lerobot[dataset]==0.6.1" mcap==1.6.0 mcap-protobuf-support==0.6.0
    lerobot/bin/python tests/peers/lerobot.py --programs target/release
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

# The script's own name is the package's: its folder must not come first.
sys.path = [path for path in sys.path if Path(path or ".").resolve() != Path(__file__).resolve().parent]
os.environ.setdefault("HF_HUB_OFFLINE", "1")

import numpy as np  # noqa: E402
from mcap.reader import make_reader  # noqa: E402
from mcap_protobuf.decoder import DecoderFactory  # noqa: E402
from PIL import Image  # noqa: E402

TASKS = ["push_milk", "stack_boxes", "pick_carrot", "close_laptop"]
EVERY = 5


def rows_of(clip):
    """Poses and targets by body, joints, drives and the gripper, a list each, by time."""
    rows = {}
    with open(clip, "rb") as stream:
        for _, channel, message, said in make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            row = rows.setdefault(message.log_time, {})
            if channel.topic.startswith("/object/") and channel.topic != "/object/pose":
                place, turn = said.pose.position, said.pose.orientation
                row[channel.topic] = [place.x, place.y, place.z, turn.w, turn.x, turn.y, turn.z]
            elif channel.topic.startswith("/task/"):
                row.update({f"{channel.topic}/{joint.name}": [joint.position] for joint in said.joints})
            elif channel.topic == "/arm/state":
                row["q"], row["q_d"] = list(said.q), list(said.q_d)
            elif channel.topic == "/gripper":
                row["width"], row["width_d"] = [said.width], [said.width_d]
    return [rows[time] for time in sorted(rows)]


def wanted(names, row, told):
    """The numbers that a feature of these names has to hold, out of a row of the clip."""
    numbers = []
    for name in names:
        body, what = name.rsplit(".", 1)
        if name == "gripper.width":
            numbers += row["width_d" if told else "width"]
        elif what == "pos":
            numbers.append(row["q_d" if told else "q"][int(body.removeprefix("fr3_joint")) - 1])
        elif what == "joint":
            numbers += row[f"/task/{'drives' if told else 'joints'}/{body}"]
        else:
            pose = row[f"/object/{body}/{'target' if told else 'pose'}"]
            numbers.append(pose[["x", "y", "z", "qw", "qx", "qy", "qz"].index(what)])
    return np.array(numbers)


def turned_alike(names, found, asked):
    """A quaternion and its negative are one rotation: those asked for, with the signs of those found."""
    asked = asked.copy()
    for i, name in enumerate(names):
        if name.endswith(".qw") and found[i : i + 4] @ asked[i : i + 4] < 0:
            asked[i : i + 4] *= -1
    return asked


def judge(task, programs, folder, episodes):
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    def run(program, *arguments):
        return subprocess.run([str(programs / program), *map(str, arguments)], check=True, capture_output=True, text=True).stdout

    file = Path("twin/tasks") / f"{task}.toml"
    clips, data, pictures = folder / "clips", folder / "data", folder / "pictures"
    run("twin", "task", file, "--episodes", episodes, "--noise", 0.002, "--record", clips)
    said = json.loads(run("calibration", "export-episodes", file, clips, "--to", "lerobot", "--every", EVERY, "--out", data, "--json"))
    run("calibration", "export-episodes", file, clips, "--to", "png", "--every", EVERY, "--out", pictures)
    dataset = LeRobotDataset(f"twinalign/{task}", root=data)
    cameras = [key for key in dataset.meta.features if key.startswith("observation.images.")]
    good = [clip for clip in sorted(clips.glob("*.mcap")) if str(clip) not in said["left_out"]]
    worst, different, compared, at = 0.0, 0, 0, 0
    for number, clip in enumerate(good):
        rows = rows_of(clip)[::EVERY]
        for k in range(len(rows) - 1):
            item = dataset[at]
            assert (int(item["episode_index"]), int(item["frame_index"])) == (number, k)
            assert abs(float(item["timestamp"]) - k * EVERY / 100) < 1e-6
            for feature, row in [("observation.state", rows[k]), ("observation.environment_state", rows[k]), ("action", rows[k + 1])]:
                names = dataset.meta.features[feature]["names"]
                found = item[feature].numpy().astype(float)
                asked = turned_alike(names, found, wanted(names, row, feature == "action"))
                worst = max(worst, float(np.abs(found - asked).max()))
            for camera in cameras:
                name = camera.removeprefix("observation.images.")
                depth = name.endswith("_depth")
                file_name = f"{name.removesuffix('_depth')}_{'depth' if depth else 'color'}_{k:05}.png"
                drawn = np.array(Image.open(pictures / clip.stem / file_name))
                seen = item[camera].numpy()
                # Colour comes as shares of one, depth as one channel of millimetres.
                seen = seen[0].round() if depth else (seen.transpose(1, 2, 0) * 255).round()
                different += int((seen != drawn).sum())
                compared += 1
            at += 1
    assert at == len(dataset) == said["frames"], (at, len(dataset), said["frames"])
    stats = dataset.meta.stats["action"]
    actions = np.stack([dataset[i]["action"].numpy() for i in range(len(dataset))])
    off = max(float(np.abs(stats["mean"] - actions.mean(0)).max()), float(np.abs(stats["q90"] - np.quantile(actions, 0.9, 0)).max()))
    print(f"{task}: {len(good)} of {episodes} episodes, {at} frames; numbers within {worst:.1e}; "
          f"{different} of the pixels of {compared} pictures differ; statistics within {off:.1e}; task '{dataset[0]['task']}'")
    return worst < 1e-6 and different == 0 and off < 1e-5 and len(good) >= 0.9 * episodes


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--programs", type=Path, required=True, help="folder of twin and calibration")
    parser.add_argument("--episodes", type=int, default=10, help="of each task (default 10)")
    parser.add_argument("--tasks", nargs="+", default=TASKS, choices=TASKS)
    arguments = parser.parse_args()
    good = True
    for task in arguments.tasks:
        with tempfile.TemporaryDirectory() as folder:
            good &= judge(task, arguments.programs.resolve(), Path(folder), arguments.episodes)
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
