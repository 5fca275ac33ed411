#!/usr/bin/env python3
"""Writes the logs that the tests import, each with the tool of its own format.

    python3 -m venv venv && venv/bin/pip install -r shared_mem/import/tests/requirements.txt
    venv/bin/python shared_mem/import/tests/make_fixtures.py shared_mem/import/tests/fixtures

The motion is a formula (see `motion` below, and `motion` of tests/logs/formats.rs), so that a test knows every number.
"""

import json
import math
import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

ROWS, JOINTS, STEP = 60, 7, 0.02
START_NS = 1_700_000_000_000_000_000
LAG = 0.03
MEASURED = "/franka_robot_state_broadcaster/measured_joint_states"
DESIRED = "/franka_robot_state_broadcaster/desired_joint_states"
NAMES = [f"fr3_joint{i + 1}" for i in range(JOINTS)]
SERVOS = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll"]


def motion(k, i, lag=0.0):
    """Position [rad] and velocity [rad/s] of joint i in row k."""
    w = 2 * math.pi * (0.8 + 0.1 * i)
    t = k * STEP - lag
    return 0.2 * math.sin(w * t) + 0.1 * i, 0.2 * w * math.cos(w * t)


def rows(lag, joints=JOINTS):
    numbers = np.array([[motion(k, i, lag) for i in range(joints)] for k in range(ROWS)])
    return np.ascontiguousarray(numbers[:, :, 0]), np.ascontiguousarray(numbers[:, :, 1])


Q, DQ = rows(LAG)
Q_D, DQ_D = rows(0.0)
TAU = 2.0 + np.arange(JOINTS) + Q
TAU_D = 0.5 * Q
STAMPS = [START_NS + k * 20_000_000 for k in range(ROWS)]
OBJECT = [(0.5 + 1e-3 * k, 0.1, 0.05) for k in range(ROWS)]


def split(ns):
    return divmod(ns, 1_000_000_000)


def joint_state(store, ns, q, dq, tau, seq=None):
    types = store.types
    time = types["builtin_interfaces/msg/Time"](*split(ns))
    header = types["std_msgs/msg/Header"]
    header = header(stamp=time, frame_id="") if seq is None else header(seq=seq, stamp=time, frame_id="")
    return types["sensor_msgs/msg/JointState"](header=header, name=NAMES, position=q, velocity=dq, effort=tau)


def pose_stamped(store, ns, xyz, seq=None):
    types = store.types
    time = types["builtin_interfaces/msg/Time"](*split(ns))
    header = types["std_msgs/msg/Header"]
    header = header(stamp=time, frame_id="base") if seq is None else header(seq=seq, stamp=time, frame_id="base")
    pose = types["geometry_msgs/msg/Pose"](
        position=types["geometry_msgs/msg/Point"](*xyz),
        orientation=types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
    )
    return types["geometry_msgs/msg/PoseStamped"](header=header, pose=pose)


def rosbag2(folder, plugin):
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer2(folder, version=9, storage_plugin=plugin) as writer:
        add = lambda topic, kind: (writer.add_connection(topic, kind, typestore=store), kind)
        measured = add(MEASURED, "sensor_msgs/msg/JointState")
        desired = add(DESIRED, "sensor_msgs/msg/JointState")
        image = add("/camera/color/image_raw", "sensor_msgs/msg/Image")
        put = lambda to, ns, message: writer.write(to[0], ns, store.serialize_cdr(message, to[1]))
        for k, ns in enumerate(STAMPS):
            put(measured, ns, joint_state(store, ns, Q[k], DQ[k], TAU[k]))
            put(desired, ns, joint_state(store, ns, Q_D[k], DQ_D[k], TAU_D[k]))
        types = store.types
        header = types["std_msgs/msg/Header"](stamp=types["builtin_interfaces/msg/Time"](*split(STAMPS[0])), frame_id="")
        picture = np.zeros(12 * 16 * 3, dtype=np.uint8)
        put(image, STAMPS[0], types["sensor_msgs/msg/Image"](header, 12, 16, "rgb8", 0, 48, picture))


FRANKA_STATE = """std_msgs/Header header
float64[6] cartesian_collision
float64[6] cartesian_contact
float64[7] q
float64[7] q_d
float64[7] dq
float64[7] dq_d
float64[7] ddq_d
float64[7] theta
float64[7] dtheta
float64[7] tau_J
float64[7] dtau_J
float64[7] tau_J_d
float64[6] K_F_ext_hat_K
float64[16] O_T_EE
float64 time
float64 control_command_success_rate
uint8 ROBOT_MODE_OTHER=0
uint8 ROBOT_MODE_IDLE=1
uint8 robot_mode
franka_msgs/Errors current_errors
"""


