"""Friction and damping of hinges and slides: `calibration identify joint` on pushes simulated by MuJoCo.

    joints.py --program target/release/calibration --out joints --sessions 20 [--pushes 3] [--noise 0.2] [--kinds laptop box drawer gate]

Each session draws an object (masses and sizes; a laptop's lid that stands or falls shut, a box's lid, a drawer, a gate with an upright axis),
its dry friction and damping, and how it is seen: 30 or 60 poses a second of each link, noise of 1 mm and 5 mrad, half of it lasting for
some frames. A force ramps up on the part, and ends while it moves; nothing says when. Some parts run into a stop.

A line a session: what was found beside the truth, then the table by kind: errors of friction, of damping, of the torque that slows the
part at its mean speed, and how often the 95 % intervals hold.
"""

import argparse
import json
import subprocess
from pathlib import Path

import mujoco
import numpy as np
from mujoco_cell import bag

KINDS = ("laptop", "box", "drawer", "gate")
STEP = 2e-4
SETTLE, RAMP = 0.7, 0.25  # [s]


def draw(kind, rng):
    """Sizes [m], masses [kg], joint, and how its part is pushed."""
    width, depth = rng.uniform(0.25, 0.35), rng.uniform(0.18, 0.3)
    thick = rng.uniform(0.006, 0.02)
    mass = rng.uniform(0.2, 1.0)
    slides = kind == "drawer"
    if kind == "drawer":
        part, middle, axis, at = (depth, width, 0.08), (0, 0, 0), (1, 0, 0), (0, 0, 0.1)
        mass, limits, start = rng.uniform(0.5, 3.0), (0.0, 0.35), rng.uniform(0.0, 0.05)
    elif kind == "gate":
        part, middle, axis, at = (depth, thick, width), (depth / 2, 0, 0), (0, 0, 1), (0, 0, 0.3)
        limits, start = (-0.1, 2.5), rng.uniform(0, 0.3)
    else:
        # Lies along x at 0 and opens upwards.
        part, middle, axis, at = (depth, width, thick), (depth / 2, 0, 0), (0, -1, 0), (0, 0, 0.05)
        limits, start = (0.0, 2.2), rng.uniform(0.05, 0.4) if kind == "box" else rng.uniform(0.6, 1.2)
    inertia = mass if slides else mass * (depth**2 / 3)
    lever = 0.0 if slides or kind == "gate" else mass * 9.81 * depth / 2
    rate = rng.uniform(1.0, 4.0) * (0.15 if slides else 1.0)  # speed at the end of the push
    # Stops within some tenths of a second to two, part of it by friction that is dry.
    stops, dry = rng.uniform(0.3, 1.5), rng.uniform(0.15, 0.9)
    friction = dry * inertia * rate / stops + (rng.uniform(0.3, 0.9) * lever if kind == "box" else 0.0)
    if kind == "laptop":
        friction += rng.uniform(0.0, 1.2) * lever
    damping = (1 - dry) * inertia / stops
    return dict(
        kind=kind, part=part, middle=middle, axis=axis, at=at, mass=mass, limits=limits, start=start, rate=rate, slides=slides,
        friction=friction, damping=damping, inertia=inertia, lever=lever,
    )


def text(values):
    return " ".join(f"{value:.9g}" for value in values)


def mjcf(o):
    kind = "slide" if o["slides"] else "hinge"
    return f"""<mujoco><compiler angle="radian"/><option timestep="{STEP}" integrator="implicitfast" cone="elliptic"/>
  <worldbody><body name="part" pos="{text(o['at'])}">
    <joint name="j" type="{kind}" axis="{text(o['axis'])}" limited="true" range="{text(o['limits'])}" solreflimit="0.004 1"
      frictionloss="{o['friction']}" damping="{o['damping']}" solreffriction="0.002 1"/>
    <geom type="box" size="{text(np.array(o['part']) / 2)}" pos="{text(o['middle'])}" mass="{o['mass']}" contype="0" conaffinity="0"/>
  </body></worldbody></mujoco>"""


