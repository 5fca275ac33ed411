"""The faults of `--example check_faults` as `calibration check` and the recording doctors that pip offers find them.

    python3.11 -m venv doctors && doctors/bin/pip install baglint==0.2.1 rosbag-doctor==0.1.1 clockdoctor==0.1.0 stamplint==0.2.0 \\
        physlint==0.4.0 "deepen-grade[mcap]==0.4.1" rdq==0.3.4 lerobot-doctor==0.2.0 robovet==0.2.2 robot-data-audit==0.11.0
    doctors/bin/pip install --no-deps lerobot-lint==0.1.1
    cargo run --release -p tools --example check_faults -- --trials 20 --seed 1 --write sessions
    doctors/bin/python tests/peers/recording_doctors.py sessions --program target/release/calibration --out doctors.jsonl --jobs 2

Each session becomes ROS 2 bags (storage mcap, a file a clip) and a LeRobot data set (version 3.0, a clip an episode). `calibration check` and
the doctors of data sets are given all its clips; those of bags its first one, for every clip has the fault. Nothing is resampled: a row of a
data set is a measured row with the command that was newest then, at the measured stamp.

What a doctor says is counted by kind (its code and topic, or its sentence without numbers; warnings and errors only). Of every second clean
session of a sort the largest counts are its limits; what exceeds one is an alarm. False alarms are counted in the other clean sessions; a kind
that raises one in more than 2 % of them counts for nothing anywhere.
Where a doctor takes limits, they are those of the same sessions with 5 % to spare, and not the wider ones that it would propose.

Where a fault lies in stamps, a bag is written twice, with the times at which messages truly arrived and with those that their stamps say, and
an alarm in either counts. What a doctor does not read of (half widths stand in cell.toml alone; five doctors read times alone) counts as the clean
recording. Five faults are mended in reading, so they are put in here anew, of the same sizes; a cut file is cut here.

After Ctrl-C the same command goes on where it was. `--table` only prints what --out holds.
"""

import argparse
import collections
import concurrent.futures
import contextlib
import functools
import hashlib
import importlib.metadata
import io
import json
import math
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path = [path for path in sys.path if Path(path or ".").resolve() != Path(__file__).resolve().parent]
os.environ.update(COLUMNS="1000", NO_COLOR="1", HF_HUB_OFFLINE="1")

import numpy as np  # noqa: E402
import pyarrow as pa  # noqa: E402
import pyarrow.parquet as parquet  # noqa: E402
import yaml  # noqa: E402
from mcap.reader import make_reader  # noqa: E402
from mcap.writer import Writer  # noqa: E402

MEASURED = "/franka_robot_state_broadcaster/measured_joint_states"
DESIRED = "/franka_robot_state_broadcaster/desired_joint_states"
POSES = "/object/pose"
TOPICS = {"measured": MEASURED, "desired": DESIRED, "object": POSES}
UNIX_NS = 1_780_000_000_000_000_000
TRANSPORT_NS = 300_000
SHIFTED = ("MisalignedLogs", "LeadingLogs")
ROOM_NS = 10_000_000_000  # by so much those two are shifted as a whole
STAMP_UNITS = {"StampsInMilliseconds": 1e-6, "StampsInMicroseconds": 1e-3}
SPARE = 1.05
FALSE_ALARMS = 0.02  # a kind of remark that comes more often in clean sessions counts for nothing
BAGS = ["baglint", "rosbag-doctor", "clockdoctor", "stamplint", "physlint", "deepen-grade", "rdq"]
SETS = ["lerobot-doctor", "lerobot-lint", "robovet", "robot-data-audit"]
# These read times (and how long messages are), so that they say the same of a recording with the times of the clean one.
BY_TIMES = ["baglint", "rosbag-doctor", "clockdoctor", "stamplint", "physlint"]
DOCTORS = ["check", *BAGS, *SETS]
BAD = re.compile(r"^(warn|error|fail|critical|fatal|review|exclude|wrong|cannot|note$|block|medium|high)", re.IGNORECASE)