def ros1(path, compression, with_state):
    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg("bool joint_position_limits_violation\nbool reflex\n", "franka_msgs/msg/Errors"))
    store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms\n", "tf2_msgs/msg/TFMessage"))
    store.register(get_types_from_msg(FRANKA_STATE, "franka_msgs/msg/FrankaState"))
    types = store.types
    writer = Writer1(path)
    if compression:
        writer.set_compression(compression)
    with writer:
        add = lambda topic, kind: (writer.add_connection(topic, kind, typestore=store), kind)
        put = lambda to, ns, message: writer.write(to[0], ns, store.serialize_ros1(message, to[1]))
        if with_state:
            state = add("/franka_state_controller/franka_states", "franka_msgs/msg/FrankaState")
        else:
            measured = add("/joint_states", "sensor_msgs/msg/JointState")
            desired = add("/joint_states_desired", "sensor_msgs/msg/JointState")
        poses = add("/object/pose", "geometry_msgs/msg/PoseStamped")
        frames = add("/tf", "tf2_msgs/msg/TFMessage")
        for k, ns in enumerate(STAMPS):
            time = types["builtin_interfaces/msg/Time"](*split(ns))
            header = types["std_msgs/msg/Header"](seq=k, stamp=time, frame_id="base")
            if with_state:
                zeros = lambda n: np.zeros(n)
                put(state, ns, types["franka_msgs/msg/FrankaState"](
                    header, zeros(6), zeros(6), Q[k], Q_D[k], DQ[k], DQ_D[k], zeros(7), Q[k], DQ[k], TAU[k], zeros(7),
                    TAU_D[k], zeros(6), np.eye(4).T.flatten(), 1e-3 * k, 1.0, 1,
                    types["franka_msgs/msg/Errors"](False, False)))
            else:
                put(measured, ns, joint_state(store, ns, Q[k], DQ[k], TAU[k], seq=k))
                put(desired, ns, joint_state(store, ns, Q_D[k], DQ_D[k], TAU_D[k], seq=k))
            put(poses, ns, pose_stamped(store, ns, OBJECT[k], seq=k))
            transform = types["geometry_msgs/msg/TransformStamped"](
                header, "hand", types["geometry_msgs/msg/Transform"](
                    types["geometry_msgs/msg/Vector3"](0.4, 0.0, 0.5), types["geometry_msgs/msg/Quaternion"](1.0, 0.0, 0.0, 0.0)))
            put(frames, ns, types["tf2_msgs/msg/TFMessage"]([transform]))


def lerobot(folder, version):
    """Two episodes, degrees as LeRobot's SO arms have them."""
    q, _ = rows(LAG, 5)
    q_d, _ = rows(0.0, 5)
    names = [f"{name}.pos" for name in SERVOS] + ["gripper.pos"]
    widen = lambda degrees, grip: np.column_stack([degrees, np.full(len(degrees), grip)]).astype(np.float32)
    state, action = widen(np.degrees(q), 10.0), widen(np.degrees(q_d), 12.0)
    episodes = [(0, slice(0, ROWS)), (1, slice(0, 40))]
    frames = []
    for number, part in episodes:
        length = len(state[part])
        frames.append(pd.DataFrame({
            "action": list(action[part]),
            "observation.state": list(state[part]),
            "timestamp": (np.arange(length) * STEP).astype(np.float32),
            "frame_index": np.arange(length),
            "episode_index": np.full(length, number),
            "index": np.arange(length),
            "task_index": np.zeros(length, dtype=np.int64),
        }))
    schema = pa.schema([
        ("action", pa.list_(pa.float32(), 6)), ("observation.state", pa.list_(pa.float32(), 6)),
        ("timestamp", pa.float32()), ("frame_index", pa.int64()), ("episode_index", pa.int64()),
        ("index", pa.int64()), ("task_index", pa.int64()),
    ])
    if version == "v2.1":  # There the lists have no length of their own.
        schema = pa.schema([pa.field(f.name, pa.list_(pa.float32())) if pa.types.is_fixed_size_list(f.type) else f for f in schema])
    feature = lambda: {"dtype": "float32", "shape": [6], "names": names}
    scalar = lambda dtype: {"dtype": dtype, "shape": [1], "names": None}
    info = {
        "codebase_version": version, "robot_type": "so101_follower", "total_episodes": 2,
        "total_frames": sum(map(len, frames)), "total_tasks": 1, "chunks_size": 1000, "fps": 50, "splits": {"train": "0:2"},
        "features": {
            "action": feature(), "observation.state": feature(),
            "observation.images.front": {"dtype": "video", "shape": [480, 640, 3], "names": ["height", "width", "channels"]},
            "timestamp": scalar("float32"), "frame_index": scalar("int64"), "episode_index": scalar("int64"),
            "index": scalar("int64"), "task_index": scalar("int64"),
        },
    }
    (folder / "meta").mkdir(parents=True)
    data = folder / "data/chunk-000"
    data.mkdir(parents=True)
    if version == "v3.0":
        info["data_path"] = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
        pq.write_table(pa.Table.from_pandas(pd.concat(frames), schema=schema, preserve_index=False), data / "file-000.parquet")
        meta = folder / "meta/episodes/chunk-000"
        meta.mkdir(parents=True)
        pd.DataFrame({"episode_index": [0, 1], "length": list(map(len, frames))}).to_parquet(meta / "file-000.parquet")
    else:
        info["data_path"] = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
        for number, frame in enumerate(frames):
            table = pa.Table.from_pandas(frame, schema=schema, preserve_index=False)
            pq.write_table(table, data / f"episode_{number:06d}.parquet")
    (folder / "meta/info.json").write_text(json.dumps(info, indent=1) + "\n")


