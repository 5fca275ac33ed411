"""A Franka FR3 under joint impedance control: with a plate onto which a box falls, and with the hand of a task."""
import mujoco
import numpy as np

from mujoco_cell import fr3
from mujoco_cell.model import Build, Engine, Tool, arm

from .model import element, mjcf, numbers

LIGHT = 1e-6  # [kg] of the tool that the arm's model brings along: it weighs nothing and touches nothing


class Carrying:
    """The arm at `q`, commanded to stay there; its plate is a box in the axes of the flange."""

    def __init__(self, q, gains, plate, box, step=2.5e-4):
        size, place = plate
        surface = f'<geom name="plate" type="box" size="{numbers(0.5 * edge for edge in size)}" pos="{numbers(place)}" friction="0.8" mass="0"/>'
        build = Build(Engine(), Tool(mass=LIGHT), at_flange=[surface])
        edge, mass, at = box
        falling = (f'<body name="box" pos="{numbers(at)}"><freejoint name="box"/>'
                   f'<geom name="box" type="box" size="{numbers([0.5 * edge] * 3)}" friction="0.8" mass="{mass}"/></body>')
        chain = arm(build).replace('<geom name="tool"', '<geom contype="0" conaffinity="0" name="tool"')
        self.model = mujoco.MjModel.from_xml_string(
            f'<mujoco><compiler angle="radian" balanceinertia="true" autolimits="true"/>'
            f'<option timestep="{step}" cone="elliptic" impratio="20" integrator="implicitfast" gravity="0 0 -9.81"/>'
            f'<default><geom solref="{4 * step} 1"/></default><worldbody>{chain}{falling}</worldbody></mujoco>')
        self.data = mujoco.MjData(self.model)
        self.joints = [self.model.joint(f"motor{i}") for i in range(fr3.DOF)]
        self.at = np.array([joint.qposadr[0] for joint in self.joints])
        self.speed = np.array([joint.dofadr[0] for joint in self.joints])
        self.q_d, (self.stiffness, self.damping) = np.array(q), (np.array(gain) for gain in gains)
        self.data.qpos[self.at] = self.q_d
        mujoco.mj_forward(self.model, self.data)

    def go_on(self, seconds):
        for _ in range(round(seconds / self.model.opt.timestep)):
            q, dq = self.data.qpos[self.at], self.data.qvel[self.speed]
            # Gravity and velocity products of the arm are what the controller takes off.
            torque = self.stiffness * (self.q_d - q) - self.damping * dq + self.data.qfrc_bias[self.speed]
            self.data.qfrc_applied[self.speed] = torque
            mujoco.mj_step(self.model, self.data)

    def q(self):
        return self.data.qpos[self.at].copy()


def resting(task, q, step=1e-3):
    """A task at its start, whose arm at `q` is held there by its controller: springs and dampers in its joints, without gravity. Model and
    data."""
    carrying = task["arm"]

    def root(body, task):
        if body["name"] != carrying["body"]:
            return element(body, task)
        fixed = {**body, "hold": "fixed", "position": carrying.get("position", [0, 0, 0]), "rotation": carrying.get("rotation", [0, 0, 0])}
        build = Build(Engine(), Tool(mass=LIGHT), at_flange=[element(fixed, task)], viscous=np.array(carrying["damping"], float))
        chain = arm(build).replace('<geom name="tool"', '<geom contype="0" conaffinity="0" name="tool"')
        for i, (stiffness, place) in enumerate(zip(carrying["stiffness"], q)):
            chain = chain.replace(f'name="motor{i}"', f'name="motor{i}" stiffness="{stiffness}" springref="{place:.12g}"')
        return chain.replace('<body name="link', '<body gravcomp="1" name="link')

    model = mujoco.MjModel.from_xml_string(mjcf(task, step, root))
    data = mujoco.MjData(model)
    for i, place in enumerate(q):
        data.qpos[model.joint(f"motor{i}").qposadr[0]] = place
    mujoco.mj_forward(model, data)
    return model, data
