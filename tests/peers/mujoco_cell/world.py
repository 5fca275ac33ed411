"""Draws a world: how the cell really is. A world is a pure function of seed, number and kind.

True gains lie within 20 % of the nominal ones, the object well inside of the ranges that the laboratory knows. In half of the
worlds friction scatters from clip to clip twice as much as cell.toml says.
"""
from dataclasses import dataclass, field

import numpy as np

from . import fr3, log, model
from .camera_effects import CAMERA
from .control_effects import CONTROL, CommandDelay, CommandLag, JointEncoderOffset, TorqueDelay, TorqueGain
from .controller import Controller
from .excitation import multisine
from .hit_effects import HIT
from .joint_effects import JOINT, JointCoulombFriction
from .outside import OUTSIDE_ARM, OUTSIDE_STROKES
from .slide_effects import SLIDE

# What a kind of session hides, and whether there is a box.
KINDS = {
    "none-arm": (False, []),
    "none-strokes": (True, []),
    "arm": (False, CONTROL + JOINT),
    "hit": (True, HIT),
    "slide": (True, SLIDE),
    "camera": (True, CAMERA),
    "pair-arm": (False, CONTROL + JOINT),
    "pair-strokes": (True, HIT + SLIDE + CAMERA + [CommandDelay, JointCoulombFriction, JointEncoderOffset]),
    "outside-arm": (False, OUTSIDE_ARM),
    "outside-strokes": (True, OUTSIDE_STROKES),
    "arm-strokes": (True, [CommandDelay, CommandLag, TorqueDelay, TorqueGain, JointEncoderOffset, *JOINT]),
    "none-arm-logs": (False, []),
}

DECLARED_SCATTER = 0.02
MASS, FRICTION, TIP_FRICTION, CENTRE = (0.1, 1.0), (0.1, 0.8), (0.0, 0.5), 0.02  # ranges that the laboratory knows
SIZES = [(0.08, 0.06, 0.10), (0.08, 0.06, 0.12), (0.10, 0.08, 0.09), (0.07, 0.10, 0.08)]


@dataclass
class World:
    """Everything that is true of a session."""

    seed: int
    number: int
    kind: str
    engine: model.Engine
    tool: model.Tool
    gains: tuple  # stiffness, damping
    box: model.Box | None
    scatter: float  # one sigma of ln(mu) from clip to clip
    leans: tuple  # angles of the tool [rad]
    logs_torques: bool
    effects: list
    logged: log.Log = field(default_factory=log.Log)
    torques: tuple = ()  # largest of the motions, and what holds the arm up [N m]

    def rng(self, purpose):
        """A generator of its own for each purpose, so that one more draw moves no other."""
        return np.random.default_rng([self.seed, self.number, list(KINDS).index(self.kind), purpose])


def draw(seed, number, kind, which=None):
    """World `number` of a kind; `which` picks its effect, counted round."""
    with_box, effects = KINDS[kind]
    world = World(seed, number, kind, None, model.Tool(), (), None, 0.0, (), True, [])
    rng = world.rng(0)
    world.engine = engine(rng, with_box)
    world.gains = tuple(nominal * rng.uniform(0.8, 1.2, fr3.DOF) for nominal in (fr3.STIFFNESS, fr3.DAMPING))
    world.leans = (rng.uniform(0.1, 0.3), rng.uniform(0.4, 0.6))
    world.logs_torques = bool(rng.random() < (0.8 if with_box else 0.5))
    world.scatter = DECLARED_SCATTER * (2.0 if with_box and rng.random() < 0.5 else 1.0)
    if with_box:
        world.box = box(rng)
    else:
        world.torques = torques(world)
    hide(world, effects, which)
    if kind.endswith("-logs"):
        world.logged = log.draw(world.rng(2))
    if any(effect.name == "torque_sensor_bias" for effect in world.effects):
        world.logs_torques = True
    return world


def hide(world, effects, which):
    """Draws what is hidden."""
    if not effects:
        return
    rng = world.rng(1)
    if world.kind.startswith("pair"):
        picked = rng.choice(len(effects), 2, replace=False)
    else:
        picked = [rng.integers(len(effects)) if which is None else which % len(effects)]
    world.effects = [effects[i].draw(rng, world) for i in picked]
    if any(effect.name in ("joint_elasticity", "joint_backlash") for effect in world.effects):
        world.engine.substeps = 16


def engine(rng, with_box):
    """What simulators differ by."""
    if not with_box:
        integrator = str(rng.choice(["RK4", "implicitfast", "Euler"]))
        return model.Engine(substeps=int(rng.choice([2, 4, 5] if integrator == "RK4" else [8, 10])), integrator=integrator)
    substeps = int(rng.choice([4, 5, 8]))
    return model.Engine(
        substeps=substeps, integrator=str(rng.choice(["implicitfast", "Euler"])),
        impratio=float(rng.choice([5.0, 10.0, 30.0])),
        tip_time=max(2.1e-3 / substeps, float(np.exp(rng.uniform(np.log(0.0006), np.log(0.003))))), tip_ratio=rng.uniform(0.6, 1.0),
        foot_time=rng.uniform(0.002, 0.004), foot_ratio=rng.uniform(0.9, 1.2), impedance=rng.uniform(0.95, 0.983),
        torsion=0.0 if rng.random() < 0.5 else rng.uniform(0.0005, 0.002))


def box(rng):
    size = np.array(SIZES[rng.integers(len(SIZES))])
    return model.Box(size, rng.uniform(0.2, 0.55), rng.uniform(0.18, 0.38), rng.uniform(0.1, 0.3), rng.uniform(-0.5, 0.5, 3) * CENTRE)


def torques(world):
    """Largest torque of each joint over the motions of the session, and the largest that holds the arm up [N m]."""
    controller = Controller(*world.gains, model.nominal(world.tool))
    peak, held = np.zeros(fr3.DOF), np.zeros(fr3.DOF)
    for index in range(8):
        q_d, dq_d = motion(world, index)
        acceleration = np.gradient(dq_d, 1e-3, axis=0)
        for row in range(0, len(q_d), 20):
            moved, gravity = controller.torque(q_d[row], dq_d[row], q_d[row], dq_d[row])
            peak = np.maximum(peak, np.abs(moved + fr3.ROTOR * acceleration[row]))
            held = np.maximum(held, np.abs(gravity))
    return peak, held


def motion(world, index):
    """The excitation number `index`."""
    return multisine(world.rng(100 + index))