def tables(folder):
    columns = {"time": np.arange(ROWS) * STEP}
    for i in range(JOINTS):
        columns |= {f"q{i + 1}": Q[:, i], f"dq{i + 1}": DQ[:, i], f"tau{i + 1}": TAU[:, i], f"q_des{i + 1}": Q_D[:, i]}
    pd.DataFrame(columns).to_csv(folder / "plain.csv", index=False)
    # Degrees and milliseconds, joints by name, commands in another order and one of them turned round.
    columns = {"stamp": np.arange(ROWS) * 20}
    order = [1, 0, 2]
    for i, name in enumerate(["base", "shoulder", "elbow"]):
        columns |= {f"{name}_pos": np.degrees(Q[:, i] * 3), f"{name}_vel": np.degrees(DQ[:, i] * 3)}
    for place, i in enumerate(order):
        columns[f"cmd_{place}"] = np.degrees(Q_D[:, i] * 3) * (-1 if i == 2 else 1)
    pd.DataFrame(columns).to_csv(folder / "degrees.tsv", sep="\t", index=False)
    arrays = dict(t=np.arange(ROWS) * STEP, q=Q, dq=DQ, q_d=Q_D, tau_J=TAU, pictures=np.zeros((2, 4, 4, 3), np.uint8))
    np.savez(folder / "log.npz", **arrays)
    np.savez_compressed(folder / "small.npz", **arrays)
    # Nothing says what the columns are, or when their rows were.
    np.savetxt(folder / "unnamed.csv", np.column_stack([Q[:, :2], Q_D[:, :2]]), delimiter=",")


def libfranka(folder):
    """As franka::logToCSV writes: today's header, and the one of before 0.14."""
    name = lambda base, n: [f"{base}[{i}]" for i in range(n)]
    state = [("q", Q), ("q_d", Q_D), ("dq", DQ), ("dq_d", DQ_D), ("tau_J", TAU), ("tau_ext_hat_filtered", 0 * Q)]
    command = [("q_d", Q_D, 7), ("dq_d", DQ_D, 7), ("O_T_EE_d", None, 16), ("O_dP_EE_d", None, 6), ("tau_J_d", TAU_D, 7)]
    text = lambda values: ",".join(f"{float(v):.6g}" for v in values)
    states = [text(np.concatenate([array[k] for _, array in state])) for k in range(ROWS)]
    commands = [",".join(text(np.zeros(n) if a is None else a[k]) for _, a, n in command) for k in range(ROWS)]
    new = ["time", "success_rate"] + sum((name(f"state.{b}", 7) for b, _ in state), []) \
        + sum((name(f"cmd.{b}", n) for b, _, n in command), [])
    old = "duration, success rate, " + ",".join(", ".join(name(b, 7)) for b, _ in state) \
        + ",sent commands," + ",".join(", ".join(name(b, n)) for b, _, n in command)
    lines = lambda between: [f"{20 * k},1,{states[k]}{between}{commands[k]}" for k in range(ROWS)]
    (folder / "libfranka.csv").write_text("\n".join([",".join(new)] + lines(",")) + "\n")
    (folder / "libfranka_old.csv").write_text("\n".join([old] + lines(",,")) + "\n")


def sage(folder):
    folder.mkdir()
    q, dq = rows(LAG, 5)
    q_d, _ = rows(0.0, 5)
    (folder / "joint_list.txt").write_text("\n".join(SERVOS) + "\n")
    row = lambda kind, k, *lists: ",".join([kind, f"{20000.0 * k + 5e6:.1f}"] + [f'"{[float(v) for v in l]}"' for l in lists])
    head = "type,timestamp,positions"
    control = [head] + [row("CONTROL", k, q_d[k]) for k in range(ROWS)]
    motor = [head + ",velocities,torques"] + [row("STATE_MOTOR", k, q[k], dq[k], 0.1 * q[k]) for k in range(ROWS)]
    (folder / "control.csv").write_text("\n".join(control) + "\n")
    (folder / "state_motor.csv").write_text("\n".join(motor) + "\n")
    events = ["type,timestamp,event", f"EVENT,{5e6 + 20000.0 * 5},MOTION_START", f"EVENT,{5e6 + 20000.0 * 50},DISABLE"]
    (folder / "event.csv").write_text("\n".join(events) + "\n")


def main(folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    rosbag2(folder / "rosbag2_mcap", StoragePlugin.MCAP)
    rosbag2(folder / "rosbag2_sqlite3", StoragePlugin.SQLITE3)
    ros1(folder / "franka_state.bag", None, True)
    ros1(folder / "joint_states_bz2.bag", Writer1.CompressionFormat.BZ2, False)
    ros1(folder / "joint_states_lz4.bag", Writer1.CompressionFormat.LZ4, False)
    lerobot(folder / "lerobot_v21", "v2.1")
    lerobot(folder / "lerobot_v3", "v3.0")
    tables(folder)
    libfranka(folder)
    sage(folder / "sage_motion")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