def urdf(o):
    x, y, z = o["part"]
    m = o["mass"]
    kind = "prismatic" if o["slides"] else "revolute"
    low, high = o["limits"]
    return f"""<robot name="{o['kind']}">
  <link name="base"/>
  <link name="part">
    <inertial><origin xyz="{text(o['middle'])}"/><mass value="{m}"/>
      <inertia ixx="{m * (y * y + z * z) / 12}" iyy="{m * (x * x + z * z) / 12}" izz="{m * (x * x + y * y) / 12}" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="joint" type="{kind}">
    <parent link="base"/><child link="part"/><origin xyz="{text(o['at'])}"/><axis xyz="{text(o['axis'])}"/>
    <limit lower="{low}" upper="{high}" effort="99" velocity="99"/>
  </joint>
</robot>
"""


def push(o, rng, share):
    """Positions every millisecond; a force ramps up and ends once the part has come to its speed, or after a while."""
    model = mujoco.MjModel.from_xml_string(mjcf(o))
    data = mujoco.MjData(model)
    data.qpos[0] = o["start"]
    mujoco.mj_forward(model, data)
    speed = share * o["rate"] * rng.uniform(0.9, 1.1)
    # Downwards for a laptop's lid that stands beyond the upright, and for all others away from the start.
    way = -1.0 if o["kind"] == "laptop" and rng.random() < 0.5 else 1.0
    force = (o["friction"] + o["lever"] + o["damping"] * speed + o["inertia"] * speed / 0.12) * 1.1
    every = round(1e-3 / STEP)
    free, out = None, []
    held = o["lever"] > o["friction"]  # somebody holds the part until the push
    for step in range(round(4.0 / STEP)):
        now = step * STEP
        data.qfrc_applied[0] = 0.0
        if now < SETTLE:
            if held:
                data.qpos[0], data.qvel[0] = o["start"], 0.0
        elif free is None:
            data.qfrc_applied[0] = way * force * min((now - SETTLE) / RAMP, 1.0)
            if abs(data.qvel[0]) >= speed or now > SETTLE + 0.6:
                free = now
        mujoco.mj_step(model, data)
        if step % every == 0:
            out.append(data.qpos[0])
    return np.array(out), free


def turned(axis, angle):
    axis = np.array(axis, float) / np.linalg.norm(axis)
    return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis)])


def times(a, b):
    out = np.zeros(4)
    mujoco.mju_mulQuat(out, a, b)
    return out


class Seen:
    """A tracker's noise: half of its variance lasts for some frames."""

    def __init__(self, rng, noise):
        self.rng, self.lasting = rng, np.zeros(6)
        self.sigma = noise * np.array([1e-3] * 3 + [5e-3] * 3)

    def pose(self, place, turn):
        self.lasting = 0.7 * self.lasting + np.sqrt(1 - 0.49) * self.rng.normal(size=6)
        noise = self.sigma * (self.lasting + self.rng.normal(size=6)) / np.sqrt(2)
        angle = np.linalg.norm(noise[3:])
        return place + noise[:3], times(turn, turned(noise[3:], angle))


