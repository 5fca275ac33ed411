"""Does an exported model move as the twin does? Writes the model of each session with `calibration export-model`, lets MuJoCo
drive it by the recorded commands, and compares it with what `twin replay` makes of the same commands and parameters.

    python tests/peers/replay_model.py --programs target/release SESSION[=theta.toml] ...
"""
import argparse
import os
import sys
import tempfile

from program import Failed, answer, ending_by_signals, note

try:
    import mujoco
    import numpy as np
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory
    from mujoco_cell import model as peers
except ModuleNotFoundError as missing:
    sys.exit(f"{missing.name} is not installed; `pip install -r tests/peers/requirements.txt` in a virtual environment")

TICK = 1e-3  # of the commands [s]


def document():
    """The functions of docs/export_model.md, which are what is checked here."""
    path = os.path.join(os.path.dirname(__file__), "..", "..", "docs", "export_model.md")
    with open(path) as stream:
        blocks = [block.split("```")[0] for block in stream.read().split("```python\n")[1:]]
    names = {}
    for block in blocks:
        exec(block, names)
    return names


DOCUMENT = document()


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="Joints: root mean square of MuJoCo less twin over all joints and clips, and the worst joint of the worst clip, in\n"
               "microrad. Object: ADD, mean over each clip, the median, the mean and the worst of the clips, and of where it comes to\n"
               "rest, in mm.")
    parser.add_argument("--programs", required=True, metavar="FOLDER", help="where the built `twin` and `calibration` lie")
    parser.add_argument("--clips", type=int, default=100, metavar="N", help="at most so many of each session [default: all]")
    parser.add_argument("--continuous", action="store_true", help="the control law in every step of MuJoCo, not held for a millisecond")
    parser.add_argument("--own", action="store_true", help="brings a model of the arm of another hand up to date, and replays that")
    parser.add_argument("--per-clip", action="store_true", help="a line for each clip, too")
    parser.add_argument("sessions", nargs="+", metavar="SESSION[=THETA.TOML]")
    return parser.parse_args()


def own(text):
    """A model of the peers for the cell of `text`, with joint names of its own and nothing that was found."""
    build = peers.Build(peers.Engine(substeps=10), peers.Tool(), rotor=np.zeros(7))
    build.on_table = ['<geom name="table" type="plane" size="3 3 0.1"/>'] if "object_position" in text else []
    bare = peers.mjcf(build).replace("</worldbody>", "".join(build.on_table) + "</worldbody>")
    return mujoco.MjSpec.from_string(bare).to_xml()


class Replay:
    """One clip as `twin replay` writes it: commands and what the twin makes of them, a row for each millisecond."""

    def __init__(self, path):
        with open(path, "rb") as stream:
            messages = make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages(["/arm/state", "/twin/state"])
            rows = {"/arm/state": [], "/twin/state": []}
            for _, channel, _, message in messages:
                rows[channel.topic].append(message)
        of = lambda topic, name: np.array([getattr(message, name) for message in rows[topic]])
        stamps = of("/twin/state", "stamp_ns").astype(np.int64)
        self.t = (stamps - stamps[0]) * 1e-9
        command = (of("/arm/state", "stamp_ns").astype(np.int64) - stamps[0]) * 1e-9
        self.dof = len(rows["/twin/state"][0].q)
        # The newest command at each tick.
        self.ticks = int(round(self.t[-1] / TICK)) + 1
        newest = np.clip(np.searchsorted(command, np.arange(self.ticks) * TICK + 1e-6) - 1, 0, len(command) - 1)
        self.q_d, self.dq_d = of("/arm/state", "q_d")[newest, :self.dof], of("/arm/state", "dq_d")[newest, :self.dof]
        self.q, self.dq = of("/twin/state", "q"), of("/twin/state", "dq")
        self.has_object = rows["/twin/state"][0].has_object
        self.place, self.turn = of("/twin/state", "object_position"), of("/twin/state", "object_orientation")


class Cell:
    """The exported model, driven as docs/export_model.md says."""

    def __init__(self, text, holds):
        self.model, self.holds = mujoco.MjModel.from_xml_string(text), holds
        self.data = mujoco.MjData(self.model)
        kind = self.model.actuator_trnid[:, 0]
        named = lambda end: [i for i in range(self.model.nu) if self.model.actuator(i).name.endswith(end)]
        self.position, self.velocity = named("_position"), named("_velocity")
        joints = kind[self.position]
        self.at, self.dofs = self.model.jnt_qposadr[joints], self.model.jnt_dofadr[joints]
        self.object = self.model.joint("object") if any(self.model.joint(i).name == "object" for i in range(self.model.njnt)) else None

    def start(self, q, dq, q_d, dq_d, pose):
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        data.qpos[self.at], data.qvel[self.dofs] = q, dq
        if self.object is not None and pose is not None:
            data.qpos[self.object.qposadr[0]:][:7] = np.concatenate(pose)
        for actuators, values in ((self.position, q_d), (self.velocity, dq_d)):
            for actuator, value in zip(actuators, values):
                # The command was there for long: in the delay and in the low-pass.
                samples = int(model.actuator_history[actuator][0])
                if samples > 0:
                    times = (np.arange(samples) - samples) * model.opt.timestep
                    mujoco.mj_initCtrlHistory(model, data, actuator, times, np.full(samples, value))
                if model.actuator_actadr[actuator] >= 0:
                    data.act[model.actuator_actadr[actuator]] = value
        mujoco.mj_forward(model, data)
        for sensor, value in zip(("object_position", "object_orientation"), pose or ()):
            number = model.sensor(sensor).id
            if (samples := int(model.sensor_history[number][0])) > 0:
                times = (np.arange(samples) - samples) * model.opt.timestep
                mujoco.mj_initSensorHistory(model, data, number, times, np.tile(value, (samples, 1)), 0.0)
        mujoco.mj_forward(model, data)

    def tick(self, q_d, dq_d):
        model, data = self.model, self.data
        data.ctrl[self.position] = q_d
        data.ctrl[self.velocity] = dq_d
        if self.holds:
            DOCUMENT["millisecond"](model, data, self.dofs, self.at)
            return
        for _ in range(round(TICK / model.opt.timestep)):
            if len(self.velocity):
                data.qfrc_applied[self.dofs] = DOCUMENT["coriolis"](model, data)[self.dofs]
            mujoco.mj_step(model, data)

    def reading(self):
        """Positions at the time of the velocities: a semi-implicit step leaves them half a step ahead."""
        rk4 = self.model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
        return self.data.qpos[self.at] - (0.0 if rk4 else 0.5 * self.model.opt.timestep) * self.data.qvel[self.dofs]

    def pose(self):
        """The object's pose as the model's sensors give it, late where the camera is."""
        return self.data.sensor("object_position").data.copy(), self.data.sensor("object_orientation").data.copy()


