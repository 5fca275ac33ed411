"""Strokes in MuJoCo: the arm with its tool hits an object on a table. Contact and friction are MuJoCo's own.

Until the tool comes near, and again once the object rests out of its reach, the arm moves alone beside an object that stands still.
In between both move together in shorter steps. The way to the object is kept: it is the same for every mass and friction.
"""
from collections import OrderedDict

import mujoco
import numpy as np
from arm import Motion, leaning

TABLE, OBJECT, TOOL = "twinalign_table", "twinalign_object", "twinalign_tool"
NEAR = 0.01  # the object may be touched within some control periods [m]
FAR = 0.02  # and from here on it is not [m]
STILL = (1e-3, 1e-2)  # an object slower than this [m/s], [rad/s] ...
RESTED = 60  # ... for so many control periods rests
KEPT = 64  # ways to the object
HARD = [0.98, 0.995, 0.0005, 0.5, 2.0]  # solimp: contacts that hardly yield

# Effects beyond the arm, with the parameters that are known of each.
EFFECTS = {"object_inertia": ["factor"], "table_tilt": ["tilt"], "tip_friction": ["change"]}
# Numbers of the object that can be set.
PARAMETERS = ["friction", "mass", "centre_of_mass", "tip_friction"]


class Strokes:
    """An arm, and the table and the tool that cell.toml describes."""

    def __init__(self, arm, cell, given):
        self.arm, self.given = arm, given
        self.height, self.tool = cell["table"]["height"], cell["tool"]
        self.worlds, self.ways = {}, OrderedDict()

    def of(self, shape):
        """The arm beside an object of this shape, and together with it."""
        key = (shape["mesh"], *shape["size"])
        if key not in self.worlds:
            self.worlds[key] = [self._built(shape, moves) for moves in (False, True)]
        return self.worlds[key]

    def _built(self, shape, moves):
        spec = self.arm.spec()
        tool = self._tool(spec)
        # A centre of mass that lies in the body's origin could not be moved from there later.
        body = spec.worldbody.add_body(name=OBJECT, mass=1.0, inertia=[1e-3, 2e-3, 2.5e-3], ipos=[1e-3, 2e-3, 3e-3],
                                       iquat=[0.8, 0.6, 0.0, 0.0], explicitinertial=True)
        quiet = {"contype": 0, "conaffinity": 0}
        if shape["mesh"]:
            spec.add_mesh(name=OBJECT, file=shape["mesh"])
            body.add_geom(name=OBJECT, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=OBJECT, pos=-middle(shape["mesh"]), **quiet)
        else:
            body.add_geom(name=OBJECT, type=mujoco.mjtGeom.mjGEOM_BOX, size=0.5 * np.array(shape["size"]), **quiet)
        if moves:
            body.add_freejoint(name=OBJECT)
            spec.worldbody.add_geom(name=TABLE, type=mujoco.mjtGeom.mjGEOM_PLANE, pos=[0, 0, self.height], size=[3, 3, 0.1], **quiet)
            for other, solref in ((TABLE, self.given.table), (tool, self.given.tip)):
                spec.add_pair(geomname1=other, geomname2=OBJECT, condim=3, solref=solref, solimp=HARD)
            spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 100.0
        world = self.arm.built(spec, 1e-3 * (self.given.contact_step if moves else self.given.step))
        world.touches, model = moves, world.model
        world.body, world.geoms = model.body(OBJECT).id, (model.geom(tool).id, model.geom(OBJECT).id)
        if moves:
            joint = model.joint(OBJECT)
            world.pose, world.velocity = world.data.qpos[joint.qposadr[0]:][:7], world.data.qvel[joint.dofadr[0]:][:6]
        return world

    def _tool(self, spec):
        """The geom that hits: the model's own, or the capsule of cell.toml on the flange."""
        if spec.geom(self.given.tool):
            return self.given.tool
        if not self.arm.flange:
            raise ValueError(f"{self.arm.path} has no geom `{self.given.tool}` that could hit an object, and no flange to fix one to; "
                             "--tool names the geom, --flange the body")
        length, radius = self.tool["length"], self.tool["radius"]
        spec.body(self.arm.flange).add_geom(name=TOOL, type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[radius, 0, 0], mass=0.0,
                                            fromto=[0, 0, 0, 0, 0, length - radius], contype=0, conaffinity=0)
        return TOOL

    def roll_out(self, asked):
        """States [rows, readings, dof] and poses [poses, 7] at the times that are asked for."""
        beside, together = self.of(asked.object)
        beside.set(asked.effects)
        together.set(asked.effects)
        for world in (beside, together):
            furnish(world, asked)
        motion = Motion(self.arm, asked)
        poses = np.empty((motion.ticks + 1, 7))
        poses[0] = asked.object["position"] + asked.object["orientation"]
        self._approach(beside, motion, poses, asked)
        while motion.tick < motion.ticks:
            moved_until_rest(together, motion, poses)
            if motion.tick < motion.ticks:
                stand(beside, motion, poses)
        return motion.states(asked), poses_at(poses, asked.pose_times / self.arm.period)

    def _approach(self, beside, motion, poses, asked):
        of_arm = sorted((name, repr(value)) for name, value in asked.effects.items() if name not in EFFECTS)
        gains = [values.tobytes() for values in asked.parameters.values()]
        key = (asked.q.tobytes(), asked.dq.tobytes(), asked.commands.tobytes(), asked.before, poses[0].tobytes(), *gains, *of_arm)
        if key in self.ways:
            motion.resume(self.ways[key])
            poses[:motion.tick + 1] = poses[0]
            return
        stand(beside, motion, poses)
        self.ways[key] = motion.kept()
        while len(self.ways) > KEPT:
            self.ways.popitem(last=False)