HEADER = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
POSE = """std_msgs/Header header
geometry_msgs/Pose pose
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
""" + HEADER[HEADER.index("=" * 80):]


# Sessions as the example wrote them.

class Series:
    def __init__(self, stamps, q, dq, tau):
        self.stamps, self.q, self.dq, self.tau = stamps, q, dq, tau

    def __len__(self):
        return len(self.stamps)


def session_of(folder):
    """[{series by name}] by clip, the names of the joints, the clean session's name."""
    said = json.loads((folder / "session.json").read_text())
    clips, joints = [], []
    for clip in said["clips"]:
        joints = clip["joints"] or joints
        read = {}
        for name in TOPICS:
            block = clip.get(name, {"dof": 7, "dq": False, "tau": False})
            dof = block["dof"]
            width = 1 + dof * (1 + block["dq"] + block["tau"])
            rows = np.fromfile(folder / f"{clip['stem']}.{name}.f64", "<f8")
            rows = rows.reshape(-1, width) if rows.size else np.zeros((0, width))
            more = [rows[:, 1 + dof * k:1 + dof * (k + 1)].copy() for k in range(3)]
            dq = more[1] if block["dq"] else None
            tau = more[1 + block["dq"]] if block["tau"] else None
            read[name] = Series(rows[:, 0].astype(np.int64), more[0], dq, tau)
        clips.append(read)
    return clips, joints, said["clean"]


def put_in(fault, clips, number):
    """The faults that the reader mends, as the file has them; sizes are drawn as those of the example are."""
    draw = np.random.default_rng(number)
    size, sign, first, which = draw.random(), draw.choice([-1, 1]), draw.random() < 0.5, draw.integers(5)
    between = lambda lo, hi: lo * (hi / lo) ** size
    for clip in clips:
        measured, desired = clip["measured"], clip["desired"]
        joint = number % max(1, measured.q.shape[1])
        if fault == "StartGlitch":
            measured.q[0] += sign * between(0.05, 3.0)
        elif fault == "OneTopicInDegrees":
            for values in [desired.q, desired.dq] if first else [measured.q, measured.dq]:
                values *= 180 / math.pi
        elif fault == "AngleWraps":
            joint = int(np.argmax(np.ptp(measured.q, axis=0)))
            q = measured.q[:, joint]
            wrapped = np.where(q > np.quantile(q, 0.3 + 0.4 * size), q - 2 * math.pi, q)
            jumps = np.flatnonzero(np.abs(np.diff(wrapped)) > 3.0) + 1
            measured.dq[jumps, joint] = np.diff(wrapped)[jumps - 1] / (np.diff(measured.stamps)[jumps - 1] * 1e-9)
            measured.q[:, joint] = wrapped
        elif fault == "StampsInMilliseconds":
            start = min(series.stamps[0] for series in clip.values() if len(series))
            for series in clip.values():
                series.stamps = np.round((series.stamps - start) * STAMP_UNITS[fault]).astype(np.int64) + 1
        elif fault == "PlaceholderConstant":
            values = [measured.dq, measured.tau, measured.q, desired.dq, measured.tau][which]
            values[:, slice(None) if which == 4 else joint] = 0.0 if which in (0, 3, 4) else size
    return clips


MENDED = ["StartGlitch", "OneTopicInDegrees", "AngleWraps", "StampsInMilliseconds", "PlaceholderConstant"]


# ROS 2 bags.

class Encoder:
    """Messages of one size, in CDR."""

    def __init__(self, joints, blocks):
        self.bytes, self.places = bytearray(b"\0\1\0\0"), []
        self.bytes += bytes(8)
        self.text("fr3_link0")
        if joints is not None:
            self.count(len(joints))
            for joint in joints:
                self.text(joint)
        for count in blocks:
            if joints is not None:
                self.count(count)
            if count:
                self.bytes += bytes(-(len(self.bytes) - 4) % 8)
                self.places.append((len(self.bytes), 8 * count))
                self.bytes += bytes(8 * count)

    def count(self, value):
        self.bytes += bytes(-(len(self.bytes) - 4) % 4) + value.to_bytes(4, "little")

    def text(self, value):
        self.count(len(value) + 1)
        self.bytes += value.encode() + b"\0"

    def message(self, stamp_ns, blocks):
        out = bytearray(self.bytes)
        seconds, rest = divmod(int(stamp_ns), 1_000_000_000)
        out[4:12] = seconds.to_bytes(4, "little") + rest.to_bytes(4, "little")
        for (place, size), values in zip(self.places, blocks):
            out[place:place + size] = values.astype("<f8").tobytes()
        return bytes(out)


