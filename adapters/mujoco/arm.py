"""An arm in MuJoCo under the controller of cell.toml, with what MuJoCo can do of the effects of docs/effects.md.

The model is the user's: masses, rotors (`armature`), friction and damping of joints count as they stand in it. Its actuators are
left out, and so are bodies that float freely: the object comes from the session. The law of cell.toml takes the actuators' place:
tau = k (q_d - q) + d (dq_d - dq) + gravity(q) + coriolis(q, dq), without dq_d for `compensated_pd`, or tau = k (q_d - q) - d dq for
`joint_pd`, once a control period and held over it.
"""
import mujoco
import numpy as np
from protocol import Impossible

FLOWN = 100.0  # a joint that far from 0 has left all bounds [rad]
LOAD = "twinalign_load"

# Effects, with the parameters that are known of each. Dry friction is not among them: MuJoCo's `frictionloss` builds up otherwise than
# coulomb tanh(dq / creep), and a verdict on it then has a wrong name. What the twin makes of it is added instead.
EFFECTS = {
    "base_tilt": ["tilt"],
    "command_delay": ["delay"],
    "command_lag": ["time_constant"],
    "joint_encoder_offset": ["offset"],
    "joint_friction_asymmetry": ["offset"],
    "joint_viscous_friction": ["viscous"],
    "payload": ["mass", "centre"],
    "rotor_inertia": ["extra"],
    "torque_delay": ["delay"],
    "torque_gain": ["gain"],
    "torque_saturation": ["limit"],
    "torque_sensor_bias": ["bias"],
}


def late(rows, ticks):
    """Rows that come later by so many ticks, on straight lines between them; before the first row it held."""
    ticks = round(ticks * 1e6) * 1e-6
    whole = int(ticks)
    at = np.arange(len(rows))
    part = ticks - whole
    return (1 - part) * rows[np.maximum(at - whole, 0)] + part * rows[np.maximum(at - whole - 1, 0)]


def smoothed(rows, share):
    """A first-order lag that goes `share` of the way in each tick."""
    out, now = np.empty_like(rows), rows[0].copy()
    for i, row in enumerate(rows):
        now += share * (row - now)
        out[i] = now
    return out


def leaning(gravity, tilt):
    """Gravity in the axes of a base that is turned by `tilt` about x and y."""
    angle = np.hypot(*tilt)
    if angle == 0:
        return gravity
    axis = np.array([*tilt, 0.0]) / angle
    return (gravity * np.cos(angle) - np.cross(axis, gravity) * np.sin(angle) + axis * (axis @ gravity) * (1 - np.cos(angle)))


class World:
    """A compiled model with the arm in it."""

    touches = False  # whether something may push the arm

    def __init__(self, spec, path, joints, period, step):
        spec.option.timestep = step
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        self.model = spec.compile()
        # The controller compensates gravity itself.
        self.model.body_gravcomp[:] = 0.0
        self.data = mujoco.MjData(self.model)
        missing = [name for name in joints if mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_JOINT, name) < 0]
        if missing:
            there = ", ".join(self.model.joint(i).name for i in range(self.model.njnt))
            raise ValueError(f"{path} has no joint `{missing[0]}`, only {there}; --joints names yours in the order of {', '.join(joints)}")
        numbers = [self.model.joint(name).id for name in joints]
        first = [self.model.jnt_qposadr[numbers], self.model.jnt_dofadr[numbers]]
        if any((np.diff(places) != 1).any() for places in first):
            raise ValueError(f"the joints of {path} do not follow each other in the order of {', '.join(joints)}")
        self.at, self.dofs = (slice(places[0], places[0] + len(joints)) for places in first)
        self.steps = max(1, round(period / step))
        # A semi-implicit step leaves positions half a step ahead of velocities.
        self.ahead = 0.5 * step
        self.nominal = {name: getattr(self.model, name).copy() for name in ("dof_armature", "dof_damping")}
        self.gravity = self.model.opt.gravity.copy()
        data = self.data
        self.position, self.speed, self.torque = data.qpos[self.at], data.qvel[self.dofs], data.qfrc_applied[self.dofs]
        self.load = self.model.body(LOAD).id if mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, LOAD) >= 0 else None

    def set(self, effects):
        """The arm with these effects; its state is lost."""
        model, of = self.model, lambda effect, name: np.asarray(effects.get(effect, {}).get(name, 0.0), float)
        mujoco.mj_resetData(model, self.data)
        for name, values in self.nominal.items():
            getattr(model, name)[:] = values
        model.dof_armature[self.dofs] = np.maximum(model.dof_armature[self.dofs] + of("rotor_inertia", "extra"), 0.0)
        model.dof_damping[self.dofs] += of("joint_viscous_friction", "viscous")
        model.opt.gravity[:] = leaning(self.gravity, of("base_tilt", "tilt") + np.zeros(2))
        if self.load is not None:
            model.body_mass[self.load] = max(float(of("payload", "mass")), 1e-9)
            model.body_ipos[self.load] = of("payload", "centre") + np.zeros(3)

    def friction(self):
        """Torque of the model's own joint friction and limits in the step just taken [N m]."""
        data, dofs = self.data, self.dofs
        if not self.touches:
            return data.qfrc_passive[dofs] + data.qfrc_constraint[dofs]
        dry, rows = np.zeros(self.model.nv), data.efc_type[:data.nefc] == mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF
        dry[data.efc_id[:data.nefc][rows]] = data.efc_force[:data.nefc][rows]
        return data.qfrc_passive[dofs] + dry[dofs]

    def put(self, q, dq):
        """Puts the arm where its joints are at `q` when they move at `dq`."""
        self.position[:], self.speed[:] = q + self.ahead * dq, dq


