"""How a session's joints are logged: every row or some of them, with stamps that jitter, from a motion on."""
from dataclasses import dataclass

import numpy as np

BETWEEN = ("smooth", "held", "line")


@dataclass
class Log:
    """What a laboratory's logger does. Nothing of it is a fault of the robot."""

    every: int = 1  # the log has every so many of the commands
    measured_every: int = 1  # and of the measured rows
    between: str = "smooth"  # what the controller is given between logged commands: commands at 1 kHz, the last one, the straight line
    jitter: float = 0.0  # of the stamps, uniform, one sigma [s]
    begins: int = 0  # the first row that is logged

    def given(self, commands):
        """Of planned commands (a row for each millisecond) what the controller gets."""
        rows = np.arange(len(commands))
        before = rows // self.every * self.every
        if self.between == "held":
            return commands[before]
        if self.between == "line":
            after = np.minimum(before + self.every, len(commands) - 1)
            share = ((rows - before) / np.maximum(after - before, 1))[:, None]
            return commands[before] * (1 - share) + commands[after] * share
        return commands

    def stamps(self, rows, every, tick_ns, rng):
        """The logged rows of so many, and their stamps [ns] since the first tick."""
        kept = np.arange(self.begins, rows, every)
        off = rng.uniform(-1.0, 1.0, len(kept)) * np.sqrt(3.0) * self.jitter * 1e9
        return kept, (kept * tick_ns + np.round(off)).astype(int)

    def written(self):
        """For truth.json."""
        return {"commands_every_ms": self.every, "measured_every_ms": self.measured_every, "between": self.between,
                "jitter_s": self.jitter, "begins_ms": self.begins}


def draw(rng):
    """A way of logging by lot."""
    every = int(rng.choice([1, 2, 4, 10]))
    return Log(every=every, measured_every=int(rng.choice([1, 1, 2])), between=str(rng.choice(BETWEEN)) if every > 1 else "smooth",
               jitter=float(rng.choice([0.0, np.exp(rng.uniform(np.log(8e-6), np.log(2.5e-4)))])),
               begins=int(rng.choice([0, rng.integers(300, 1500)])))
