"""Effects on what the tracker reports."""
import mujoco
import numpy as np

from .effect import Effect, log_uniform, sign
from .model import MIDDLE


def turned(rotation, place, turn, about):
    """A pose turned by a rotation vector about a place."""
    angle = np.linalg.norm(rotation)
    if angle == 0:
        return place, turn
    extra, out, moved = np.zeros(4), np.zeros(4), np.zeros(3)
    mujoco.mju_axisAngle2Quat(extra, rotation / angle, angle)
    mujoco.mju_mulQuat(out, extra, turn)
    mujoco.mju_rotVecQuat(moved, place - about, extra)
    return about + moved, out


class CameraLatency(Effect):
    name = "camera_latency"
    parameters = {"latency": "s"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 0.02, 0.03))


class CameraExtrinsicRotation(Effect):
    """About the table's middle, where a camera is aligned."""

    name = "camera_extrinsic_rotation"
    parameters = {"rotation": "rad", "centre": "m"}

    @classmethod
    def draw(cls, rng, cell):
        axis = np.array([0.0, 0.0, 1.0]) if rng.random() < 0.5 else rng.normal(size=3)
        return cls(sign(rng) * log_uniform(rng, 0.015, 0.03) * axis / np.linalg.norm(axis), MIDDLE)

    def seen(self, t, place, turn):
        return turned(self.rotation, place, turn, self.centre)


class CameraExtrinsicTranslation(Effect):
    name = "camera_extrinsic_translation"
    parameters = {"translation": "m"}

    @classmethod
    def draw(cls, rng, cell):
        way = rng.normal(size=3) * [1, 1, 0.5]
        return cls(log_uniform(rng, 0.005, 0.008) * way / np.linalg.norm(way))

    def seen(self, t, place, turn):
        return place + self.translation, turn


class CameraScale(Effect):
    name = "camera_scale"
    parameters = {"scale": "", "centre": "m"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(sign(rng) * log_uniform(rng, 0.02, 0.03), MIDDLE if rng.random() < 0.5 else np.zeros(3))

    def seen(self, t, place, turn):
        return place + self.scale * (place - self.centre), turn


class TrackerSmoothing(Effect):
    name = "tracker_smoothing"
    parameters = {"time_constant": "s"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 0.03, 0.05))

    def clip(self, share, rng):
        self.last = None

    def seen(self, t, place, turn):
        if self.last is not None:
            before, then, was = self.last
            share = 1 - np.exp(-(t - before) / self.time_constant)
            place = then + share * (place - then)
            turn = was + share * ((turn if was @ turn > 0 else -turn) - was)
            turn = turn / np.linalg.norm(turn)
        self.last = t, place, turn
        return place, turn


CAMERA = [CameraLatency, CameraExtrinsicRotation, CameraExtrinsicTranslation, CameraScale, TrackerSmoothing]
