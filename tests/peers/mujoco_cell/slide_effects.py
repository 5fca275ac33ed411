"""Effects on the slide: friction of the table, where the box presses, what else pulls at it."""
import numpy as np

from .effect import Effect, block, log_uniform, rounded
from .model import GRAVITY, MIDDLE, leaning


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

    def __init__(self, slope):
        self.slope = slope

    @classmethod
    def draw(cls, rng, cell):
        size = log_uniform(rng, 0.2, 0.2)
        # A negative slope that leaves some friction at the speeds of the strokes.
        return cls(size if rng.random() < 0.6 else -min(size, 0.8 * cell.box.friction))

    def sizes(self):
        return {"slope_s_per_m": self.slope}

    def blocks(self):
        return [block(self.name, slope=self.slope)]

    def law(self, mu, places, speed):
        return mu + self.slope * speed


class StribeckSlidingFriction(TableLaw):
    name = "stribeck_sliding_friction"

    def __init__(self, excess, velocity):
        self.excess, self.velocity = excess, velocity

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 0.1, 0.1), rng.uniform(0.04, 0.25))

    def sizes(self):
        return {"excess": self.excess, "velocity_m_per_s": self.velocity}

    def blocks(self):
        return [block(self.name, excess=self.excess, velocity=self.velocity)]

    def law(self, mu, places, speed):
        return mu + self.excess * np.exp(-(speed / self.velocity) ** 2)


class FrictionPatch(TableLaw):
    """Another friction beyond a line."""

    name = "friction_patch"

    def __init__(self, factor, direction, distance):
        self.factor, self.direction, self.distance = factor, direction, distance

    @classmethod
    def draw(cls, rng, cell):
        size, direction = log_uniform(rng, 0.3, 0.25), rng.uniform(-np.pi, np.pi)
        middle = MIDDLE[0] * np.cos(direction)
        return cls(1 + size if rng.random() < 0.5 else max(0.15, 1 - size), direction, middle + rng.uniform(-0.03, 0.06))

    def sizes(self):
        return {"factor": self.factor, "direction_rad": self.direction, "distance_m": self.distance}

    def blocks(self):
        return [block(self.name, factor=self.factor, direction=self.direction, distance=self.distance)]

    def law(self, mu, places, speed):
        beyond = places @ [np.cos(self.direction), np.sin(self.direction)] > self.distance
        return mu * np.where(beyond, self.factor, 1.0)[:, None]


class AnisotropicFriction(Effect):
    """The engine's own friction ellipse, along the table's x and y axes."""

    name = "anisotropic_friction"

    def __init__(self, size, along_y):
        self.size, self.along_y = size, along_y

    @classmethod
    def draw(cls, rng, cell):
        return cls(min(0.7, log_uniform(rng, 0.15, 0.2)), bool(rng.random() < 0.5))

    def sizes(self):
        return {"size": self.size, "axis_rad": np.pi / 2 if self.along_y else 0.0}

    def blocks(self):
        return [block(self.name, size=self.size, axis=1.570796 if self.along_y else 0.0)]

    def build(self, build):
        factors = np.array([1 + self.size, 1 - self.size])
        build.foot_friction = build.foot_friction * (factors[::-1] if self.along_y else factors)


class ViscousSlidingDrag(Effect):
    name = "viscous_sliding_drag"
    acts = True

    def __init__(self, drag):
        self.drag = drag

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 0.5, 0.7))

    def sizes(self):
        return {"drag_N_s_per_m": self.drag}

    def blocks(self):
        return [block(self.name, drag=self.drag)]

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

    def __init__(self, tilt):
        self.tilt = np.asarray(tilt)

    @classmethod
    def draw(cls, rng, cell):
        size, angle = log_uniform(rng, 0.015, 0.03), rng.uniform(0, 2 * np.pi)
        return cls(size * np.array([np.cos(angle), np.sin(angle)]))

    def sizes(self):
        return {"tilt_rad": rounded(self.tilt)}

    def blocks(self):
        return [block(self.name, tilt=rounded(self.tilt))]

    def step(self, plant):
        plant.push_box(plant.build.box.mass * (leaning(self.tilt) + [0, 0, GRAVITY]))


class PressureDistribution(Effect):
    name = "pressure_distribution"

    def __init__(self, reach):
        self.reach = reach

    @classmethod
    def draw(cls, rng, cell):
        return cls(1 - min(0.6, log_uniform(rng, 0.2, 0.2)))

    def sizes(self):
        return {"reach": self.reach}

    def blocks(self):
        return [block(self.name, reach=self.reach, pivot=self.reach)]

    def build(self, build):
        build.foot_reach *= self.reach


SLIDE = [AnisotropicFriction, StribeckSlidingFriction, VelocityDependentFriction, ViscousSlidingDrag, TableTilt, FrictionPatch,
         PressureDistribution]
