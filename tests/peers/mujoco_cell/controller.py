"""The arm's joint impedance controller, once a millisecond:

    tau = k (q_d - q) + d (dq_d - dq) + gravity(q) + coriolis(q, dq)

with the nominal arm's gravity and Coriolis torques, kept within the torque limit.
"""
import mujoco
import numpy as np

from . import fr3


class Controller:
    """Gains [N m/rad], [N m s/rad], and the model inside."""

    def __init__(self, stiffness, damping, nominal):
        self.stiffness, self.damping = np.asarray(stiffness), np.asarray(damping)
        self.model, self.data = nominal, mujoco.MjData(nominal)

    def _bias(self, dq):
        out = np.zeros(self.model.nv)
        self.data.qvel[:] = dq
        mujoco.mj_comVel(self.model, self.data)
        mujoco.mj_rne(self.model, self.data, 0, out)
        return out

    def torque(self, q, dq, q_d, dq_d):
        """Torque asked for, and the gravity within it [N m]."""
        self.data.qpos[:] = q
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        gravity = self._bias(0.0)
        bias = self._bias(dq)
        tau = self.stiffness * (q_d - q) + self.damping * (dq_d - dq) + bias
        return np.clip(tau, -fr3.TORQUE, fr3.TORQUE), gravity
