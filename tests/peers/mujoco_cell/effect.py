"""What every hidden effect can do. One class is one effect; each overrides only where it acts.

`name` is the diagnosis's own spelling where it knows the effect; what it does not know has `known = False`.
"""
import numpy as np


class Effect:
    name = ""
    known = True
    near = ()  # of what the diagnosis does not know: the effects that are a part of it
    acts = False  # whether `step` does something
    # What is hidden: numbers, or arrays of one for each joint or axis. Each is an attribute of this name, a key of the twin's own
    # [[effect]] block, and with its unit behind it a key of truth.json.
    parameters = {}

    def __init__(self, *values):
        for name, value in zip(self.parameters, values, strict=True):
            setattr(self, name, np.asarray(value) if np.ndim(value) else value)

    @classmethod
    def draw(cls, rng, cell):
        """One of a size drawn by lot; `cell` is the draw of everything else."""
        raise NotImplementedError

    def sizes(self):
        """What is hidden, with the unit in the key."""
        return {f"{name}_{unit}" if unit else name: self.written(name) for name, unit in self.parameters.items()}

    def block(self):
        """The [[effect]] block with which the twin comes nearest."""
        return {"name": self.name, **{name: self.written(name) for name in self.parameters}}

    def written(self, name):
        value = getattr(self, name)
        return rounded(value) if np.ndim(value) else value

    # Before and at the beginning of a clip.
    def build(self, build):
        """Changes the model's numbers."""

    def clip(self, share, rng):
        """A clip begins; `share` of the session has passed."""

    def begin(self, plant, q):
        """The arm rests at its first command `q`."""

    # In each millisecond, in this order.
    def encoder(self, q, dq):
        return q, dq

    def command(self, q_d, dq_d):
        return q_d, dq_d

    def asked(self, tau):
        """What the controller asks for."""
        return tau

    def torque(self, tau):
        return tau

    def step(self, plant):
        """Before a step of the engine, as often as there are substeps."""

    def torque_sensor(self, tau):
        return tau

    # What the tracker makes of it.
    latency = 0.0  # [s]

    def seen(self, t, place, turn):
        """Place [m] and quaternion (w, x, y, z) as reported at `t` seconds."""
        return place, turn


def log_uniform(rng, usual, most):
    """A size from a tenth of the usual one to three times the largest plausible one."""
    return float(np.exp(rng.uniform(np.log(0.1 * usual), np.log(3.0 * most))))


def any_way(rng, length):
    """A vector in the plane of the table, in any direction."""
    angle = rng.uniform(0, 2 * np.pi)
    return length * np.array([np.cos(angle), np.sin(angle)])


def sign(rng):
    return 1.0 if rng.random() < 0.5 else -1.0


def rounded(values, digits=6):
    """As it stands in files."""
    return [round(float(v), digits) for v in values]