class Arm:
    """The user's model, ready to be rolled out."""

    def __init__(self, path, cell, joints, period, step, flange):
        self.path, self.joints, self.period = path, joints, period
        self.flange = None
        spec = self.spec()
        self.flange = next((name for name in (flange, "flange", "attachment") if name and spec.body(name)), None)
        if flange and self.flange != flange:
            raise ValueError(f"{path} has no body `{flange}`; --flange names the body that the tool is fixed to")
        self.world = self.built(self.spec(), step)
        controller = cell["controller"]
        laws = {"joint_impedance": (True, True), "compensated_pd": (False, True), "joint_pd": (False, False)}
        if controller["kind"] not in laws:
            raise ValueError(f"the control law `{controller['kind']}` is not known to this adapter")
        self.follows_speed, self.compensates = laws[controller["kind"]]
        self.limit = np.array(controller.get("torque_limit", [np.inf] * len(joints)), float)
        self.believed = Believed(self.spec().compile(), self.world.at, self.world.dofs)

    def spec(self):
        """The user's model, to be added to."""
        spec = mujoco.MjSpec.from_file(self.path)
        floating = [joint.parent for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]
        for element in [*spec.actuators, *spec.sensors, *spec.keys, *floating]:
            spec.delete(element)
        if self.flange:
            load = spec.body(self.flange).add_body(name=LOAD)
            load.mass, load.inertia, load.explicitinertial = 1e-9, [1e-12] * 3, True
        return spec

    def built(self, spec, step):
        return World(spec, self.path, self.joints, self.period, step)

    def effects(self):
        return {name: parameters for name, parameters in EFFECTS.items() if name != "payload" or self.flange}

    def commands(self, asked):
        commands, effects = asked.commands, asked.effects
        if "command_delay" in effects:
            commands = late(commands, effects["command_delay"]["delay"] / self.period)
        if "command_lag" in effects and effects["command_lag"]["time_constant"] > 0:
            commands = smoothed(commands, 1 - np.exp(-self.period / effects["command_lag"]["time_constant"]))
        return commands[asked.before:]

    def roll_out(self, asked):
        """States [rows, readings that are asked for, dof] at the times that are asked for."""
        world, motion = self.world, Motion(self, asked)
        world.set(asked.effects)
        if world.load is not None:
            # Masses of subtrees are sums of these.
            mujoco.mj_setConst(world.model, world.data)
        motion.begin(world)
        while motion.tick < motion.ticks:
            motion.advance(world)
        return motion.states(asked)


