"""The cell as MJCF: arm, tool, table and box out of the numbers of a `Build`, which effects may change before.

The box stands on four small spheres at its lower corners, each with a contact pair of its own, so that friction may
differ from corner to corner. Only pairs that are listed touch: tool and box, feet and table.
"""
from dataclasses import dataclass, field

import mujoco
import numpy as np

from . import fr3

FOOT = 5e-4  # radius [m]
GRAVITY = 9.81
MIDDLE = np.array([0.53, 0.0, 0.0])  # of the part of the table that is used [m]


@dataclass
class Engine:
    """What simulators differ by, and no laboratory knows."""

    substeps: int = 4  # per millisecond
    integrator: str = "implicitfast"  # Euler, implicitfast: semi-implicit; RK4
    cone: str = "elliptic"
    impratio: float = 10.0
    tip_time: float = 0.002  # time constant of the contact of tip and box [s]
    tip_ratio: float = 1.0  # its damping ratio
    foot_time: float = 0.003
    foot_ratio: float = 1.0
    impedance: float = 0.98  # solimp's d0
    torsion: float = 0.0  # torsional friction of the tip [m]

    @property
    def step(self):
        """[s]"""
        return 1e-3 / self.substeps

    @property
    def ahead(self):
        """By how much positions are ahead of velocities [s]: half a step of the semi-implicit rule."""
        return 0.0 if self.integrator == "RK4" else 0.5 * self.step


@dataclass
class Tool:
    """A solid capsule along the flange's z axis."""

    mass: float = 0.25
    length: float = 0.16
    radius: float = 0.012


@dataclass
class Box:
    """A homogeneous box whose centre of mass was moved."""

    size: np.ndarray
    mass: float
    friction: float
    tip_friction: float
    centre_of_mass: np.ndarray

    @property
    def half(self):
        return 0.5 * np.asarray(self.size)


@dataclass
class Gear:
    """A gear that yields: spring, or play between two flanks."""

    stiffness: float = 0.0
    damping: float = 0.0
    play: float = 0.0


@dataclass
class Build:
    """Everything that goes into the MJCF."""

    engine: Engine
    tool: Tool
    box: Box | None = None
    rotor: np.ndarray = field(default_factory=lambda: fr3.ROTOR.copy())
    viscous: np.ndarray = field(default_factory=lambda: np.zeros(fr3.DOF))
    coulomb: np.ndarray = field(default_factory=lambda: np.zeros(fr3.DOF))
    gears: dict = field(default_factory=dict)  # joint -> Gear
    gravity: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, -GRAVITY]))  # on the arm
    tool_offset: np.ndarray = field(default_factory=lambda: np.zeros(3))
    at_flange: list = field(default_factory=list)  # more MJCF inside of the flange
    on_table: list = field(default_factory=list)  # more bodies
    pairs: list = field(default_factory=list)  # more <pair>s
    foot_reach: float = 1.0
    yaw_inertia: float = 1.0
    foot_friction: np.ndarray = field(default_factory=lambda: np.ones(2))  # along x and y, times the box's


def numbers(values):
    return " ".join(f"{float(v):.12g}" for v in np.ravel(values))


def _link(build, i, inner):
    a, d, alpha = fr3.GEOMETRY[i]
    place = f'pos="{numbers([a, -np.sin(alpha) * d, np.cos(alpha) * d])}" quat="{numbers([np.cos(alpha / 2), np.sin(alpha / 2), 0, 0])}"'
    mass, centre, inertia = fr3.BODIES[i]
    inertial = f'<inertial mass="{mass}" pos="{numbers(centre)}" fullinertia="{numbers(inertia)}"/>'
    motor = (f'<joint name="motor{i}" axis="0 0 1" armature="{build.rotor[i]:.9g}" damping="{build.viscous[i]:.9g}" '
             f'frictionloss="{build.coulomb[i]:.9g}"/>')
    gear = build.gears.get(i)
    if gear is None:
        return f'<body name="link{i}" {place}>{inertial}{motor}{inner}</body>'
    if gear.play > 0.0:
        yields = (f'range="{-gear.play / 2:.9g} {gear.play / 2:.9g}" limited="true" damping="{gear.damping:.9g}" '
                  f'solreflimit="{4 * build.engine.step:.6g} 1" solimplimit="0.98 0.999 0.0001"')
    else:
        yields = f'stiffness="{gear.stiffness:.9g}" damping="{gear.damping:.9g}"'
    # The rotor's inertia is its armature: seen through the gear it does not turn along with the arm.
    return (f'<body name="rotor{i}" {place}><inertial mass="1e-5" pos="0 0 0" diaginertia="1e-7 1e-7 1e-7"/>{motor}'
            f'<body name="link{i}">{inertial}<joint name="gear{i}" axis="0 0 1" {yields}/>{inner}</body></body>')


