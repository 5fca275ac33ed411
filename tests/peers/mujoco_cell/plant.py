"""One clip: the controller drives the simulated arm, effects act, and what the sensors would see is kept without noise.

Order of a millisecond: the reading, the command as it arrives, the torque asked for, the torque that the motors give,
the steps of the engine. The arm holds its first command for half a second before anything is recorded.
"""
from dataclasses import dataclass

import mujoco
import numpy as np

from . import fr3, model
from .controller import Controller

HOLD = 500  # ticks before the recording


@dataclass
class Trace:
    """A row for each millisecond. Torques are those of the millisecond that begins at the row."""

    q: np.ndarray  # what the encoders read [rad]
    dq: np.ndarray  # [rad/s]
    tau: np.ndarray  # behind the gears, with gravity [N m]
    tau_d: np.ndarray  # asked for, without gravity [N m]
    place: np.ndarray  # of the box [m]; empty without one
    turn: np.ndarray  # quaternion w, x, y, z
    touched: np.ndarray  # whether tool and box touched


class Plant:
    """The simulated cell, which effects look at and act upon."""

    def __init__(self, build, gains, nominal, effects):
        self.build, self.effects = build, effects
        self.model = model.compiled(build)
        self.data = mujoco.MjData(self.model)
        self.controller = Controller(*gains, nominal)
        name = lambda kind, text: mujoco.mj_name2id(self.model, kind, text)
        motors = [name(mujoco.mjtObj.mjOBJ_JOINT, f"motor{i}") for i in range(fr3.DOF)]
        self.position, self.motor = self.model.jnt_qposadr[motors], self.model.jnt_dofadr[motors]
        self.rotor = self.model.dof_armature[self.motor].copy()
        self.box = self.box_at = self.box_dof = None
        if build.box is not None:
            self.box = name(mujoco.mjtObj.mjOBJ_BODY, "box")
            joint = name(mujoco.mjtObj.mjOBJ_JOINT, "box")
            self.box_at, self.box_dof = self.model.jnt_qposadr[joint], self.model.jnt_dofadr[joint]
            feet = [name(mujoco.mjtObj.mjOBJ_GEOM, f"foot{i}") for i in range(4)]
            self.feet = np.array([self.model.geom_pos[foot] for foot in feet])
            self.foot_pairs = [name(mujoco.mjtObj.mjOBJ_PAIR, f"foot{i}-table") for i in range(4)]
            self.tool, self.body_of_box = (name(mujoco.mjtObj.mjOBJ_GEOM, text) for text in ("tool", "box"))
        self.clock = 0.0  # since the first recorded row [s]
        self.asked = np.zeros(fr3.DOF)  # of the motors [N m]
        self.lost = np.zeros(fr3.DOF)  # between motor and sensor, by effects [N m]
        # Those that do something in every step of the engine.
        self.acting = [effect for effect in effects if effect.acts]

    def reading(self):
        """What the encoders of the motors read, without noise [rad], [rad/s]."""
        dq = self.data.qvel[self.motor].copy()
        return self.data.qpos[self.position] - self.build.engine.ahead * dq, dq

    def box_pose(self):
        at = self.box_at
        return self.data.qpos[at:at + 3].copy(), self.data.qpos[at + 3:at + 7].copy()

    def box_axes(self):
        """Rotation matrix of the box."""
        axes = np.zeros(9)
        mujoco.mju_quat2Mat(axes, self.data.qpos[self.box_at + 3:self.box_at + 7])
        return axes.reshape(3, 3)

    def feet_now(self):
        """Place and velocity of the four feet in the plane of the table [m], [m/s]."""
        axes, velocity = self.box_axes(), self.data.qvel[self.box_dof:self.box_dof + 6]
        arms = self.feet @ axes.T
        speed = velocity[:3] + np.cross(axes @ velocity[3:], arms)
        return (self.data.qpos[self.box_at:self.box_at + 3] + arms)[:, :2], speed[:, :2]

    def push_box(self, force):
        """Adds a force at the centre of mass, for this step [N]."""
        self.data.xfrc_applied[self.box, :3] += force

    def _friction(self):
        """Torque of the engine's own joint friction, dry and viscous [N m]."""
        data, model_ = self.data, self.model
        dry = np.zeros(model_.nv)
        rows = data.efc_type[:data.nefc] == mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF
        dry[data.efc_id[:data.nefc][rows]] = data.efc_force[:data.nefc][rows]
        return dry[self.motor] - model_.dof_damping[self.motor] * data.qvel[self.motor]

    def _tick(self, q_d, dq_d):
        q, dq = self.reading()
        for effect in self.effects:
            q, dq = effect.encoder(q, dq)
        seen = q, dq
        for effect in self.effects:
            q_d, dq_d = effect.command(q_d, dq_d)
        tau, gravity = self.controller.torque(q, dq, q_d, dq_d)
        for effect in self.effects:
            tau = effect.asked(tau)
        wanted = tau - gravity
        for effect in self.effects:
            tau = effect.torque(tau)
        self.asked = tau
        before = self.data.qvel[self.motor].copy()
        losses, touched = np.zeros(fr3.DOF), False
        for _ in range(self.build.engine.substeps):
            self.lost = np.zeros(fr3.DOF)
            if self.box is not None:
                self.data.xfrc_applied[self.box] = 0.0
            for effect in self.acting:
                effect.step(self)
            self.data.qfrc_applied[self.motor] = tau - self.lost
            mujoco.mj_step(self.model, self.data)
            losses += self.lost - self._friction()
            touched = touched or self._touching()
            self.clock += self.build.engine.step
        passed = tau - losses / self.build.engine.substeps
        passed -= self.rotor * (self.data.qvel[self.motor] - before) / 1e-3
        for effect in self.effects:
            passed = effect.torque_sensor(passed)
        return seen, passed, wanted, touched

    def _touching(self):
        if self.box is None or self.data.ncon == 0:
            return False
        geoms = self.data.contact.geom
        return bool(((geoms == self.tool).any(axis=1) & (geoms == self.body_of_box).any(axis=1)).any())

    def run(self, q_d, dq_d, box=None):
        """Plays commands [rows, 7]; `box` is (x, y, yaw) in which the box stands."""
        data = self.data
        data.qpos[self.position] = q_d[0]
        if self.box is not None:
            at, (x, y, yaw) = self.box_at, box
            data.qpos[at:at + 7] = [x, y, self.build.box.half[2], np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]
        self.clock = -HOLD * 1e-3
        for effect in self.effects:
            effect.begin(self, q_d[0])
        for _ in range(HOLD):
            self._tick(q_d[0], np.zeros(fr3.DOF))
        self.clock = 0.0
        rows, places, turns = [], [], []
        for row in range(len(q_d)):
            if self.box is not None:
                place, turn = self.box_pose()
                places.append(place)
                turns.append(turn)
            rows.append(self._tick(q_d[row], dq_d[row]))
        return Trace(np.array([r[0][0] for r in rows]), np.array([r[0][1] for r in rows]), np.array([r[1] for r in rows]),
                     np.array([r[2] for r in rows]), np.array(places), np.array(turns), np.array([r[3] for r in rows]))
