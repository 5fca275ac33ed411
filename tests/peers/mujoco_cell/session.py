"""Records the session of a world, in a folder that appears whole:

    session/cell.toml, session/clip_00.mcap, ...   what a laboratory has
    truth.json, truth.toml                         what is hidden, for people and for `twin replay --parameters`
"""
import copy
import json
import os
import shutil

import numpy as np

from . import bag, laboratory, model
from .camera_effects import turned
from .control_effects import TICK
from .plant import Plant
from .strokes import Planner, Refused, draw
from .world import motion

ARM_CLIPS, STROKES = 8, 16
POSE_RATE = 60.0  # [1/s]
TRIES = 30
HANGING = 0.5  # an arm so far from its command does not follow [rad]
UPSET = 0.3  # a box that leans so far has fallen [rad]


class Unusable(Exception):
    """A world that gives no session."""


def record(world, folder, whole=None):
    """Writes the session of `world`, of `whole` clips, into `folder`, which must not be there."""
    whole = whole or (STROKES if world.box is not None else ARM_CLIPS)
    nominal = model.nominal(world.tool)
    unfinished = f"{folder}.unfinished"
    shutil.rmtree(unfinished, ignore_errors=True)
    os.makedirs(os.path.join(unfinished, "session"))
    try:
        clips = []
        for index in range(whole):
            trace, commands = clip(world, nominal, index, whole)
            clips.append(f"clip_{index:02d}.mcap")
            with open(os.path.join(unfinished, "session", clips[-1]), "wb") as stream:
                bag.write(stream, *reported(world, trace, commands, world.rng(300 + index)),
                          world.logged, world.rng(500 + index))
        texts = {"session/cell.toml": laboratory.cell_toml(world, clips), "truth.json": truth(world), "truth.toml": theta(world)}
        for name, text in texts.items():
            with open(os.path.join(unfinished, name), "w") as stream:
                stream.write(text)
        os.rename(unfinished, folder)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def clip(world, nominal, index, whole):
    """What happens in clip number `index`, and its commands."""
    rng = world.rng(200 + index)
    box, scatter = copy.deepcopy(world.box), rng.normal()
    if box is not None:
        box.friction *= np.exp(world.scatter * scatter)
    effects = copy.deepcopy(world.effects)
    build = model.Build(copy.deepcopy(world.engine), world.tool, box)
    for effect in effects:
        effect.clip((index + 0.5) / whole, np.random.default_rng([world.seed, world.number, 400 + index]))
        effect.build(build)
    if box is None:
        commands = motion(world, index)
        trace = Plant(build, world.gains, nominal, effects).run(*(world.logged.given(rows) for rows in commands))
        if np.abs(trace.q - commands[0]).max() > HANGING:
            raise Unusable("the arm does not follow its commands")
        return trace, (*commands, effects)
    planner = Planner(nominal, world.tool.radius)
    for number in range(TRIES):
        stroke = draw(rng, box, world.leans, index, number)
        try:
            commands = planner.plan(stroke)
        except Refused:
            continue
        trace = Plant(build, world.gains, nominal, copy.deepcopy(effects)).run(*commands, stroke.box)
        if lands(trace):
            return trace, (*commands, effects)
    raise Unusable(f"no stroke of {TRIES} hits the box and leaves it standing")


def lands(trace):
    """Whether the box was hit, stands upright all the time and lies still at the end."""
    upright = 1 - 2 * (trace.turn[:, 1] ** 2 + trace.turn[:, 2] ** 2)
    moved = np.linalg.norm(trace.place[-1] - trace.place[0])
    creeps = np.linalg.norm(trace.place[-1] - trace.place[-100])
    return trace.touched.any() and moved > 0.01 and creeps < 0.002 and (upright > np.cos(UPSET)).all()


def reported(world, trace, commands, rng):
    """What is logged: desired, measured, poses."""
    q_d, dq_d, effects = commands
    noise = laboratory.NOISE
    shape = trace.q.shape
    tau = trace.tau + noise["tau"] * rng.normal(size=shape)
    measured = trace.q + noise["q"] * rng.normal(size=shape), trace.dq + noise["dq"] * rng.normal(size=shape)
    logged = (tau, trace.tau_d) if world.logs_torques else (None, None)
    poses = tracked(trace, effects, rng) if world.box is not None else []
    return (q_d, dq_d, logged[1]), (*measured, logged[0]), poses


def tracked(trace, effects, rng):
    """Stamps, places and quaternions of the tracker."""
    poses, rows = [], len(trace.q)
    latency = sum(effect.latency for effect in effects)
    first = rng.integers(0, int(1e9 / POSE_RATE))
    for number in range(int(rows * TICK * POSE_RATE)):
        ns = int(first + number * 1e9 / POSE_RATE)
        t = ns * 1e-9
        if t > (rows - 1) * TICK:
            break
        place, turn = between(trace, (t - latency) / TICK)
        for effect in effects:
            place, turn = effect.seen(t, place, turn)
        wobble = laboratory.NOISE["rotation"] * rng.normal(size=3)
        _, turn = turned(wobble, place, turn, place)
        poses.append((bag.START_NS + ns, place + laboratory.NOISE["position"] * rng.normal(size=3), turn))
    return poses


def between(trace, row):
    """The pose at a row that need not be whole."""
    row = float(np.clip(row, 0, len(trace.place) - 1.001))
    low, share = int(row), row - int(row)
    turn = (1 - share) * trace.turn[low] + share * trace.turn[low + 1]
    return (1 - share) * trace.place[low] + share * trace.place[low + 1], turn / np.linalg.norm(turn)


def truth(world):
    """truth.json."""
    box, engine = world.box, world.engine
    return json.dumps({
        "kind": world.kind,
        "effects": [effect.name for effect in world.effects],
        "known": all(effect.known for effect in world.effects),
        "near": [name for effect in world.effects for name in effect.near],
        "hidden": {effect.name: {key: round(value, 9) if isinstance(value, float) else value for key, value in effect.sizes().items()}
                   for effect in world.effects},
        "gains": {"stiffness_N_m_per_rad": laboratory.plain(world.gains[0]), "damping_N_m_s_per_rad": laboratory.plain(world.gains[1])},
        "object": None if box is None else {
            "mass_kg": float(box.mass), "friction": float(box.friction), "tip_friction": float(box.tip_friction),
            "centre_of_mass_m": laboratory.plain(box.centre_of_mass), "friction_scatter": world.scatter},
        "engine": vars(engine), "log": world.logged.written(), "seed": world.seed, "number": world.number,
    }, indent=1, default=float) + "\n"


def theta(world, with_effects=True):
    """truth.toml: the same as parameters for `twin replay`, as near as the twin's own effects come."""
    text = f"[arm]\nstiffness = {laboratory.plain(world.gains[0])}\ndamping = {laboratory.plain(world.gains[1])}\n"
    if (box := world.box) is not None:
        text += (f"\n[object]\nfriction = {box.friction}\nmass = {box.mass}\n"
                 f"centre_of_mass = {laboratory.plain(box.centre_of_mass)}\ntip_friction = {box.tip_friction}\n")
    for block in [effect.block() for effect in world.effects if effect.known] if with_effects else []:
        text += "\n[[effect]]\n" + "".join(f"{key} = {json.dumps(value, default=float)}\n" for key, value in block.items())
    return text
