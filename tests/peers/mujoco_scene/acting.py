"""A task with an arm in MuJoCo in which a policy acts: what it sees is what `calibration policy run` shows, its actions are those of
exported demonstrations."""
import mujoco
import numpy as np

from mujoco_cell import fr3

from . import model
from .franka import Arm, rotation, shapes, wxyz
from .run import Scene

ROW = 0.01  # [s] between looks at success
FAR = 5.0  # [m] beyond which depth is missing
# Of what a [[camera]] leaves out (docs/tasks.md).
COLUMNS, ROWS, FIELD = 320, 240, 0.8
BACKGROUND = [168 / 255, 186 / 255, 204 / 255]
FIXED = [196 / 255, 190 / 255, 180 / 255, 1]
COLOURS = [[214, 96, 77], [67, 147, 195], [90, 174, 97], [230, 160, 50], [153, 112, 171], [80, 80, 90], [200, 200, 80], [240, 240, 240]]


class Gripper:
    """Two boxes on geared slides: opening [m] against the first one's position."""

    def __init__(self, task):
        self.finger, fingers = None, {body["name"]: body for body in task["body"] if body.get("joint", {}).get("kind") == "prismatic"}
        for body in fingers.values():
            leader = fingers.get(body["joint"].get("follows", {}).get("body"))
            if leader is None or "drive" not in leader["joint"]:
                continue
            axis = np.array(leader["joint"]["axis"], float)
            ends = [[float(axis @ (np.array(one["position"]) + piece.get("position", [0, 0, 0])) + side * 0.5 * abs(axis) @ np.array(piece["size"]))
                     for piece in one["piece"] for side in (-1, 1)] for one in (leader, body)]
            faster = 1 - body["joint"]["follows"]["ratio"] * float(axis @ np.array(body["joint"]["axis"], float))
            ahead = min(ends[0]) > max(ends[1])
            self.opening = min(ends[0]) - max(ends[1]) if ahead else min(ends[1]) - max(ends[0])
            self.per_position = faster if ahead else -faster
            self.finger, self.limits = leader["name"], leader["joint"]["limits"]
            return

    def width(self, position):
        return max(0.0, self.opening + self.per_position * position)

    def position(self, width):
        return float(np.clip((width - self.opening) / self.per_position, *self.limits))


class Stage:
    """A task with what is hidden in it, compiled and drawn once for all its episodes."""

    def __init__(self, hidden, pictures=False, step=1e-3):
        self.hidden, self.step, self.pictures = hidden, step, pictures
        self.task = dict(hidden.task, motion=[])
        if "arm" not in self.task or not self.task.get("camera"):
            raise ValueError("the task has no [arm] or no [[camera]]; give one that has both")
        self.arm, self.gripper, self.camera = Arm(self.task["arm"]), Gripper(self.task), self.task["camera"][0]
        self.rows, self.columns = self.camera.get("height", ROWS), self.camera.get("width", COLUMNS)
        assets, links = shapes()
        place, at = np.array(self.camera["position"], float), np.array(self.camera["look_at"], float)
        right = np.cross(at - place, [0.0, 0.0, 1.0])
        up = np.cross(right, at - place)
        view = (f'<camera name="seen" pos="{model.numbers(place)}" xyaxes="{model.numbers([*right, *up])}" '
                f'fovy="{np.degrees(self.camera.get("field_of_view", FIELD))}"/><light dir="-0.55 -0.25 -0.8" directional="true" castshadow="false" diffuse="0.5 0.5 0.5"/>')
        sky = f'<texture type="skybox" builtin="flat" rgb1="{model.numbers(BACKGROUND)}" width="16" height="16"/>'
        seen = (f'<statistic extent="1"/><visual><global offwidth="{self.columns}" offheight="{self.rows}"/><map znear="0.01" zfar="10"/>'
                f'<headlight ambient="0.45 0.45 0.45" diffuse="0.25 0.25 0.25"/></visual><asset>{sky}{assets}</asset>')
        self.model = mujoco.MjModel.from_xml_string(model.mjcf(self.task, step, head=seen, more=view + links))
        for number, body in enumerate(self.task["body"]):
            fixed = body.get("hold") == "fixed"
            here = self.model.geom_bodyid == self.model.body(body["name"]).id
            self.model.geom_rgba[here] = FIXED if fixed else [*(np.array(COLOURS[number % len(COLOURS)]) / 255), 1]
        self.renderer = mujoco.Renderer(self.model, self.rows, self.columns)

    def names(self):
        """Of the numbers of a state and of the surroundings."""
        poses = lambda bodies: [f"{name}.{axis}" for name in bodies for axis in ("x", "y", "z", "qw", "qx", "qy", "qz")]
        free = [body["name"] for body in self.task["body"] if "joint" not in body and body.get("hold", "free") == "free"]
        passive = [body["name"] for body in self.task["body"] if "joint" in body and not {"drive", "follows"} & set(body["joint"])]
        state = poses([self.arm.body]) + ["gripper.width"] * (self.gripper.finger is not None) + [f"{joint}.pos" for joint in fr3.NAMES]
        return state, poses(free) + [f"{name}.joint" for name in passive]

    def starts(self, state, surroundings):
        """Where bodies begin, by the first numbers of a demonstration."""
        known = dict(zip(sum(self.names(), []), [*state, *surroundings]))
        found = []
        for body in self.task["body"]:
            name, joint = body["name"], body.get("joint", {})
            at = [known.get(f"{name}.{axis}") for axis in ("x", "y", "z", "qw", "qx", "qy", "qz")]
            if at[0] is None:
                at = [*body.get("position", [0.0, 0.0, 0.0]), *model.quaternion(body.get("rotation", [0.0, 0.0, 0.0]))]
            turned = known.get(f"{name}.joint", joint.get("start", 0.0))
            if self.gripper.finger and self.gripper.finger in (name, joint.get("follows", {}).get("body")):
                turned = self.gripper.position(known["gripper.width"])
            found.append({"name": name, "start": {"position": at[:3], "orientation_wxyz": at[3:], "joint": turned}})
        return found

    def begin(self, bodies, seed, q=None):
        """An episode: `bodies` as `twin task --json` says where they begin, `seed` of what scatters, joints where they are known."""
        return Acting(self, bodies, np.random.default_rng(seed), q)