def middle(mesh):
    """Middle of a mesh's bounding box, in the axes of its file [m]."""
    spec = mujoco.MjSpec()
    spec.add_mesh(name="mesh", file=mesh)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh")
    model = spec.compile()
    axes = np.empty(9)
    mujoco.mju_quat2Mat(axes, model.geom_quat[0])
    corners = model.mesh_vert @ axes.reshape(3, 3).T + model.geom_pos[0]
    return 0.5 * (corners.min(axis=0) + corners.max(axis=0))


def furnish(world, asked):
    """Gives the object its numbers, and effects on it."""
    model, numbers, effects = world.model, asked.object, asked.effects
    if world.touches:
        inertia, mass = np.array(numbers["inertia"]), numbers["mass"]
        inertia[2, 2] *= effects.get("object_inertia", {}).get("factor", 1.0)
        moments, axes = np.linalg.eigh(inertia)
        axes[:, 2] *= np.sign(np.linalg.det(axes))
        mujoco.mju_mat2Quat(model.body_iquat[world.body], axes.ravel())
        model.body_mass[world.body], model.body_inertia[world.body] = mass, moments
        model.body_ipos[world.body] = numbers["centre_of_mass"]
        tip = numbers["tip_friction"] + effects.get("tip_friction", {}).get("change", 0.0)
        # In the order in which the pairs were added.
        model.pair_friction[:2, :2] = np.maximum([[numbers["friction"]] * 2, [tip] * 2], 1e-6)
        pull = leaning(world.gravity, np.array(effects.get("table_tilt", {}).get("tilt", [0.0, 0.0])))
        world.pull = mass * (pull - model.opt.gravity)
    mujoco.mj_setConst(model, world.data)


def distance(world, most):
    """Between tool and object, as far as it is less than `most` [m]."""
    return mujoco.mj_geomDistance(world.model, world.data, *world.geoms, most, None)


def stand(world, motion, poses):
    """Lets the arm move while the object stands, until the tool comes near."""
    pose = poses[motion.tick].copy()
    mujoco.mj_resetData(world.model, world.data)
    world.model.body_pos[world.body], world.model.body_quat[world.body] = pose[:3], pose[3:]
    motion.begin(world)
    while motion.tick < motion.ticks:
        motion.advance(world)
        poses[motion.tick] = pose
        if distance(world, NEAR) < NEAR:
            return


def moved_until_rest(world, motion, poses):
    """Lets arm and object move, until the object rests out of the tool's reach."""
    mujoco.mj_resetData(world.model, world.data)
    world.data.xfrc_applied[world.body, :3] = world.pull
    world.pose[:] = poses[motion.tick]
    motion.begin(world)
    turn, rested = np.empty(4), 0
    while motion.tick < motion.ticks:
        motion.advance(world)
        velocity = world.velocity
        turn[:] = world.pose[3:]
        mujoco.mju_quatIntegrate(turn, velocity[3:], -world.ahead)
        poses[motion.tick, :3], poses[motion.tick, 3:] = world.pose[:3] - world.ahead * velocity[:3], turn
        still = np.abs(velocity[:3]).max() < STILL[0] and np.abs(velocity[3:]).max() < STILL[1]
        rested = rested + 1 if still else 0
        if rested >= RESTED and distance(world, FAR) >= FAR:
            return


def poses_at(poses, ticks):
    """Poses at times between the ends of control periods."""
    before = np.clip(np.floor(ticks + 1e-6).astype(int), 0, len(poses) - 1)
    after = np.minimum(before + 1, len(poses) - 1)
    share = np.clip(ticks - before, 0.0, 1.0)[:, None]
    share[share < 1e-6] = 0.0
    one, other = poses[before], poses[after].copy()
    other[:, 3:] *= np.where((one[:, 3:] * other[:, 3:]).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    out = (1 - share) * one + share * other
    out[:, 3:] /= np.linalg.norm(out[:, 3:], axis=1)[:, None]
    return out