def rotation(turn):
    out = np.zeros(9)
    mujoco.mju_quat2Mat(out, np.asarray(turn, float))
    return out.reshape(3, 3)


def add(points, one, other):
    """Mean distance of an object's points in two poses [m]."""
    (p, r), (q, s) = ((np.asarray(place), rotation(turn)) for place, turn in (one, other))
    return np.linalg.norm(points @ r.T + p - points @ s.T - q, axis=1).mean()


def compared(cell, replay):
    """Differences of the joints [rad] at the twin's rows, and of the object's poses [m]."""
    pose = (replay.place[0], replay.turn[0]) if replay.has_object else None
    cell.start(replay.q[0], replay.dq[0], replay.q_d[0], replay.dq_d[0], pose)
    points = None
    if replay.has_object and cell.object is not None:
        half = cell.model.geom("object").size
        points = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    rows = np.rint(replay.t / TICK).astype(int)
    joints, adds, row = [], [], 0
    for tick in range(replay.ticks):
        while row < len(rows) and rows[row] == tick:
            joints.append(cell.reading() - replay.q[row])
            if points is not None:
                adds.append(add(points, cell.pose(), (replay.place[row], replay.turn[row])))
            row += 1
        cell.tick(replay.q_d[tick], replay.dq_d[tick])
    return np.array(joints), np.array(adds)


def session(given, folder, theta, place):
    """Compares all clips of a session."""
    calibration, twin = (os.path.join(given.programs, name) for name in ("calibration", "twin"))
    parameters = ["--parameters", theta] if theta else []
    model, out = os.path.join(place, "cell.xml"), os.path.join(place, "clip.mcap")
    export = [calibration, "export-model", folder, *parameters, "--to", "mjcf", "--force", "--json"]
    answer([*export, "--out", model])
    if given.own:
        bare = os.path.join(place, "own.xml")
        with open(model) as stream, open(bare, "w") as into:
            into.write(own(stream.read()))
        names = ",".join(f"motor{i}" for i in range(7))
        answer([*export, "--base", bare, "--base-joints", names, "--out", model])
    with open(model) as stream:
        cell, joints, adds = Cell(stream.read(), not given.continuous), [], []
    clips = sorted(name for name in os.listdir(folder) if name.endswith(".mcap"))[:given.clips]
    for clip in clips:
        answer([twin, "replay", os.path.join(folder, clip), *parameters, "--out", out, "--force", "--json"])
        off, apart = compared(cell, Replay(out))
        joints.append(off)
        adds.append(apart)
        if given.per_clip:
            rms = " ".join(f"{1e6 * x:6.1f}" for x in np.sqrt((off**2).mean(axis=0)))
            note(f"  {clip} {rms}" + (f"  ADD {1e3 * apart.mean():.2f} end {1e3 * apart[-1]:.2f} mm" if len(apart) else ""))
    whole = np.sqrt(np.mean(np.concatenate(joints) ** 2))
    worst = max(np.sqrt((off**2).mean(axis=0)).max() for off in joints)
    line = f"{os.path.basename(folder):16s} {1e6 * whole:8.1f} {1e6 * worst:8.1f}"
    if all(len(apart) for apart in adds):
        means, ends = [apart.mean() * 1e3 for apart in adds], [apart[-1] * 1e3 for apart in adds]
        line += f"  {np.median(means):8.2f} {np.mean(means):6.2f} {np.max(means):6.2f}   {np.median(ends):8.2f}"
    print(line, flush=True)


def main():
    given = arguments()
    ending_by_signals()
    print(f"{'session':16s} {'joints':>8s} {'worst':>8s}  {'object':>8s} {'mean':>6s} {'worst':>6s}   {'at rest':>8s}")
    for one in given.sessions:
        folder, _, theta = one.partition("=")
        with tempfile.TemporaryDirectory() as place:
            try:
                session(given, os.path.normpath(folder), theta, place)
            except Failed as error:
                note(f"{folder}: {error}")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
