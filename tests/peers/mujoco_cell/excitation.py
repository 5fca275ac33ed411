"""Motions of the arm alone: sums of sines that begin and end at rest."""
import numpy as np

from . import fr3

SECONDS = 4.2
FASTEST = 0.6  # share of a joint's largest speed
FARTHEST = 0.45  # [rad]


def multisine(rng):
    """Commands of one clip: q_d [rad] and dq_d [rad/s], a row for each millisecond."""
    t = np.arange(int(SECONDS * 1000)) * 1e-3
    window = np.sin(np.pi * t / SECONDS) ** 2
    q = np.tile(fr3.REST, (len(t), 1))
    for joint in range(fr3.DOF):
        waves = np.zeros(len(t))
        for frequency in np.exp(rng.uniform(np.log(0.2), np.log(3.0), 5)):
            waves += rng.normal() / frequency * np.sin(2 * np.pi * frequency * t + rng.uniform(0, 2 * np.pi))
        waves *= window
        speed = np.abs(np.gradient(waves, 1e-3)).max() / (FASTEST * rng.uniform(0.15, 0.5) * fr3.SPEED[joint])
        q[:, joint] += waves / max(speed, np.abs(waves).max() / FARTHEST)
    return q, np.gradient(q, 1e-3, axis=0)
