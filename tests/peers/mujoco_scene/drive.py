"""What moves a joint to a target, at no more than a speed and with no more than a force.

A spring and a damper follow a reference that runs to the target. MuJoCo's own velocity actuator is not used: stiff enough to hold the
speed, and with its force at a limit, it goes from one limit to the other in every step (a finger of 0.05 kg at 30 N: 0.3 m/s back
and forth), and in the mean presses with nothing.
"""
import numpy as np

SPRING = 0.5  # of the stiffest spring that a step of the joint's own inertia allows, [kg/s^2 or kg m^2/s^2] times step^2 / inertia
DAMPER = 1.0  # of the damper that stops the joint within a step
SLOWING = 20  # steps in which the reference would be at the target at the speed that it has near it


class Drive:
    def __init__(self, model, name, order):
        joint = model.joint(name)
        self.at, self.speed, self.actuator = joint.qposadr[0], joint.dofadr[0], model.actuator(name).id
        self.order, self.step = dict(order), model.opt.timestep
        inertia = 1.0 / model.dof_invweight0[self.speed]
        self.stiffness, self.damping = SPRING * inertia / self.step ** 2, DAMPER * inertia / self.step
        self.reference = None

    def force(self, data):
        """The force of the next step [N or N m]; the reference moves on."""
        at, speed, most = data.qpos[self.at], data.qvel[self.speed], self.order["force"]
        ahead = most / self.stiffness
        reference = at if self.reference is None else np.clip(self.reference, at - ahead, at + ahead)
        wanted = np.clip((self.order["target"] - reference) / (SLOWING * self.step), -self.order["speed"], self.order["speed"])
        self.reference = reference + wanted * self.step
        return np.clip(self.stiffness * (self.reference - at) + self.damping * (wanted - speed), -most, most)
