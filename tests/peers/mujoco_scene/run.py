"""One episode of a task in MuJoCo, with the starts and the commands of the twin."""
import time

import mujoco
import numpy as np

from . import model
from .drive import Drive


class Scene:
    """A task in MuJoCo, begun where the twin began: `bodies` of its answer. `noise`: one sigma of what `generator` adds to each way point
    along each axis, m; where a body waits, it waits in one place. `compiled`: its model, where that is there already."""

    def __init__(self, task, bodies, step=1e-3, noise=0.0, generator=None, compiled=None):
        self.task, self.step = task, step
        self.model = compiled or mujoco.MjModel.from_xml_string(model.mjcf(task, step))
        self.data = mujoco.MjData(self.model)
        self.starts = {body["name"]: body["start"] for body in bodies}
        for body in task["body"]:
            start = self.starts[body["name"]]
            if "joint" in body:
                self.data.qpos[self.model.joint(body["name"]).qposadr[0]] = start["joint"]
            elif body.get("hold", "free") != "fixed":
                self.put(body["name"], start["position"], start["orientation_wxyz"], np.zeros(3), np.zeros(3))
            else:
                self.model.body(body["name"]).pos[:] = start["position"]
                self.model.body(body["name"]).quat[:] = start["orientation_wxyz"]
        mujoco.mj_forward(self.model, self.data)
        self.ways = {}
        for entry in sorted(task.get("motion", []), key=lambda entry: entry["time"]):
            if "position" in entry:
                self.ways.setdefault(entry["body"], []).append((entry["time"], *self.waypoint(entry)))
        if noise > 0:
            for way in self.ways.values():
                nominal = [place for _, place, _ in way]
                for i, (time_, place, turn) in enumerate(way):
                    waits = i > 0 and np.array_equal(place, nominal[i - 1]) and np.array_equal(turn, way[i - 1][2])
                    way[i] = time_, way[i - 1][1] if waits else place + noise * generator.standard_normal(3), turn
        self.drives = {body["name"]: Drive(self.model, body["name"], body["joint"]["drive"]) for body in task["body"] if "drive" in body.get("joint", {})}
        self.seconds = 0.0

    def waypoint(self, entry):
        turn = np.array(model.quaternion(entry.get("rotation", [0, 0, 0])))
        place = np.array(entry["position"], float)
        if "relative_to" in entry:
            start = self.starts[entry["relative_to"]]
            nominal = next(b for b in self.task["body"] if b["name"] == entry["relative_to"]).get("rotation", [0, 0, 0])
            back, drawn, moved = np.zeros(4), np.zeros(4), np.zeros(3)
            mujoco.mju_negQuat(back, np.array(model.quaternion(nominal)))
            mujoco.mju_mulQuat(drawn, np.array(start["orientation_wxyz"]), back)
            mujoco.mju_rotVecQuat(moved, place, drawn)
            place = np.array(start["position"]) + moved
            whole = np.zeros(4)
            mujoco.mju_mulQuat(whole, drawn, turn)
            turn = whole
        return place, turn

    def put(self, name, place, turn, velocity, spin):
        joint = self.model.joint(name)
        at, speed = joint.qposadr[0], joint.dofadr[0]
        self.data.qpos[at:at + 3], self.data.qpos[at + 3:at + 7] = place, turn
        back, local = np.zeros(4), np.zeros(3)
        mujoco.mju_negQuat(back, np.array(turn, float))
        mujoco.mju_rotVecQuat(local, np.array(spin, float), back)
        self.data.qvel[speed:speed + 3], self.data.qvel[speed + 3:speed + 6] = velocity, local

    def pose_at(self, name, now):
        """Where a moved body is by its waypoints."""
        start = self.starts[name]
        since, place, turn = 0.0, np.array(start["position"]), np.array(start["orientation_wxyz"])
        for time_, to, rotation in self.ways.get(name, []):
            if now < time_:
                share = (now - since) / (time_ - since)
                share = share ** 3 * (10 - 15 * share + 6 * share * share)
                between = np.zeros(3)
                mujoco.mju_subQuat(between, rotation, turn)
                result = turn.copy()
                mujoco.mju_quatIntegrate(result, between, share)
                return place + share * (to - place), result
            since, place, turn = time_, to, rotation
        return place, turn

    def advance(self, index):
        now, step = index * self.step, self.step
        for body in self.task["body"]:
            if body.get("hold") == "moved":
                (place, turn), (then, turned) = self.pose_at(body["name"], now), self.pose_at(body["name"], now + step)
                spin, world = np.zeros(3), np.zeros(3)
                mujoco.mju_subQuat(spin, turned, turn)
                mujoco.mju_rotVecQuat(world, spin, turn)
                self.put(body["name"], place, turn, (then - place) / step, world / step)
        for entry in self.task.get("motion", []):
            if "target" in entry and round(entry["time"] / step) == index:
                self.drives[entry["body"]].order.update({key: entry[key] for key in ("target", "force") if key in entry})
        for drive in self.drives.values():
            self.data.ctrl[drive.actuator] = drive.force(self.data)
        begun = time.process_time()
        mujoco.mj_step(self.model, self.data)
        self.seconds += time.process_time() - begun

    def place(self, name):
        body = self.data.body(name)
        return body.xpos.copy(), body.xquat.copy()

    def joint(self, name):
        return float(self.data.qpos[self.model.joint(name).qposadr[0]])

    def touching(self):
        names = lambda contact: frozenset(self.model.body(self.model.geom_bodyid[g]).name for g in (contact.geom1, contact.geom2))
        return {names(contact) for contact in self.data.contact if contact.efc_address >= 0 and contact.dist < 0}

    def succeeds(self):
        """Whether all conditions of the task hold now."""
        touching = self.touching()
        return all(self.holds(entry, touching) for entry in self.task["success"])

    def holds(self, entry, touching):
        if "touching" in entry:
            return frozenset(entry["touching"]) in touching
        if "apart" in entry:
            return frozenset(entry["apart"]) not in touching
        if "joint" in entry:
            return entry["between"][0] <= self.joint(entry["joint"]) <= entry["between"][1]
        place, turn = self.place(entry["body"])
        up = np.zeros(3)
        mujoco.mju_rotVecQuat(up, np.array([0.0, 0.0, 1.0]), turn)
        if "of" in entry:
            origin, other = self.place(entry["of"])
            back, local = np.zeros(4), np.zeros(3)
            mujoco.mju_negQuat(back, other)
            mujoco.mju_rotVecQuat(local, place - origin, back)
            place = local
        inside = all(low <= x <= high for low, x, high in zip(entry["low"], place, entry["high"]))
        return inside and np.arccos(np.clip(up[2], -1, 1)) <= entry.get("tilt", np.pi)