def record(folder, o, rng, pushes, noise):
    """Clips as ROS 2 bags, cell.toml and the URDF."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "object.urdf").write_text(urdf(o))
    blocks = ['[[object]]\nname = "thing"\nurdf = "object.urdf"\n']
    every = rng.choice([16, 33])
    yaw = rng.uniform(-3, 3)
    released = []
    base = np.array([0.5, 0.1, 0.02]), turned((0, 0, 1), yaw)
    for clip in range(pushes):
        positions, free = push(o, rng, rng.uniform(0.6, 1.3))
        released.append(free)
        name = f"clip_{clip:02}.mcap"
        with open(folder / name, "wb") as stream:
            written = bag.Bag(stream)
            seen = [Seen(rng, noise), Seen(rng, noise)]
            for row in range(0, len(positions), every):
                q = positions[row]
                turn = base[1] if o["slides"] else times(base[1], turned(o["axis"], q))
                local = np.array(o["at"]) + (np.array(o["axis"], float) * q if o["slides"] else 0)
                rotated = np.zeros(3)
                mujoco.mju_rotVecQuat(rotated, local, base[1])
                ns = bag.START_NS + row * 1_000_000
                written.write("/object/thing/pose", ns, bag.pose(ns, *seen[0].pose(*base)))
                written.write("/object/thing_part/pose", ns, bag.pose(ns, *seen[1].pose(base[0] + rotated, turn)))
            written.close()
        blocks.append(f'[[clip]]\nfile = "{name}"\nkind = "free_motion"\n')
    (folder / "released.json").write_text(json.dumps(released))
    (folder / "cell.toml").write_text("\n".join(blocks))


def judged(program, folder, o):
    done = subprocess.run([program, "identify", "joint", str(folder), "--json"], capture_output=True, text=True)
    if not done.stdout.strip():
        return dict(error=done.stderr.strip().splitlines()[-1])
    answer = json.loads(done.stdout)
    out = {}
    for name, key in (("friction", "dry_friction"), ("damping", "viscous_friction")):
        found = answer["parameters"][key]
        # No interval of a number that is held.
        low, high = (end if end is not None else float("inf") for end in found["ci95"])
        open_ = any(u["parameter"] == key for u in answer["not_identifiable"])
        out[name] = dict(value=found["value"], low=low, high=high, truth=o[name], open=open_)
    # At half the speed of the pushes.
    slows = lambda key: out["friction"][key] + 0.5 * o["rate"] * out["damping"][key]
    out["slows"] = slows("value") / slows("truth") - 1
    out["misfit"], out["seconds"] = answer["misfit"], answer["seconds"]
    out["motions"] = len(answer["clips"]["train"])
    return out


def line(number, kind, found):
    if "error" in found:
        return f"{number:3} {kind:7} {found['error']}"
    of = lambda n: (
        f"{n} {found[n]['truth']:.4g}: {found[n]['value']:.4g} [{found[n]['low']:.3g}, {found[n]['high']:.3g}]"
        + (" open" if found[n]["open"] else "" if found[n]["low"] <= found[n]["truth"] <= found[n]["high"] else " MISSED")
    )
    return f"{number:3} {kind:7} {of('friction')}  {of('damping')}  slows {100 * found['slows']:+.1f} %  misfit {found['misfit']:.2f}  {found['motions']} clips"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--sessions", type=int, default=20, help="of each kind")
    parser.add_argument("--pushes", type=int, default=3)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    parser.add_argument("--noise", type=float, default=1.0, help="times 1 mm and 5 mrad")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for kind in options.kinds:
        all_found = []
        for number in range(options.sessions):
            rng = np.random.default_rng([options.seed, number, KINDS.index(kind)])
            o = draw(kind, rng)
            folder = options.out / f"{kind}_{options.seed}_{number}"
            if not (folder / "cell.toml").exists():
                record(folder, o, rng, options.pushes, options.noise)
            found = judged(options.program, folder, o)
            print(line(number, kind, found), flush=True)
            all_found.append(found)
        known = [found for found in all_found if "error" not in found]
        print(f"{kind}: {len(known)} of {len(all_found)} answered")
        for name in ("friction", "damping"):
            told = [found[name] for found in known if not found[name]["open"]]
            if told:
                off = np.abs([each["value"] / each["truth"] - 1 for each in told])
                held = sum(each["low"] <= each["truth"] <= each["high"] for each in told)
                print(
                    f"  {name}: identifiable in {len(told)}, off by {100 * np.median(off):.1f} % (median), {100 * np.quantile(off, 0.9):.1f} % "
                    f"(nine of ten), within 10 % in {sum(off <= 0.1)}; intervals hold {held} of {len(told)}"
                )
        slows = np.abs([found["slows"] for found in known])
        if len(slows):
            print(f"  what slows at half the speed: {100 * np.median(slows):.1f} % (median), {100 * np.quantile(slows, 0.9):.1f} % (nine of ten)")


if __name__ == "__main__":
    main()
