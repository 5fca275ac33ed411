"""What a cell in MuJoCo has that its task file does not say: drawn once by a number, the same for all who act in it."""
import copy

import numpy as np

# How exact a task file is after it was identified: one sigma of each number of the camera's place [m], of a mass and of a friction (shares).
CAMERA, MASS, FRICTION = 0.001, 0.03, 0.05


class Hidden:
    """`task`: the task as it really is. The arm comes `delay` s later and with a time constant `lag` s to where it is sent; encoders scatter
    by `encoder` rad; depth scatters by `depth` m at 1 m and with its square, and a share `holes` of it is missing."""

    def __init__(self, task, number):
        generator = np.random.default_rng(number)
        self.task = copy.deepcopy(task)
        self.delay, self.lag = generator.uniform(0.01, 0.03), generator.uniform(0.03, 0.07)
        self.encoder, self.depth, self.holes = 2e-4, generator.uniform(1e-3, 2e-3), 5e-3
        for camera in self.task.get("camera", []):
            for key in ("position", "look_at"):
                camera[key] = [float(value + generator.uniform(-0.015, 0.015)) for value in camera[key]]
        for body in self.task["body"]:
            body["friction"] *= float(generator.uniform(0.75, 1.3))
            if "mass" in body:
                body["mass"] *= float(generator.uniform(0.75, 1.3))
            for key in ("friction", "damping"):
                if key in body.get("joint", {}):
                    body["joint"][key] *= float(generator.uniform(0.75, 1.3))

    def identified(self, number):
        """The task file as identification leaves it: near to how it is, not there."""
        generator = np.random.default_rng([number, 1])
        task = copy.deepcopy(self.task)
        for camera in task.get("camera", []):
            for key in ("position", "look_at"):
                camera[key] = [float(value + CAMERA * generator.standard_normal()) for value in camera[key]]
        for body in task["body"]:
            body["friction"] *= float(1 + FRICTION * generator.standard_normal())
            if "mass" in body:
                body["mass"] *= float(1 + MASS * generator.standard_normal())
            for key in ("friction", "damping"):
                if key in body.get("joint", {}):
                    body["joint"][key] *= float(1 + FRICTION * generator.standard_normal())
        return task