def arm(build):
    """The arm with what is at its flange."""
    tool, start = build.tool, np.asarray(build.tool_offset)
    end = start + [0, 0, tool.length - tool.radius]
    inner = (f'<body name="flange" pos="0 0 {fr3.FLANGE}">'
             f'<geom name="tool" type="capsule" fromto="{numbers([start, end])}" size="{tool.radius}" mass="{tool.mass}"/>'
             f'<site name="tip" pos="0 0 {tool.length - tool.radius}"/>{"".join(build.at_flange)}</body>')
    for i in reversed(range(fr3.DOF)):
        inner = _link(build, i, inner)
    return inner


def _box(build):
    box, half = build.box, build.box.half
    x2, y2, z2 = np.asarray(box.size) ** 2
    inertia = box.mass / 12 * np.array([y2 + z2, x2 + z2, (x2 + y2) * build.yaw_inertia])
    feet = []
    for i, (sx, sy) in enumerate([(1, 1), (1, -1), (-1, 1), (-1, -1)]):
        place = [sx * build.foot_reach * (half[0] - FOOT), sy * build.foot_reach * (half[1] - FOOT), FOOT - half[2]]
        feet.append(f'<geom name="foot{i}" type="sphere" size="{FOOT}" pos="{numbers(place)}" mass="0"/>')
    return (f'<body name="box" pos="0 0 {half[2]}"><freejoint name="box"/>'
            f'<inertial mass="{box.mass}" pos="{numbers(box.centre_of_mass)}" diaginertia="{numbers(inertia)}"/>'
            f'<geom name="box" type="box" size="{numbers(half)}" mass="0"/>{"".join(feet)}</body>')


def contact(build, one, other, friction, time, ratio, torsion=0.0):
    """A <pair> with friction along two axes."""
    along, across = friction
    low = build.engine.impedance
    condim = 4 if torsion > 0 else 3
    return (f'<pair name="{one}-{other}" geom1="{one}" geom2="{other}" condim="{condim}" friction="{along:.9g} {across:.9g} {max(torsion, 1e-6):.9g} 1e-6 1e-6" '
            f'solref="{time:.9g} {ratio:.9g}" solimp="{low} {min(0.999, low + 0.015)} 0.0005"/>')


def _pairs(build):
    engine, box = build.engine, build.box
    pairs = [contact(build, "tool", "box", [box.tip_friction] * 2, engine.tip_time, engine.tip_ratio, engine.torsion)]
    # The first tangent of a contact with a level table is the world's y axis.
    mu = box.friction * build.foot_friction[::-1]
    pairs += [contact(build, f"foot{i}", "table", mu, engine.foot_time, engine.foot_ratio) for i in range(4)]
    return "".join(pairs + build.pairs)


def mjcf(build):
    """The model as text."""
    engine = build.engine
    world, pairs = arm(build), ""
    if build.box is not None:
        world += '<geom name="table" type="plane" size="3 3 0.1"/>' + _box(build) + "".join(build.on_table)
        pairs = f"<contact>{_pairs(build)}</contact>"
    return (f'<mujoco model="cell"><compiler angle="radian" balanceinertia="true" autolimits="true"/>'
            f'<option timestep="{engine.step:.12g}" integrator="{engine.integrator}" cone="{engine.cone}" '
            f'impratio="{engine.impratio}" gravity="{numbers(build.gravity)}" iterations="100" tolerance="1e-10"/>'
            f'<default><geom contype="0" conaffinity="0"/></default>'
            f"<worldbody>{world}</worldbody>{pairs}</mujoco>")


def compiled(build):
    """The model, ready to run."""
    return mujoco.MjModel.from_xml_string(mjcf(build))


def nominal(tool):
    """The arm with its tool as the laboratory knows it, alone: what the controller compensates."""
    return compiled(Build(Engine(), tool))


def leaning(tilt):
    """Gravity in the axes of something that is turned by `tilt` about x and y [m/s^2]."""
    angle = np.hypot(*tilt)
    if angle == 0:
        return np.array([0.0, 0.0, -GRAVITY])
    axis = np.array([tilt[0], tilt[1], 0.0]) / angle
    down = np.array([0.0, 0.0, -GRAVITY])
    return down * np.cos(angle) - np.cross(axis, down) * np.sin(angle)
