"""Effects on the slide: friction of the table, where the box presses, what else pulls at it."""
import numpy as np

from .effect import Effect, any_way, log_uniform
from .model import GRAVITY, MIDDLE, leaning

ALONG_Y = np.pi / 2  # direction of the roughest axis, from the base's x axis [rad]


class TableLaw(Effect):
    """A friction of the table that depends on where a foot is and how fast."""

    acts = True

    def begin(self, plant, q):
        self.resting = plant.model.pair_friction[plant.foot_pairs, :2].copy()

    def step(self, plant):
        places, speeds = plant.feet_now()
        mu = self.law(self.resting, places, np.linalg.norm(speeds, axis=1)[:, None])
        plant.model.pair_friction[plant.foot_pairs, :2] = np.maximum(mu, 1e-3)

    def law(self, mu, places, speed):
        raise NotImplementedError


class VelocityDependentFriction(TableLaw):
    name = "velocity_dependent_friction"
    parameters = {"slope": "s_per_m"}

    @classmethod
    def draw(cls, rng, cell):
        size = log_uniform(rng, 0.2, 0.2)
        # A negative slope that leaves some friction at the speeds of the strokes.
        return cls(size if rng.random() < 0.6 else -min(size, 0.8 * cell.box.friction))

    def law(self, mu, places, speed):
        return mu + self.slope * speed


class StribeckSlidingFriction(TableLaw):
    name = "stribeck_sliding_friction"
    parameters = {"excess": "", "velocity": "m_per_s"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 0.1, 0.1), rng.uniform(0.04, 0.25))

    def law(self, mu, places, speed):
        return mu + self.excess * np.exp(-(speed / self.velocity) ** 2)


class FrictionPatch(TableLaw):
    """Another friction beyond a line."""

    name = "friction_patch"
    parameters = {"factor": "", "direction": "rad", "distance": "m"}

    @classmethod
    def draw(cls, rng, cell):
        size, direction = log_uniform(rng, 0.3, 0.25), rng.uniform(-np.pi, np.pi)
        middle = MIDDLE[0] * np.cos(direction)
        return cls(1 + size if rng.random() < 0.5 else max(0.15, 1 - size), direction, middle + rng.uniform(-0.03, 0.06))

    def law(self, mu, places, speed):
        beyond = places @ [np.cos(self.direction), np.sin(self.direction)] > self.distance
        return mu * np.where(beyond, self.factor, 1.0)[:, None]


class AnisotropicFriction(Effect):
    """The engine's own friction ellipse, along the table's x and y axes."""

    name = "anisotropic_friction"
    parameters = {"size": "", "axis": "rad"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(min(0.7, log_uniform(rng, 0.15, 0.2)), ALONG_Y if rng.random() < 0.5 else 0.0)

    def build(self, build):
        factors = np.array([1 + self.size, 1 - self.size])
        build.foot_friction = build.foot_friction * (factors[::-1] if self.axis == ALONG_Y else factors)


class ViscousSlidingDrag(Effect):
    name = "viscous_sliding_drag"
    acts = True
    parameters = {"drag": "N_s_per_m"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 0.5, 0.7))

    def step(self, plant):
        places, speeds = plant.feet_now()
        # A quarter at each foot, at the height of the table.
        middle = plant.data.xipos[plant.box]
        for place, speed in zip(places, speeds):
            force = np.array([*(-0.25 * self.drag * speed), 0.0])
            plant.push_box(force)
            plant.data.xfrc_applied[plant.box, 3:] += np.cross([*(place - middle[:2]), -middle[2]], force)


class TableTilt(Effect):
    """The table leans: the box is pulled aside, the arm is not."""

    name = "table_tilt"
    acts = True
    parameters = {"tilt": "rad"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(any_way(rng, log_uniform(rng, 0.015, 0.03)))

    def step(self, plant):
        plant.push_box(plant.build.box.mass * (leaning(self.tilt) + [0, 0, GRAVITY]))


class PressureDistribution(Effect):
    name = "pressure_distribution"
    parameters = {"reach": ""}

    @classmethod
    def draw(cls, rng, cell):
        return cls(1 - min(0.6, log_uniform(rng, 0.2, 0.2)))

    def block(self):
        return {**super().block(), "pivot": self.reach}

    def build(self, build):
        build.foot_reach *= self.reach


SLIDE = [AnisotropicFriction, StribeckSlidingFriction, VelocityDependentFriction, ViscousSlidingDrag, TableTilt, FrictionPatch,
         PressureDistribution]
