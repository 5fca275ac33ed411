"""Strokes against the box: run up, hit or push, brake, wait until it lies still.

Every other stroke is a short hit after which the box slides free; in the others the tool pushes nearly to the end. They
come from all four sides, straight or oblique, at the middle or beside it, with the tool leaning back at one of two angles.
"""
from dataclasses import dataclass

import mujoco
import numpy as np

from . import fr3
from .model import MIDDLE

WAIT = 0.9  # after the tool has stopped [s]


class Refused(Exception):
    """The arm cannot do this stroke."""


@dataclass
class Stroke:
    """What one stroke is to be."""

    box: tuple  # x, y, yaw of the box
    heading: float  # [rad]
    touch: np.ndarray  # where the surface of the tip meets the box, in the plane [m]
    height: float  # of the tip's centre [m]
    lean: float  # of the tool from the vertical, flange behind the tip [rad]
    speed: float  # [m/s]
    run_up: float  # [m]
    follow: float  # way at full speed after the touch [m]
    brake: float  # [m]


def draw(rng, box_, leans, index, refused=0):
    """The stroke number `index` against a box, its tool leaning at one of `leans`; gentler the more were refused."""
    size, half = box_.size, box_.half
    box = (*(MIDDLE[:2] + rng.normal(0, 0.015, 2)), rng.normal(0, 0.12))
    side = index // 2 % 4  # of the box, counted round
    across = half[1 - side % 2]
    offset = rng.uniform(-0.6, 0.6) * across if rng.random() < 0.6 else 0.0
    oblique = rng.uniform(-0.45, 0.45) if rng.random() < 0.4 else 0.0
    normal = box[2] + side * np.pi / 2  # the way into the face
    into, along = np.array([np.cos(normal), np.sin(normal)]), np.array([-np.sin(normal), np.cos(normal)])
    touch = np.array(box[:2]) - into * half[side % 2] + along * offset
    hit = index % 2 == 0
    # As low as people push what must not topple.
    highest = min(0.5 * size[2], 0.75 * half[side % 2] / box_.friction)
    height = rng.uniform(min(0.018, 0.6 * highest), highest)
    lean = leans[(index + 1) // 2 % 2] if refused < 4 else min(leans)
    return Stroke(
        box, normal + oblique, touch, height, lean,
        0.96**refused * (rng.uniform(0.4, 0.9) if hit else rng.uniform(0.15, 0.4)), rng.uniform(0.08, 0.11),
        rng.uniform(0.0, 0.01) if hit else rng.uniform(0.05, 0.10), rng.uniform(0.035, 0.05) if hit else rng.uniform(0.02, 0.04))


def way(stroke):
    """Distance of the tip's surface beyond the touch, a number for each millisecond [m]."""
    v, clear = stroke.speed, 0.015
    up, even, down = 2 * (stroke.run_up - clear) / v, (clear + stroke.follow) / v, 2 * stroke.brake / v
    t = np.arange(int(1000 * (0.15 + up + even + down + WAIT))) * 1e-3 - 0.15
    rise = 0.5 * (1 - np.cos(np.pi * np.clip(t / up, 0, 1)))
    fall = 0.5 * (1 + np.cos(np.pi * np.clip((t - up - even) / down, 0, 1)))
    speed = v * rise * fall * (t > 0)
    return np.concatenate([[0.0], np.cumsum(0.5e-3 * (speed[1:] + speed[:-1]))]) - stroke.run_up


class Planner:
    """Inverse kinematics of the tip's place and of the tool's direction; its turn about itself is free."""

    def __init__(self, nominal, radius):
        self.model, self.data, self.radius = nominal, mujoco.MjData(nominal), radius
        self.tip = mujoco.mj_name2id(nominal, mujoco.mjtObj.mjOBJ_SITE, "tip")

    def _correct(self, q, place, axis):
        model, data = self.model, self.data
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacSite(model, data, linear, angular, self.tip)
        now = data.site_xmat[self.tip].reshape(3, 3)[:, 2]
        error = np.concatenate([place - data.site_xpos[self.tip], np.cross(now, axis)])
        jacobian = np.vstack([linear, angular - np.outer(now, now @ angular)])
        pull = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + 1e-6 * np.eye(6), np.eye(6))
        return pull @ error, np.eye(model.nv) - pull @ jacobian, np.abs(error).max()

    def plan(self, stroke):
        """Commands of the stroke: q_d [rad] and dq_d [rad/s], a row for each millisecond."""
        level = np.array([np.cos(stroke.heading), np.sin(stroke.heading), 0.0])
        axis = np.sin(stroke.lean) * level - np.array([0.0, 0.0, np.cos(stroke.lean)])
        touch = np.array([*stroke.touch, stroke.height]) - self.radius * level
        q, out = fr3.REST.copy(), []
        for _ in range(200):
            step, free, error = self._correct(q, touch + level * -stroke.run_up, axis)
            step = step + free @ (0.1 * (fr3.REST - q))
            q = q + step * min(1.0, 0.2 / np.abs(step).max())
        if error > 1e-4:
            raise Refused("out of reach")
        for distance in way(stroke):
            for _ in range(2):
                step, _, error = self._correct(q, touch + level * distance, axis)
                q = q + step
            if error > 1e-4:
                raise Refused("out of reach on the way")
            out.append(q)
        q_d = np.array(out)
        dq_d = np.gradient(q_d, 1e-3, axis=0)
        if (q_d < fr3.Q_MIN + 0.05).any() or (q_d > fr3.Q_MAX - 0.05).any():
            raise Refused("beyond a joint's stop")
        if (np.abs(dq_d) > 0.8 * fr3.SPEED).any():
            raise Refused("too fast for a joint")
        return q_d, dq_d
