"""Effects on the hit: contact of tip and box, where the tip is, how hard the box is to turn."""
import numpy as np

from .effect import Effect, log_uniform, sign


class Restitution(Effect):
    """A spring and damper that return `e` of the approach speed, as quick as the nominal contact."""

    name = "restitution"
    parameters = {"restitution": ""}

    @classmethod
    def draw(cls, rng, cell):
        away = log_uniform(rng, 0.3, 0.2)
        return cls(max(0.03, 0.25 - away) if rng.random() < 0.2 else 0.25 + away)

    def build(self, build):
        engine = build.engine
        frequency = 1 / (engine.tip_time * engine.tip_ratio)
        engine.tip_ratio = ratio_of(self.restitution)
        engine.tip_time = max(2.1 * engine.step, 1 / (frequency * engine.tip_ratio))


class ContactCompliance(Effect):
    name = "contact_compliance"
    parameters = {"compliance": "m_per_N"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 1e-4, 3e-4))

    def build(self, build):
        engine, mass = build.engine, build.box.mass
        stiffness = mass / (engine.tip_time * engine.tip_ratio) ** 2
        softer = 1 / (1 / stiffness + self.compliance)
        engine.tip_time = 1 / (np.sqrt(softer / mass) * engine.tip_ratio)


class TipFriction(Effect):
    name = "tip_friction"
    parameters = {"change": ""}

    @classmethod
    def draw(cls, rng, cell):
        change = sign(rng) * log_uniform(rng, 0.1, 0.2)
        return cls(max(change, 0.02 - cell.box.tip_friction))

    def build(self, build):
        build.box.tip_friction += self.change


class ToolOffset(Effect):
    name = "tool_offset"
    parameters = {"offset": "m"}

    @classmethod
    def draw(cls, rng, cell):
        way = rng.normal(size=3)
        return cls(log_uniform(rng, 0.003, 0.005) * way / np.linalg.norm(way))

    def block(self):
        return {**super().block(), "carried": 1.0}

    def build(self, build):
        build.tool_offset = build.tool_offset + self.offset


class ObjectInertia(Effect):
    name = "object_inertia"
    parameters = {"factor": ""}

    @classmethod
    def draw(cls, rng, cell):
        more = log_uniform(rng, 0.3, 0.3)
        return cls(1 + more if rng.random() < 0.6 else 1 / (1 + more))

    def build(self, build):
        build.yaw_inertia *= self.factor


def returned(ratio):
    """Share of the approach speed after a spring and damper that cannot pull (Schwager, Poeschel 2007)."""
    root = np.sqrt(abs(1 - ratio * ratio))
    if root < 1e-9:
        return np.exp(-2.0)
    if ratio < 1:
        return np.exp(-ratio / root * np.arctan2(2 * ratio * root, 2 * ratio * ratio - 1))
    return np.exp(-ratio / root * np.log((ratio + root) / (ratio - root)))


def ratio_of(e):
    """Damping ratio of a contact that returns `e` of the approach speed."""
    low, high = 1e-4, 5.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if returned(middle) > e else (low, middle)
    return 0.5 * (low + high)


HIT = [Restitution, ContactCompliance, TipFriction, ToolOffset, ObjectInertia]
