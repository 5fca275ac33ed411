"""Effects between command and motor, and on what the arm's sensors report."""
import numpy as np

from . import fr3
from .effect import Effect, log_uniform, sign

TICK = 1e-3  # of the controller [s]


class Delay:
    """Rows that come later by a time that need not be whole milliseconds."""

    def __init__(self, seconds):
        self.ticks, self.past = seconds / TICK, None

    def after(self, row):
        whole = int(self.ticks)
        if self.past is None:
            self.past = [row] * (whole + 2)
        self.past = [row] + self.past[:whole + 1]
        part = self.ticks - whole
        return (1 - part) * self.past[whole] + part * self.past[whole + 1]


class CommandDelay(Effect):
    name = "command_delay"
    parameters = {"delay": "s"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 0.010, 0.025))

    def begin(self, plant, q):
        self.line = Delay(self.delay)

    def command(self, q_d, dq_d):
        both = self.line.after(np.concatenate([q_d, dq_d]))
        return both[:fr3.DOF], both[fr3.DOF:]


class CommandLag(Effect):
    name = "command_lag"
    parameters = {"time_constant": "s"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 0.005, 0.012))

    def begin(self, plant, q):
        self.now = np.concatenate([q, np.zeros(fr3.DOF)])

    def command(self, q_d, dq_d):
        share = 1 - np.exp(-TICK / self.time_constant)
        self.now = self.now + share * (np.concatenate([q_d, dq_d]) - self.now)
        return self.now[:fr3.DOF], self.now[fr3.DOF:]


class IntegralAction(Effect):
    """The controller sums up what a joint is off."""

    name = "integral_action"
    parameters = {"rate": "per_s"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 1.5, 2.0) * rng.uniform(0.7, 1.3, fr3.DOF))

    def begin(self, plant, q):
        self.gain, self.sum = self.rate * plant.controller.stiffness, np.zeros(fr3.DOF)

    def encoder(self, q, dq):
        self.q = q
        return q, dq

    def command(self, q_d, dq_d):
        self.q_d = q_d
        return q_d, dq_d

    def asked(self, tau):
        asked = tau + self.sum
        self.sum = self.sum + self.gain * (self.q_d - self.q) * TICK
        return asked


class TorqueDelay(Effect):
    name = "torque_delay"
    parameters = {"delay": "s"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 0.001, 0.001))

    def begin(self, plant, q):
        self.line = Delay(self.delay)

    def torque(self, tau):
        return self.line.after(tau)


class TorqueGain(Effect):
    name = "torque_gain"
    parameters = {"gain": ""}

    @classmethod
    def draw(cls, rng, cell):
        return cls(1 + sign(rng) * log_uniform(rng, 0.03, 0.06) * rng.uniform(0.7, 1.0, fr3.DOF))

    def torque(self, tau):
        return self.gain * tau


class TorqueSaturation(Effect):
    """Limits between what holds the arm up and the largest torque that its motions ask for."""

    name = "torque_saturation"
    parameters = {"limit": "N_m"}

    @classmethod
    def draw(cls, rng, cell):
        lacking = min(0.9, log_uniform(rng, 0.3, 0.3))
        peak, held = cell.torques
        return cls(1.1 * held + (1 - lacking) * np.maximum(peak - 1.1 * held, 0.05))

    def torque(self, tau):
        return np.clip(tau, -self.limit, self.limit)


class JointEncoderOffset(Effect):
    name = "joint_encoder_offset"
    parameters = {"offset": "rad"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 0.003, 0.006) * rng.uniform(-1, 1, fr3.DOF))

    def begin(self, plant, q):
        plant.data.qpos[plant.position] -= self.offset

    def encoder(self, q, dq):
        return q + self.offset, dq


class TorqueSensorBias(Effect):
    name = "torque_sensor_bias"
    parameters = {"bias": "N_m"}

    @classmethod
    def draw(cls, rng, cell):
        return cls(log_uniform(rng, 0.3, 0.6) * rng.uniform(-1, 1, fr3.DOF))

    def torque_sensor(self, tau):
        return tau + self.bias


CONTROL = [CommandDelay, CommandLag, IntegralAction, TorqueDelay, TorqueGain, TorqueSaturation, TorqueSensorBias]