class Motion:
    """An arm under its law, a control period at a time, in whichever world it is."""

    def __init__(self, arm, asked):
        self.arm, part = arm, lambda effect, name: np.asarray(asked.effects.get(effect, {}).get(name, 0.0), float)
        self.offset, self.lost = part("joint_encoder_offset", "offset"), part("joint_friction_asymmetry", "offset")
        self.bias = part("torque_sensor_bias", "bias")
        commands, self.motors = arm.commands(asked), Motors(asked.effects, arm.period)
        self.stiffness, self.damping = asked.parameters["stiffness"], asked.parameters["damping"]
        # All of the law that is known beforehand.
        self.wanted = self.stiffness * commands[:, :asked.dof]
        if arm.follows_speed:
            self.wanted = self.wanted + self.damping * commands[:, asked.dof:]
        self.tick, self.ticks = 0, len(commands)
        self.ends = {name: np.empty((self.ticks + 1, asked.dof)) for name in ("q", "dq", *asked.readings)}
        self.qs, self.dqs = self.ends["q"], self.ends["dq"]
        self.qs[0], self.dqs[0] = asked.q, asked.dq

    def begin(self, world):
        """Puts the arm where it is now."""
        world.put(self.qs[self.tick] - self.offset, self.dqs[self.tick])

    def advance(self, world):
        """A control period."""
        model, data, tick, dofs = world.model, world.data, self.tick, world.dofs
        q, dq = self.qs[tick], self.dqs[tick]
        tau = self.wanted[tick] - self.stiffness * q - self.damping * dq
        if self.arm.compensates:
            tau += self.arm.believed.bias(q, dq)
        np.clip(tau, -self.arm.limit, self.arm.limit, out=tau)
        if "tau_J_d" in self.ends:
            self.ends["tau_J_d"][tick + 1] = tau - self.arm.believed.gravity(q)
        tau = self.motors.torque(tau)
        world.torque[:] = tau - self.lost
        wants_torque, friction = "tau_J" in self.ends, 0.0
        if wants_torque:
            for _ in range(world.steps):
                mujoco.mj_step(model, data)
                friction = friction + world.friction()
        else:
            mujoco.mj_step(model, data, nstep=world.steps)
        self.tick = tick = tick + 1
        speed = world.speed
        self.qs[tick] = world.position - world.ahead * speed + self.offset
        self.dqs[tick] = speed
        if wants_torque:
            taken = model.dof_armature[dofs] * (speed - dq) / self.arm.period
            self.ends["tau_J"][tick] = tau - self.lost + friction / world.steps - taken
        if tick % 64 == 0 and not np.abs(q).max() < FLOWN:
            raise Impossible(f"the arm left all bounds after {tick * self.arm.period:.3f} s")

    def kept(self):
        """All that is needed to go on from here."""
        return self.tick, self.motors.past, self.qs[:self.tick + 1].copy(), self.dqs[:self.tick + 1].copy()

    def resume(self, kept):
        self.tick, self.motors.past, qs, dqs = kept
        self.qs[:self.tick + 1], self.dqs[:self.tick + 1] = qs, dqs

    def states(self, asked):
        if "tau_J" in self.ends:
            self.ends["tau_J"] += self.bias
        return between(self.ends, asked, self.arm.period)


class Believed:
    """The arm as the controller believes it to be."""

    def __init__(self, model, at, dofs):
        model.body_gravcomp[:] = 0.0
        self.model, self.data = model, mujoco.MjData(model)
        self.position, self.speed, self.out = self.data.qpos[at], self.data.qvel[dofs], np.zeros(model.nv)
        self.torque = self.out[dofs]

    def bias(self, q, dq):
        """Torques of gravity and of speed [N m]; until the next call."""
        model, data = self.model, self.data
        self.position[:], self.speed[:] = q, dq
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 0, self.out)
        return self.torque

    def gravity(self, q):
        return self.bias(q, 0.0)


class Motors:
    """What becomes of a torque on its way to the joints."""

    def __init__(self, effects, period):
        self.gain = np.asarray(effects.get("torque_gain", {}).get("gain", 1.0))
        self.limit = np.asarray(effects.get("torque_saturation", {}).get("limit", np.inf))
        ticks = round(effects.get("torque_delay", {}).get("delay", 0.0) / period * 1e6) * 1e-6
        self.whole, self.part, self.past = int(ticks), ticks - int(ticks), None

    def torque(self, tau):
        if self.whole or self.part:
            if self.past is None:
                self.past = [tau] * (self.whole + 2)
            self.past = [tau] + self.past[:self.whole + 1]
            tau = (1 - self.part) * self.past[self.whole] + self.part * self.past[self.whole + 1]
        return np.clip(self.gain * tau, -self.limit, self.limit)


def between(ends, asked, period):
    """States at the times that are asked for, between the ends of control periods: the cubic through both positions and
    velocities; torques hold over the period that ends there."""
    ticks, whole = asked.times / period, np.rint(asked.times / period)
    ticks = np.where(np.abs(ticks - whole) < 1e-6, whole, ticks)
    after = np.clip(np.ceil(ticks).astype(int), 0, len(ends["q"]) - 1)
    out = {name: ends[name][after] if name in ("q", "dq") else ends[name][np.maximum(after, 1)] for name in asked.readings}
    inside = np.flatnonzero(ticks != after)
    if inside.size:
        before = after[inside] - 1
        s = (ticks[inside] - before)[:, None]
        r = 1 - s
        (p, q), (u, v) = [[ends[name][rows] for rows in (before, after[inside])] for name in ("q", "dq")]
        u, v = u * period, v * period
        out["q"][inside] = r * r * (1 + 2 * s) * p + s * s * (1 + 2 * r) * q + r * s * (r * u - s * v)
        if "dq" in out:
            out["dq"][inside] = (6 * r * s * (q - p) + r * (r - 2 * s) * u + s * (s - 2 * r) * v) / period
    return np.stack([out[name] for name in asked.readings], axis=1)