class Acting(Scene):
    def __init__(self, stage, bodies, generator, q):
        super().__init__(stage.task, bodies, stage.step, compiled=stage.model)
        self.stage, self.generator, self.fault = stage, generator, None
        start = self.starts[stage.arm.body]
        self.q = stage.arm.reach(np.array(start["position"], float), rotation(start["orientation_wxyz"])) if q is None else np.array(q, float)
        late = max(1, round(stage.hidden.delay / self.step))
        self.sent, self.target = [self.q.copy()] * late, self.q.copy()
        self.closing = 1 - np.exp(-self.step / stage.hidden.lag)
        self.poses = [self.carried(self.q)] * 2
        self.signs, self.index, self.held, self.needed = {}, 0, 0, round(self.task.get("hold", 0.5) / ROW)
        if stage.gripper.finger:
            self.drives[stage.gripper.finger].order["target"] = self.starts[stage.gripper.finger]["joint"]

    def carried(self, q):
        place, turn = self.stage.arm.carried(q)
        return place, wxyz(turn)

    def pose_at(self, name, now):
        return self.poses[0 if now < (self.index + 0.5) * self.step else 1]

    @property
    def success(self):
        return self.held >= self.needed and self.fault is None

    @property
    def over(self):
        return self.success or self.fault is not None or self.index * self.step > self.task["horizon"] - 0.5 * self.step

    def act(self, action, seconds):
        """Goes for an action, in the order of a state, for so long; ends earlier where the episode does."""
        goal, stage = np.array(action[-fr3.DOF:], float), self.stage
        if not (np.isfinite(goal).all() and (goal > fr3.Q_MIN).all() and (goal < fr3.Q_MAX).all()):
            self.fault = "a joint is sent beyond its end"
            return
        if stage.gripper.finger:
            self.drives[stage.gripper.finger].order["target"] = stage.gripper.position(float(action[7]))
        began, steps, row = self.target, round(seconds / self.step), round(ROW / self.step)
        for step in range(1, steps + 1):
            self.target = began + (goal - began) * step / steps
            self.sent.append(self.target)
            most = fr3.SPEED * self.step
            self.q = self.q + np.clip(self.closing * (self.sent.pop(0) - self.q), -most, most)
            self.poses = [self.poses[1], self.carried(self.q)]
            self.advance(self.index)
            self.index += 1
            if self.index % row == 0:
                self.held = self.held + 1 if self.succeeds() else 0
                if self.over:
                    return

    def numbers(self):
        """State and surroundings [n] float32 each: encoders scatter, the carried body is where they have it."""
        q = self.q + self.stage.hidden.encoder * self.generator.standard_normal(fr3.DOF)
        state, around = [], []
        self.put_pose(state, self.stage.arm.body, *self.carried(q))
        if self.stage.gripper.finger:
            state.append(self.stage.gripper.width(self.joint(self.stage.gripper.finger)))
        for name in self.stage.names()[1]:
            body, kind = name.rsplit(".", 1)
            if kind == "joint":
                around.append(self.joint(body))
            elif kind == "x":
                self.put_pose(around, body, *self.place(body))
        return np.array([*state, *q], np.float32), np.array(around, np.float32)

    def put_pose(self, into, name, place, turn):
        """Of the two quaternions of a rotation the one nearer to the last, at first that with a positive w."""
        turn = -turn if turn @ self.signs.get(name, np.array([1.0, 0, 0, 0])) < 0 else turn
        self.signs[name] = turn
        into += [*place, *turn]

    def seen(self):
        """Depth [rows, columns] uint16 in mm as the sensor has it, and a picture [rows, columns, 3] where they are wanted."""
        for number, frame in enumerate([self.stage.arm.base, *self.stage.arm.links(self.q)]):
            at = self.model.body(f"fr3_link{number}").mocapid[0]
            self.data.mocap_pos[at], self.data.mocap_quat[at] = frame[:3, 3], wxyz(frame[:3, :3])
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)
        renderer, hidden = self.stage.renderer, self.stage.hidden
        renderer.update_scene(self.data, "seen")
        picture = renderer.render().copy() if self.stage.pictures else None
        renderer.enable_depth_rendering()
        depth = renderer.render().astype(np.float64)
        renderer.disable_depth_rendering()
        there = (depth < FAR) & (self.generator.random(depth.shape) > hidden.holes)
        depth += hidden.depth * depth ** 2 * self.generator.standard_normal(depth.shape)
        return np.where(there, np.round(1000 * depth), 0).astype(np.uint16), picture

    def observation(self):
        """As a message to a policy."""
        (state, around), (depth, picture), camera = self.numbers(), self.seen(), self.stage.camera["name"]
        message = {"observation/state": state, "observation/environment_state": around, "observation/joint_position": state[-fr3.DOF:],
                   f"observation/depth/{camera}": depth, "prompt": self.task.get("instruction", "")}
        if picture is not None:
            message[f"observation/image/{camera}"] = picture
        if self.stage.gripper.finger:
            message["observation/gripper_width"] = state[7:8]
        return message
