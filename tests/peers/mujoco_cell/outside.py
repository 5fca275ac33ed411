"""What the diagnosis has no name for: the right verdict is `unexplained`."""
import numpy as np

from . import fr3
from .camera_effects import turned
from .effect import Effect
from .model import MIDDLE, contact, leaning


class Outside(Effect):
    known = False


class SloshingLoad(Outside):
    """A vessel at the flange whose contents swing as a pendulum."""

    name = "sloshing load"
    near = ("payload",)
    parameters = {"mass": "kg", "length": "m", "damping": "N_m_s_per_rad"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(rng.uniform(0.3, 1.2), rng.uniform(0.03, 0.12), rng.uniform(0.0005, 0.004))

    def build(self, build):
        joint = f'damping="{self.damping:.9g}" armature="1e-5"'
        build.at_flange.append(
            f'<body name="slosh" pos="0 0 0.02"><joint axis="1 0 0" {joint}/><joint axis="0 1 0" {joint}/>'
            f'<inertial mass="{self.mass:.9g}" pos="0 0 {self.length:.9g}" diaginertia="1e-5 1e-5 1e-5"/></body>')


class WarmingGears(Outside):
    """Viscous friction that falls from clip to clip as the grease warms up."""

    name = "warming gears"
    near = ("joint_viscous_friction",)
    acts = True
    parameters = {"cold": "N_m_s_per_rad"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(fr3.by_size(rng.uniform(3.0, 10.0)))

    def clip(self, share, rng):
        self.now = self.cold * np.exp(-3 * share)

    def step(self, plant):
        plant.lost += self.now * plant.data.qvel[plant.motor]


class Hose(Outside):
    """A hose that pulls one joint back beyond an angle."""

    name = "hose"
    acts = True
    parameters = {"joint": "", "stiffness": "N_m_per_rad", "slack": "rad"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(int(rng.integers(0, 4)), rng.uniform(8, 50), rng.uniform(0.02, 0.08))

    def sizes(self):
        return {**super().sizes(), "joint": self.joint + 1}

    def begin(self, plant, q):
        self.from_ = q[self.joint] + self.slack

    def step(self, plant):
        beyond = plant.data.qpos[plant.position[self.joint]] - self.from_
        plant.lost[self.joint] += self.stiffness * max(0.0, beyond)


class HeldCommands(Outside):
    """A sender that stalls now and then: the last command is held, and the log does not tell."""

    name = "held commands"
    parameters = {"longest": "ms"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(int(rng.integers(15, 60)))

    def clip(self, share, rng):
        self.rng, self.left, self.held = rng, 0, None

    def command(self, q_d, dq_d):
        if self.left <= 0:
            self.held = q_d, dq_d
            self.left = int(self.rng.integers(3, self.longest)) if self.rng.random() < 0.02 else 0
        self.left -= 1
        return self.held


class Cable(Outside):
    """A cable along the arm that springs back one joint, about an angle at which it hangs loose, and grows stiffer."""

    name = "cable"
    acts = True
    parameters = {"joint": "", "stiffness": "N_m_per_rad", "hardening": "1_per_rad2", "loose_at": "rad"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(int(rng.integers(0, 6)), rng.uniform(3, 20), rng.uniform(2, 20), rng.uniform(-0.2, 0.2))

    def sizes(self):
        return {**super().sizes(), "joint": self.joint + 1}

    def begin(self, plant, q):
        self.middle = q[self.joint] + self.loose_at

    def step(self, plant):
        away = plant.data.qpos[plant.position[self.joint]] - self.middle
        plant.lost[self.joint] += self.stiffness * away * (1 + self.hardening * away * away)


class WeakeningMotor(Outside):
    """A motor that gives less from the middle of the session on, as where it has grown hot."""

    name = "weakening motor"
    near = ("torque_gain",)
    parameters = {"joint": "", "left": "", "from_share": ""}

    @classmethod
    def draw(cls, rng, cell):
        return cls(int(rng.integers(0, 6)), rng.uniform(0.75, 0.95), rng.uniform(0.3, 0.7))

    def sizes(self):
        return {**super().sizes(), "joint": self.joint + 1}

    def clip(self, share, rng):
        self.now = self.left if share > self.from_share else 1.0

    def torque(self, tau):
        tau = tau.copy()
        tau[self.joint] *= self.now
        return tau


class PeriodicForce(Outside):
    """Something that turns pulls at one joint, whatever the arm does."""

    name = "periodic force"
    acts = True
    parameters = {"joint": "", "amplitude": "N_m", "frequency": "Hz"}

    @classmethod
    def draw(cls, rng, cell):
        joint = int(rng.integers(0, 6))
        return cls(joint, fr3.by_size(rng.uniform(0.3, 2.0))[joint], rng.uniform(0.7, 8.0))

    def sizes(self):
        return {**super().sizes(), "joint": self.joint + 1}

    def clip(self, share, rng):
        self.phase = rng.uniform(0, 2 * np.pi)

    def step(self, plant):
        plant.lost[self.joint] += self.amplitude * np.sin(2 * np.pi * self.frequency * plant.clock + self.phase)


class ShakingBase(Outside):
    """The base stands on something that sways: gravity as the arm feels it swings."""

    name = "shaking base"
    near = ("base_tilt",)
    acts = True
    parameters = {"angle": "rad", "frequency": "Hz", "direction": "rad"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(rng.uniform(0.003, 0.02), rng.uniform(0.7, 4.0), rng.uniform(-np.pi, np.pi))

    def clip(self, share, rng):
        self.phase = rng.uniform(0, 2 * np.pi)

    def step(self, plant):
        swing = self.angle * np.sin(2 * np.pi * self.frequency * plant.clock + self.phase)
        plant.model.opt.gravity[:] = leaning(swing * np.array([np.cos(self.direction), np.sin(self.direction)]))


class Magnet(Outside):
    """A magnet under the table pulls at an iron core in the box."""

    name = "magnet"
    acts = True
    parameters = {"force": "N", "place": "m", "reach": "m"}

    @classmethod
    def draw(cls, rng, cell):
        weight = 9.81 * cell.box.mass
        return cls(weight * rng.uniform(0.3, 1.0), MIDDLE[:2] + rng.uniform(-0.1, 0.1, 2), rng.uniform(0.05, 0.10))

    def step(self, plant):
        away = np.array([*(self.place - plant.data.xipos[plant.box][:2]), -self.reach])
        distance = np.linalg.norm(away)
        plant.push_box(self.force * (self.reach / distance) ** 3 * away / distance)


class Wind(Outside):
    """A fan blows over the table in gusts."""

    name = "wind"
    acts = True
    parameters = {"force": "N", "direction": "rad", "gust": "", "frequency": "Hz"}

    @classmethod
    def draw(cls, rng, cell):
        holds = 9.81 * cell.box.mass * cell.box.friction
        return cls(holds * rng.uniform(0.1, 0.3), rng.uniform(-np.pi, np.pi), rng.uniform(0.6, 1.0), rng.uniform(0.8, 2.5))

    def clip(self, share, rng):
        self.phase = rng.uniform(0, 2 * np.pi)

    def step(self, plant):
        blow = self.force * (1 + self.gust * np.sin(2 * np.pi * self.frequency * plant.clock + self.phase))
        plant.push_box(blow * np.array([np.cos(self.direction), np.sin(self.direction), 0.0]))


class DriftingFriction(Outside):
    """A table that wears: its friction goes on changing from clip to clip."""

    name = "drifting friction"
    parameters = {"change": "of_ln_mu"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(rng.choice([-1, 1]) * rng.uniform(0.25, 0.6))

    def clip(self, share, rng):
        self.factor = np.exp(self.change * (share - 0.5))

    def build(self, build):
        build.box.friction *= self.factor


class FrictionPyramid(Outside):
    """A table that holds least along its diagonals: |f_x| + |f_y| <= mu f_n, as engines with a pyramid for a cone have it."""

    name = "friction pyramid"

    @classmethod
    def draw(cls, rng, cell):
        return cls()

    def sizes(self):
        return {"friction_along_diagonals": np.sqrt(0.5)}

    def build(self, build):
        build.engine.cone = "pyramidal"


class SecondObject(Outside):
    """A small block that nobody tracks stands in the way."""

    name = "second object"
    parameters = {"mass": "kg", "place": "m"}

    @classmethod
    def draw(cls, rng, cell):
        angle = rng.uniform(-np.pi, np.pi)
        return cls(rng.uniform(0.08, 0.3), MIDDLE[:2] + rng.uniform(0.11, 0.13) * np.array([np.cos(angle), np.sin(angle)]))

    def build(self, build):
        x, y = self.place
        build.on_table.append(f'<body name="block" pos="{x:.9g} {y:.9g} 0.03"><freejoint/>'
                              f'<geom name="block" type="box" size="0.02 0.03 0.03" mass="{self.mass:.9g}"/></body>')
        time, ratio = build.engine.foot_time, build.engine.foot_ratio
        for other, mu in (("table", 0.35), ("box", 0.3), ("tool", 0.3)):
            build.pairs.append(contact(build, "block", other, (mu, mu), time, ratio))


class NoddingTracker(Outside):
    """The tracker's stand sways: its direction swings about the table's middle."""

    name = "nodding tracker"
    parameters = {"angle": "rad", "frequency": "Hz", "axis": ""}

    @classmethod
    def draw(cls, rng, cell):
        axis = rng.normal(size=3) * [0.3, 0.3, 1.0]
        return cls(rng.uniform(0.02, 0.08), rng.uniform(0.6, 2.0), axis / np.linalg.norm(axis))

    def clip(self, share, rng):
        self.phase = rng.uniform(0, 2 * np.pi)

    def seen(self, t, place, turn):
        swing = self.angle * np.sin(2 * np.pi * self.frequency * t + self.phase)
        return turned(swing * self.axis, place, turn, MIDDLE + [0.1, 0.1, 0.0])


OUTSIDE_ARM = [SloshingLoad, WarmingGears, Hose, HeldCommands, Cable, WeakeningMotor, PeriodicForce, ShakingBase]
OUTSIDE_STROKES = [Magnet, Wind, DriftingFriction, FrictionPyramid, SecondObject, NoddingTracker]
