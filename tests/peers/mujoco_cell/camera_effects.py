"""Effects on what the tracker reports."""
import mujoco
import numpy as np

from .effect import Effect, block, log_uniform, rounded, sign
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

    def __init__(self, latency):
        self.latency = latency

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 0.02, 0.03))

    def sizes(self):
        return {"latency_s": self.latency}

    def blocks(self):
        return [block(self.name, latency=self.latency)]


class CameraExtrinsicRotation(Effect):
    """About the table's middle, where a camera is aligned."""

    name = "camera_extrinsic_rotation"

    def __init__(self, rotation):
        self.rotation = np.asarray(rotation)

    @classmethod
    def draw(cls, rng, cell):
        axis = np.array([0.0, 0.0, 1.0]) if rng.random() < 0.5 else rng.normal(size=3)
        return cls(sign(rng) * log_uniform(rng, 0.015, 0.03) * axis / np.linalg.norm(axis))

    def sizes(self):
        return {"rotation_rad": rounded(self.rotation), "about_m": rounded(MIDDLE)}

    def blocks(self):
        return [block(self.name, rotation=rounded(self.rotation), centre=rounded(MIDDLE))]

    def seen(self, t, place, turn):
        return turned(self.rotation, place, turn, MIDDLE)


class CameraExtrinsicTranslation(Effect):
    name = "camera_extrinsic_translation"

    def __init__(self, translation):
        self.translation = np.asarray(translation)

    @classmethod
    def draw(cls, rng, cell):
        way = rng.normal(size=3) * [1, 1, 0.5]
        return cls(log_uniform(rng, 0.005, 0.008) * way / np.linalg.norm(way))

    def sizes(self):
        return {"translation_m": rounded(self.translation)}

    def blocks(self):
        return [block(self.name, translation=rounded(self.translation))]

    def seen(self, t, place, turn):
        return place + self.translation, turn


class CameraScale(Effect):
    name = "camera_scale"

    def __init__(self, scale, centre):
        self.scale, self.centre = scale, np.asarray(centre)

    @classmethod
    def draw(cls, rng, cell):
        return cls(sign(rng) * log_uniform(rng, 0.02, 0.03), MIDDLE if rng.random() < 0.5 else np.zeros(3))

    def sizes(self):
        return {"scale": self.scale, "centre_m": rounded(self.centre)}

    def blocks(self):
        return [block(self.name, scale=self.scale, centre=rounded(self.centre))]

    def seen(self, t, place, turn):
        return place + self.scale * (place - self.centre), turn


class TrackerSmoothing(Effect):
    name = "tracker_smoothing"

    def __init__(self, constant):
        self.constant, self.last = constant, None

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 0.03, 0.05))

    def sizes(self):
        return {"time_constant_s": self.constant}

    def blocks(self):
        return [block(self.name, time_constant=self.constant)]

    def clip(self, share, rng):
        self.last = None

    def seen(self, t, place, turn):
        if self.last is not None:
            before, then, was = self.last
            share = 1 - np.exp(-(t - before) / self.constant)
            place = then + share * (place - then)
            turn = was + share * ((turn if was @ turn > 0 else -turn) - was)
            turn = turn / np.linalg.norm(turn)
        self.last = t, place, turn
        return place, turn


CAMERA = [CameraLatency, CameraExtrinsicRotation, CameraExtrinsicTranslation, CameraScale, TrackerSmoothing]