def write_bag(path, clip, joints, stamps, arrivals):
    """`stamps` of headers and `arrivals` in the file, by series."""
    due = []
    for name, series in clip.items():
        if not len(series):
            continue
        if name == "object":
            encoder = Encoder(None, [3, 4])
            blocks = [series.q[:, :3], series.q[:, [4, 5, 6, 3]]]
        else:
            blocks = [block for block in [series.q, series.dq, series.tau] if block is not None]
            encoder = Encoder(joints, [block.shape[1] for block in blocks] + [0] * (3 - len(blocks)))
        for row in range(len(series)):
            message = encoder.message(stamps[name][row], [block[row] for block in blocks])
            due.append((int(arrivals[name][row]), name, message))
    due.sort(key=lambda one: one[0])
    with open(path, "wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="recording_doctors")
        channels, counts = {}, collections.Counter()
        for time, name, message in due:
            if name not in channels:
                kind, text = ("geometry_msgs/msg/PoseStamped", POSE) if name == "object" else ("sensor_msgs/msg/JointState", HEADER)
                schema = writer.register_schema(kind, "ros2msg", text.encode())
                channels[name] = writer.register_channel(TOPICS[name], "cdr", schema, {"offered_qos_profiles": ""})
            writer.add_message(channels[name], time, message, time, counts[name])
            counts[name] += 1
        writer.finish()


def cut(path, number):
    draw = np.random.default_rng(number)
    data = path.read_bytes()
    path.write_bytes(data[:int(len(data) * 0.5 * (0.98 / 0.5) ** draw.random())])


def header_stamps(fault, clip):
    unix = int(UNIX_NS * STAMP_UNITS.get(fault, 1.0)) - (ROOM_NS if fault in SHIFTED else 0)
    return {name: series.stamps + unix for name, series in clip.items()}


def arrivals_of(stamps, clean):
    """When messages arrived: of as many rows as the clean clip has, its stamps."""
    true = {name: series.stamps + UNIX_NS for name, series in clean.items()}
    of = lambda name: true[name] if len(true[name]) == len(stamps[name]) else stamps[name]
    return {name: of(name) + TRANSPORT_NS for name in stamps}


# LeRobot data sets.

def rows_of(clip):
    measured, desired, poses = clip["measured"], clip["desired"], clip["object"]
    if not len(measured):
        return {"observation.state": poses.q}, poses.stamps
    newest = np.clip(np.searchsorted(desired.stamps, measured.stamps, side="right") - 1, 0, None)
    rows = {"observation.state": measured.q, "action": desired.q[newest]}
    for name, values in [("velocity", measured.dq), ("effort", measured.tau)]:
        if values is not None:
            rows[f"observation.{name}"] = values
    if desired.dq is not None:
        rows["observation.desired_velocity"] = desired.dq[newest]
    if len(poses):
        rows["observation.environment_state"] = poses.q[np.clip(np.searchsorted(poses.stamps, measured.stamps, side="right") - 1, 0, None)]
    return rows, measured.stamps


def write_set(out, clips, joints):
    rate = 1000 if len(clips[0]["measured"]) else 150
    columns, lengths = collections.defaultdict(list), []
    for episode, clip in enumerate(clips):
        rows, stamps = rows_of(clip)
        for name, values in rows.items():
            columns[name].append(values.astype(np.float32))
        count = np.arange(len(stamps))
        columns["timestamp"].append(((stamps - stamps[0]) * 1e-9).astype(np.float32))
        for name, values in [("frame_index", count), ("episode_index", 0 * count + episode), ("index", count + sum(lengths)), ("task_index", 0 * count)]:
            columns[name].append(values)
        lengths.append(len(stamps))
    columns = {name: np.concatenate(values) for name, values in columns.items()}
    names = lambda name, width: list(joints) if width == len(joints) and "environment" not in name else [f"{k}" for k in range(width)]
    features = {}
    for name, values in columns.items():
        width = values.shape[1] if values.ndim == 2 else 1
        kind = "float32" if values.dtype == np.float32 else "int64"
        features[name] = {"dtype": kind, "shape": [width], "names": names(name, width) if values.ndim == 2 else None}
    listed = lambda values: pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), values.shape[1]) if values.ndim == 2 else pa.array(values)
    for folder in ["meta/episodes/chunk-000", "data/chunk-000"]:
        (out / folder).mkdir(parents=True)
    data = out / "data/chunk-000/file-000.parquet"
    parquet.write_table(pa.table({name: listed(values) for name, values in columns.items()}), data)
    starts = np.concatenate([[0], np.cumsum(lengths)])
    episodes = {"episode_index": range(len(lengths)), "tasks": [["move"]] * len(lengths), "length": lengths, "dataset_from_index": starts[:-1],
                "dataset_to_index": starts[1:]}
    episodes |= {f"{what}/{kind}_index": [0] * len(lengths) for what in ["data", "meta/episodes"] for kind in ["chunk", "file"]}
    parquet.write_table(pa.table({name: pa.array(list(values)) for name, values in episodes.items()}), out / "meta/episodes/chunk-000/file-000.parquet")
    import pandas
    pandas.DataFrame({"task_index": [0]}, index=pandas.Index(["move"], name="task")).to_parquet(out / "meta/tasks.parquet")
    two = lambda values: values.reshape(len(values), -1).astype(float)
    stats = {name: {what: np.atleast_1d(getattr(np, what)(two(values), axis=0)).tolist() for what in ["min", "max", "mean", "std"]} | {"count": [len(values)]}
             for name, values in columns.items()}
    (out / "meta/stats.json").write_text(json.dumps(stats))
    info = {"codebase_version": "v3.0", "robot_type": "franka", "fps": rate, "total_episodes": len(lengths), "total_frames": sum(lengths), "total_tasks": 1,
            "chunks_size": 1000, "data_files_size_in_mb": 100, "video_files_size_in_mb": 200, "splits": {"train": f"0:{len(lengths)}"},
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet", "video_path": None, "features": features}
    (out / "meta/info.json").write_text(json.dumps(info))
    return data


# What the doctors say.

@functools.cache
def entry(name):
    [point] = [point for point in importlib.metadata.entry_points(group="console_scripts") if point.name == name]
    return point.load()


def call(name, arguments):
    """What a doctor's command prints, in this process; and how it ended."""
    out, err, rc = io.StringIO(), io.StringIO(), 0
    before, sys.argv = sys.argv, [name, *map(str, arguments)]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            rc = entry(name)()
    except SystemExit as end:
        rc = end.code
    except Exception as error:  # noqa: BLE001
        return "", f"{type(error).__name__}"
    finally:
        sys.argv = before
    return out.getvalue(), rc if isinstance(rc, (int, str)) else 0


def plain(text):
    text = re.sub(r"[-+]?\d[\d.,e+%-]*", "#", str(text))
    return re.sub(r"#(?:[\s,]+#)+", "#", text)[:160]


def findings(said, found=None):
    """Counts by kind of all that is a warning or worse, wherever it stands in a doctor's answer."""
    found = collections.Counter() if found is None else found
    if isinstance(said, list):
        for one in said:
            findings(one, found)
    elif isinstance(said, dict):
        for level in ["severity", "level", "status", "verdict"]:
            if isinstance(said.get(level), str) and BAD.match(said[level]):
                code = next((said[key] for key in ["code", "check_id", "rule_id", "check", "fault", "type", "metric", "metric_name", "name", "message", "reason"]
                             if isinstance(said.get(key), str)), "")
                more = [plain(said[key]) for key in ["topic", "column", "feature", "stream"] if isinstance(said.get(key), str)]
                found[" ".join([plain(code), *more, said[level].lower()])] += 1
                break
        for one in said.values():
            findings(one, found)
    return found


def parsed(text, rc):
    start = min((place for place in [text.find("{"), text.find("[")] if place >= 0), default=-1)
    if start >= 0:
        with contextlib.suppress(ValueError):
            return findings(json.JSONDecoder().raw_decode(text[start:])[0])
    return collections.Counter({f"no answer, {rc}": 1})


def of_file(path, rc):
    return parsed(path.read_text() if path.exists() else "", rc)


def rules(limits):
    """What baglint and rosbag-doctor are told, and physlint."""
    topics = {topic: {"min_rate": at["rate"][0] / SPARE, "max_gap_ms": at["gap"] * SPARE, "check_stamps": True} for topic, at in limits.items()}
    policy = {}
    for topic, at in limits.items():
        rate = sum(at["rate"]) / 2
        policy[topic] = {"required": True, "rate_hz": rate, "rate_tolerance": (at["rate"][1] / rate - 1) * SPARE + 0.01, "max_gap_ms": at["gap"] * SPARE,
                         "max_jitter_ms": at["jitter"] * SPARE + 0.01, "min_coverage": at["coverage"] / SPARE}
    sync = [topic for topic in [MEASURED, DESIRED] if topic in limits]
    sync = [{"name": "arm", "topics": sync, "reference": MEASURED, "max_offset_ms": 0.5}] if len(sync) == 2 else []
    gaps = {"topic_rates_hz": {topic: at["rate"][1] for topic, at in limits.items()}, "max_gap_multiplier": max(at["gap"] * at["rate"][1] * 1e-3 for at in limits.values()) * SPARE}
    return {"topics": topics}, {"version": 1, "topics": policy, "sync": sync}, {
        "config_version": 1, "adapter": "mcap", "profile": "ros2", "rules": {"ros2.topic_gaps": {"options": gaps},
                                             "ros2.header_clock_skew": {"options": {"max_header_skew_ms": TRANSPORT_NS * 1e-6 * SPARE}}}}


def bag_says(doctor, bag, limits, folder):
    spec, policy, contract = rules(limits)
    if doctor == "baglint":
        (folder / "spec.yaml").write_text(yaml.safe_dump(spec))
        return parsed(*call("baglint", [bag, "-s", folder / "spec.yaml", "-f", "json"]))
    if doctor == "rosbag-doctor":
        (folder / "policy.yaml").write_text(yaml.safe_dump(policy))
        return parsed(*call("rosbag-doctor", [bag, "-c", folder / "policy.yaml", "--format", "json"]))
    if doctor == "clockdoctor":
        _, rc = call("clockdoctor", [bag, "--out-dir", folder])
        [answer] = list(folder.glob("*timeline_data.json")) or [folder / "none"]
        return of_file(answer, rc)
    if doctor == "stamplint":
        return parsed(*call("stamplint", [bag, "--json"]))
    if doctor == "physlint":
        (folder / "physlint.yaml").write_text(yaml.safe_dump(contract))
        return parsed(*call("physlint", ["check", bag, "-c", folder / "physlint.yaml", "-f", "json"]))
    if doctor == "deepen-grade":
        return parsed(*call("deepen", ["grade", bag, "--json", "--quiet"]))
    _, rc = call("rdq", ["check-mcap", bag, "--state-topic", MEASURED, "--action-topic", DESIRED, "--json", folder / "rdq.json", "--no-color"])
    return of_file(folder / "rdq.json", rc)


def set_says(doctor, data, folder):
    if doctor == "lerobot-doctor":
        return parsed(*call("lerobot-doctor", ["check", data, "--json"]))
    if doctor == "robovet":
        _, rc = call("robovet", ["doctor", data, "--json", folder / "robovet.json"])
        return of_file(folder / "robovet.json", rc)
    if doctor == "robot-data-audit":
        _, rc = call("rda", ["audit", data, "--no-video", "-o", folder / "rda.json"])
        said = of_file(folder / "rda.json", rc)
        return said + collections.Counter({"no episode could be read": 1} if rc == 3 else {})
    return lint_says(data)


def lint_says(data):
    """lerobot-lint with its episodes read here: its own reader is LeRobot, and gives the same numbers."""
    from lerobot_lint import engine
    from lerobot_lint.config import load_profile
    from lerobot_lint.types import EpisodeData
    try:
        table = parquet.read_table(data / "data/chunk-000/file-000.parquet")
    except pa.ArrowInvalid:
        return collections.Counter({"no answer": 1})
    if "action" not in table.column_names:
        return collections.Counter({"no answer": 1})
    read = lambda name: np.array(table[name].to_pylist())
    episode, state, action, time = (read(name) for name in ["episode_index", "observation.state", "action", "timestamp"])

    def episodes(*_):
        for k in range(episode[-1] + 1):
            mine = episode == k
            yield k, EpisodeData(state[mine].astype(np.float32), action[mine].astype(np.float32), time[mine], 1000.0, "move", {}), None
    engine.iter_episodes = episodes
    said = engine.check_dataset(str(data), load_profile("default"))
    return findings([vars(finding) for finding in said])


def check_says(program, folder):
    done = subprocess.run([program, "check", str(folder), "--json"], capture_output=True, text=True)
    return parsed(done.stdout, done.returncode)


# One session.

# What a doctor that reads times alone has said, by the times.
SAID = {}


def digest(*times):
    return hashlib.sha256(b"".join(name.encode() + values.tobytes() for by_name in times for name, values in by_name.items())).hexdigest()


def judged(job):
    root, fault, name, program, limits, doctors = job
    folder = root / fault / name
    clips, joints, clean_name = session_of(folder)
    clean, _, _ = session_of(root / "clean" / clean_name.replace(" ", "_").replace("/", "_"))
    if fault in MENDED:
        clips = put_in(fault, session_of(root / "clean" / clean_name.replace(" ", "_"))[0], int(name))
    if fault == "CutFile":
        clips = clean
    said = {}
    with tempfile.TemporaryDirectory() as temporary:
        temporary = Path(temporary)
        session = temporary / "session"
        session.mkdir()
        (session / "cell.toml").write_text((folder / "cell.toml").read_text())
        bags, times, same_times = [], [], fault not in ("clean", "CutFile")
        for number, (clip, whole) in enumerate(zip(clips, clean)):
            stamps = header_stamps(fault, clip)
            arrivals = arrivals_of(stamps, whole)
            true = header_stamps("clean", whole)
            same_times &= all(np.array_equal(stamps[one], true[one]) for one in stamps)
            write_bag(session / f"clip_{number:02}.mcap", clip, joints, stamps, arrivals)
            if number == 0:
                bags.append(session / f"clip_{number:02}.mcap")
                times.append(digest(stamps, arrivals))
            if number == 0 and any(np.any(arrivals[one] != stamps[one] + TRANSPORT_NS) for one in stamps):
                bags.append(temporary / "as_stamped.mcap")
                arrivals = {one: stamps[one] + TRANSPORT_NS for one in stamps}
                write_bag(bags[-1], clip, joints, stamps, arrivals)
                times.append(digest(stamps, arrivals))
            if fault == "CutFile":
                cut(session / f"clip_{number:02}.mcap", int(name))
        data = write_set(temporary / "set", clips, joints)
        if fault == "CutFile":
            cut(data, int(name))
        for doctor in doctors:
            work = temporary / doctor
            work.mkdir()
            if doctor == "check":
                said[doctor] = check_says(program, session)
            elif fault == "HalfWidths" or doctor in BY_TIMES and same_times:
                said[doctor] = None
            elif doctor in BAGS:
                said[doctor] = collections.Counter()
                for number, bag in enumerate(bags):
                    within = work / str(number)
                    within.mkdir()
                    key = (doctor, clean_name.split()[0], times[number]) if doctor in BY_TIMES and fault != "CutFile" else None
                    if key is None or key not in SAID:
                        SAID[key] = bag_says(doctor, bag, limits[clean_name.split()[0]], within)
                    said[doctor] |= SAID[key]
            else:
                said[doctor] = set_says(doctor, temporary / "set", work)
    return {"fault": fault, "name": name, "clean": clean_name, "said": said}


def is_fit(clean):
    """Every second clean session of a sort is for limits."""
    return int(clean.split()[-1]) % 2 == 1


def limits_of(root):
    """Rates, gaps, jitter and coverage of each topic in the clean sessions that are for limits, by sort."""
    limits = collections.defaultdict(dict)
    for folder in sorted((root / "clean").iterdir()):
        clips, _, name = session_of(folder)
        if not is_fit(name):
            continue
        ends = [(s.stamps[0], s.stamps[-1]) for s in clips[0].values() if len(s)]
        span = max(last for _, last in ends) - min(first for first, _ in ends)
        for series, topic in TOPICS.items():
            stamps = clips[0][series].stamps
            if len(stamps) < 2:
                continue
            steps = np.diff(stamps) * 1e-6
            rate, jitter = 1e3 / steps.mean(), float(np.percentile(np.abs(steps - np.median(steps)), 95))
            coverage = float((stamps[-1] - stamps[0]) / span)
            at = limits[name.split()[0]].setdefault(topic, {"rate": [rate, rate], "gap": 0.0, "jitter": 0.0, "coverage": 1.0})
            at["rate"] = [float(min(at["rate"][0], rate)), float(max(at["rate"][1], rate))]
            at["gap"], at["jitter"] = max(at["gap"], float(steps.max())), max(at["jitter"], jitter)
            at["coverage"] = min(at["coverage"], coverage)
    return dict(limits)


# The table.

def words(fault):
    return re.sub(r"(?<!^)([A-Z])", r" \1", fault).lower()


def table(results, doctors):
    clean = [one for one in results if one["fault"] == "clean" and not one["clean"].startswith("causes")]
    by_name = {one["clean"]: one["said"] for one in clean}
    for one in results:
        one["said"] = {doctor: by_name[one["clean"]].get(doctor, {}) if said is None else said for doctor, said in one["said"].items()}
    at_most = {doctor: collections.defaultdict(collections.Counter) for doctor in doctors}
    for one in filter(lambda one: is_fit(one["clean"]), clean):
        for doctor in doctors:
            at_most[doctor][one["clean"].split()[0]] |= collections.Counter(one["said"].get(doctor, {}))
    held = [one for one in clean if not is_fit(one["clean"])]
    alarms = lambda one, doctor: [kind for kind, count in one["said"][doctor].items() if count > at_most[doctor][one["clean"].split()[0]][kind]]
    raised = {doctor: collections.Counter(kind for one in held if doctor in one["said"] for kind in alarms(one, doctor)) for doctor in doctors}
    noise = {doctor: {kind for kind, count in raised[doctor].items() if count > FALSE_ALARMS * len(held)} for doctor in doctors}
    believed = lambda one, doctor: [kind for kind in alarms(one, doctor) if kind not in noise[doctor]]
    groups = collections.defaultdict(list)
    for one in results:
        if one["fault"] != "clean":
            groups[one["fault"]].append(one)
    kinds = collections.defaultdict(collections.Counter)
    others = [doctor for doctor in doctors if doctor != "check"]
    heads = [*doctors, "any but check"]

    def cells(ones):
        """Alarms and trials by doctor, and those in which any doctor but `check` has one."""
        heard = {doctor: [bool(believed(one, doctor)) for one in ones if doctor in one["said"]] for doctor in doctors}
        either = [any(believed(one, doctor) for doctor in others if doctor in one["said"]) for one in ones]
        return [(sum(raised), len(raised)) for raised in [*heard.values(), either]]
    lines, found_by_none = [], []
    for fault, ones in sorted(groups.items()):
        counted = cells(ones)
        for one in ones:
            for doctor in doctors:
                kinds[fault, doctor].update(believed(one, doctor) if doctor in one["said"] else [])
        shown = [f"{count}" if trials == len(ones) else f"{count} of {trials}" for count, trials in counted]
        if counted[-1][0] or counted[0][0] < counted[0][1]:
            lines.append(f"| {words(fault)} ({len(ones)}) | " + " | ".join(shown) + " |")
        else:
            found_by_none.append(f"{words(fault)} ({len(ones)})")
    total = cells([one for ones in groups.values() for one in ones])
    lines.append("| all faults | " + " | ".join(f"{100 * count / max(1, trials):.0f} %" for count, trials in total) + " |")
    lines.append("| false alarms | " + " | ".join(f"{count} of {trials}" for count, trials in cells(held)) + " |")
    header = ["| fault (trials) | " + " | ".join(heads) + " |", "|---|" + "---|" * len(heads)]
    return "\n".join([*header, *lines]) + f"\n\nfound by check in every trial and by no other: {', '.join(found_by_none)}", kinds


def read(path):
    """The sessions with what each doctor said, however many runs it took."""
    by_session = {}
    for line in path.read_text().splitlines() if path.exists() else []:
        one = json.loads(line)
        by_session.setdefault((one["fault"], one["name"]), one)["said"] |= one["said"]
    return list(by_session.values())


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("sessions", type=Path, help="folder that the example wrote")
    arguments.add_argument("--program", default="target/release/calibration")
    arguments.add_argument("--out", type=Path, default=Path("doctors.jsonl"), help="a line a session")
    arguments.add_argument("--jobs", type=int, default=2)
    arguments.add_argument("--trials", type=int, default=10**9, help="at most so many of each fault")
    arguments.add_argument("--clean", type=int, default=10**9, help="at most so many clean sessions of each sort")
    arguments.add_argument("--doctors", nargs="+", choices=DOCTORS, default=DOCTORS)
    arguments.add_argument("--faults", nargs="+", help="only these, and clean ones")
    arguments.add_argument("--table", action="store_true")
    arguments.add_argument("--kinds", action="store_true", help="also what each doctor said of each fault")
    wanted = arguments.parse_args()
    results = read(wanted.out)
    if not wanted.table:
        asked = {(one["fault"], one["name"]): set(one["said"]) for one in results}
        limits = limits_of(wanted.sessions)
        jobs = []
        for fault in sorted(wanted.sessions.iterdir(), key=lambda fault: (fault.name != "clean", fault.name)):
            names = sorted((one.name for one in fault.iterdir()), key=lambda name: (len(name), name))
            if fault.name == "clean":
                names = [name for name in names if not name.startswith("causes") and int(name.split("_")[-1]) <= wanted.clean]
            elif wanted.faults and fault.name not in wanted.faults:
                continue
            else:
                names = names[:wanted.trials]
            for name in names:
                missing = [doctor for doctor in wanted.doctors if doctor not in asked.get((fault.name, name), ())]
                jobs += [(wanted.sessions, fault.name, name, wanted.program, limits, missing)] if missing else []
        # A trial of each fault, then the second of each: what is there is even.
        jobs.sort(key=lambda job: int(job[2].split("_")[-1]))
        with concurrent.futures.ProcessPoolExecutor(wanted.jobs) as pool, wanted.out.open("a") as stream:
            for count, ended in enumerate(concurrent.futures.as_completed([pool.submit(judged, job) for job in jobs]), 1):
                result = ended.result()
                stream.write(json.dumps(result) + "\n")
                stream.flush()
                print(f"\r{count} of {len(jobs)}", end="", file=sys.stderr, flush=True)
    text, kinds = table(read(wanted.out), wanted.doctors)
    print(text)
    if wanted.kinds:
        for (fault, doctor), said in sorted(kinds.items()):
            for kind, count in said.most_common(4):
                print(f"{fault}: {doctor}: {count} x {kind}")


if __name__ == "__main__":
    main()
