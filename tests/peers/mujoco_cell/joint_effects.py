"""Effects in the joints and on the arm's bodies: frictions, gears that yield, loads, a base that leans."""
import numpy as np

from . import fr3
from .effect import Effect, any_way, log_uniform, sign
from .model import Gear, leaning


class JointCoulombFriction(Effect):
    """The engine's own dry friction."""

    name = "joint_coulomb_friction"
    parameters = {"coulomb": "N_m"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(fr3.by_size(log_uniform(rng, 0.8, 0.9)) * rng.uniform(0.7, 1.3, fr3.DOF))

    def build(self, build):
        build.coulomb = build.coulomb + self.coulomb


class JointViscousFriction(Effect):
    name = "joint_viscous_friction"
    parameters = {"viscous": "N_m_s_per_rad"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(fr3.by_size(log_uniform(rng, 1.5, 3.0)) * rng.uniform(0.7, 1.3, fr3.DOF))

    def build(self, build):
        build.viscous = build.viscous + self.viscous


class JointStribeckFriction(Effect):
    name = "joint_stribeck_friction"
    acts = True
    parameters = {"coulomb": "N_m", "excess": "N_m", "velocity": "rad_per_s"}

    @classmethod
    def draw(cls, rng, cell):
        coulomb = fr3.by_size(log_uniform(rng, 0.6, 0.7))
        return cls(coulomb, coulomb * rng.uniform(0.5, 1.0), rng.uniform(0.03, 0.12))

    def build(self, build):
        # Present from the start, so that the engine makes room for it.
        build.coulomb = build.coulomb + self.coulomb

    def step(self, plant):
        ratio = plant.data.qvel[plant.motor] / self.velocity
        plant.model.dof_frictionloss[plant.motor] = self.coulomb + self.excess * np.exp(-ratio * ratio)


class JointLoadFriction(Effect):
    name = "joint_load_friction"
    acts = True
    parameters = {"coefficient": ""}

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 0.05, 0.08))

    def build(self, build):
        build.coulomb = build.coulomb + 1e-3

    def step(self, plant):
        plant.model.dof_frictionloss[plant.motor] = self.coefficient * np.abs(plant.asked) + 1e-9


class JointPreslidingFriction(Effect):
    """Bristles that bend before they slip: Dahl's law, solved exactly for the speed of each step."""

    name = "joint_presliding_friction"
    acts = True
    parameters = {"coulomb": "N_m", "displacement": "rad"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(fr3.by_size(log_uniform(rng, 0.8, 0.9)) * rng.uniform(0.7, 1.3, fr3.DOF), float(10 ** rng.uniform(-3.3, -2.3)))

    def begin(self, plant, q):
        self.bent = np.zeros(fr3.DOF)

    def step(self, plant):
        speed = plant.data.qvel[plant.motor]
        share = np.exp(-np.abs(speed) * plant.model.opt.timestep / self.displacement)
        self.bent = np.sign(speed) + (self.bent - np.sign(speed)) * share
        plant.lost += self.coulomb * self.bent


class JointFrictionAsymmetry(Effect):
    name = "joint_friction_asymmetry"
    acts = True
    parameters = {"offset": "N_m"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(fr3.by_size(log_uniform(rng, 0.2, 0.3)) * rng.choice([-1, 1], fr3.DOF))

    def step(self, plant):
        plant.lost += self.offset


class TorqueRipple(Effect):
    name = "torque_ripple"
    acts = True
    parameters = {"amplitude": "N_m", "order": "", "phase": "rad"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(fr3.by_size(log_uniform(rng, 0.2, 0.2)), float(rng.choice([20, 30, 50, 100, 160])), rng.uniform(-3, 3, fr3.DOF))

    def step(self, plant):
        plant.lost += self.amplitude * np.sin(self.order * plant.data.qpos[plant.position] + self.phase)


class JointElasticity(Effect):
    name = "joint_elasticity"
    parameters = {"stiffness": "N_m_per_rad", "damping": "N_m_s_per_rad"}

    @classmethod
    def draw(cls, rng, cell):
        yields = log_uniform(rng, 1 / 6000, 1 / 3500)  # [rad/(N m)]
        return cls(fr3.STIFFNESS / fr3.STIFFNESS.max() / yields * np.array([1, 1, 1, 1, 1.44, 1.6, 3.0]), rng.uniform(1, 4))

    def build(self, build):
        for joint in range(fr3.DOF):
            build.gears[joint] = Gear(stiffness=self.stiffness[joint], damping=self.damping)

    def begin(self, plant, q):
        load_springs(plant, q)


class JointBacklash(Effect):
    """Play in one to three joints."""

    name = "joint_backlash"
    parameters = {"play": "rad"}

    @classmethod
    def draw(cls, rng, cell):
        worn = np.zeros(fr3.DOF)
        worn[rng.choice(6, rng.integers(1, 4), replace=False)] = log_uniform(rng, 0.002, 0.003)
        return cls(worn)

    def build(self, build):
        for joint in np.flatnonzero(self.play):
            build.gears[int(joint)] = Gear(play=self.play[joint], damping=0.01)


def load_springs(plant, q):
    """Lets each spring carry the weight that rests on it."""
    _, gravity = plant.controller.torque(q, np.zeros(fr3.DOF), q, np.zeros(fr3.DOF))
    for joint, gear in plant.build.gears.items():
        if gear.stiffness > 0:
            plant.data.joint(f"gear{joint}").qpos[0] = -gravity[joint] / gear.stiffness


class RotorInertia(Effect):
    name = "rotor_inertia"
    parameters = {"extra": "kg_m2"}

    @classmethod
    def draw(cls, rng, cell):
        size = sign(rng) * log_uniform(rng, 0.05, 0.1)
        return cls(np.maximum(size * fr3.ROTOR / fr3.ROTOR.max(), -0.6 * fr3.ROTOR))

    def build(self, build):
        build.rotor = build.rotor + self.extra


class Payload(Effect):
    name = "payload"
    parameters = {"mass": "kg", "centre": "m"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 0.3, 0.5), rng.uniform([-0.03, -0.03, 0.0], [0.03, 0.03, 0.08]))

    def build(self, build):
        centre = " ".join(f"{x:.9g}" for x in self.centre)
        inertial = f'<inertial mass="{self.mass:.9g}" pos="0 0 0" diaginertia="1e-9 1e-9 1e-9"/>'
        build.at_flange.append(f'<body name="load" pos="{centre}">{inertial}</body>')


class BaseTilt(Effect):
    name = "base_tilt"
    acts = True
    parameters = {"tilt": "rad"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(any_way(rng, log_uniform(rng, 0.01, 0.03)))

    def build(self, build):
        build.gravity = leaning(self.tilt)

    def step(self, plant):
        # The box stands on a level table.
        if plant.box is not None:
            plant.push_box(plant.build.box.mass * (leaning((0, 0)) - plant.build.gravity))


JOINT = [JointCoulombFriction, JointViscousFriction, JointStribeckFriction, JointLoadFriction, JointPreslidingFriction,
         JointFrictionAsymmetry, TorqueRipple, JointElasticity, JointBacklash, RotorInertia, Payload, BaseTilt]
