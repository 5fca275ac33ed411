"""An FR3 that carries a body: where its links are, which joints bring the body to a pose, and its shapes in MJCF."""
import glob
import json
import os
import struct

import numpy as np

from mujoco_cell import fr3

from .model import numbers, quaternion

READY = np.array([0.0, -np.pi / 4, 0.0, -3 * np.pi / 4, 0.0, np.pi / 2, np.pi / 4])
SHAPES = os.path.join(os.environ.get("CARGO_HOME", os.path.expanduser("~/.cargo")), "registry/src/*/franka-description-*/meshes/fr3")


def rotation(wxyz):
    w, x, y, z = np.asarray(wxyz) / np.linalg.norm(wxyz)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def wxyz(turn):
    """Of the four ways to divide, the one by the largest number."""
    trace = np.array([turn.trace(), *turn.diagonal()])
    largest = int(np.argmax(trace))
    if largest == 0:
        w = np.array([1 + trace[0], turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    else:
        i, j, k = largest - 1, largest % 3, (largest + 1) % 3
        w = np.empty(4)
        w[0], w[1 + i] = turn[k, j] - turn[j, k], 1 + turn[i, i] - turn[j, j] - turn[k, k]
        w[1 + j], w[1 + k] = turn[j, i] + turn[i, j], turn[k, i] + turn[i, k]
    return w / np.linalg.norm(w)


def transformation(turn, place):
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = turn, place
    return whole


class Arm:
    """The `[arm]` of a task."""

    def __init__(self, entry):
        self.body = entry["body"]
        self.base = transformation(np.eye(3), entry.get("base", [0.0, 0.0, 0.0]))
        turn = rotation(quaternion(entry.get("rotation", [0.0, 0.0, 0.0])))
        self.flange_from_body = transformation(turn, np.array(entry.get("position", [0.0, 0.0, 0.0]), float))
        self.steps = [transformation(rotation([np.cos(alpha / 2), np.sin(alpha / 2), 0, 0]), [a, -np.sin(alpha) * d, np.cos(alpha) * d])
                      for a, d, alpha in fr3.GEOMETRY]
        self.end = transformation(np.eye(3), [0.0, 0.0, fr3.FLANGE]) @ self.flange_from_body

    def links(self, q):
        """Frames of the seven links in the world."""
        frames, at = [], self.base
        for step, angle in zip(self.steps, q):
            c, s = np.cos(angle), np.sin(angle)
            at = at @ step
            at[:, :2] = at[:, :2] @ np.array([[c, -s], [s, c]])
            frames.append(at)
        return frames

    def carried(self, q):
        """Place and rotation matrix of the body that it carries."""
        at = self.links(q)[-1] @ self.end
        return at[:3, 3], at[:3, :3]

    def reach(self, place, turn, q=READY):
        """Joints with which the carried body is there: Gauss and Newton's steps with the smallest motion of the joints."""
        q = np.array(q)
        for _ in range(200):
            frames = self.links(q)
            at = frames[-1] @ self.end
            w, *axis = wxyz(turn @ at[:3, :3].T)
            sine = np.linalg.norm(axis)
            angle = 2 * np.arctan2(sine, abs(w)) * np.sign(w)
            error = np.concatenate([place - at[:3, 3], np.array(axis) * (angle / sine if sine > 1e-12 else 2.0)])
            if np.abs(error).max() < 1e-10:
                return q
            jacobian = np.array([[*np.cross(frame[:3, 2], at[:3, 3] - frame[:3, 3]), *frame[:3, 2]] for frame in frames]).T
            step = np.linalg.pinv(jacobian, rcond=1e-6) @ error
            q += step * min(1.0, 0.2 / np.abs(step).max())
        raise ValueError(f"the arm does not reach {place}")


def triangles(path):
    """Points and triangles of each mesh of a binary glTF file."""
    with open(path, "rb") as stream:
        data = stream.read()
    size = struct.unpack("<I", data[12:16])[0]
    head, data = json.loads(data[20:20 + size]), data[28 + size:]

    def elements(number, element, width):
        accessor = head["accessors"][number]
        view = head["bufferViews"][accessor["bufferView"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        return np.frombuffer(data, element, accessor["count"] * width, start).reshape(-1, width)

    for mesh in head["meshes"]:
        for part in mesh["primitives"]:
            kind = {5123: "<u2", 5125: "<u4"}[head["accessors"][part["indices"]]["componentType"]]
            colour = head["materials"][part["material"]].get("pbrMetallicRoughness", {}).get("baseColorFactor") if "material" in part else None
            yield elements(part["attributes"]["POSITION"], "<f4", 3), elements(part["indices"], kind, 1).reshape(-1, 3), colour or [0.8, 0.8, 0.8, 1.0]


def shapes():
    """Assets and bodies of MJCF: the maker's shapes, which touch nothing; each link is a body `fr3_linkN` that is put where it is."""
    folders = sorted(glob.glob(SHAPES))
    if not folders:
        raise ValueError("the arm's shapes are not there; `cargo fetch` brings the crate franka-description")
    assets, bodies = [], []
    for link in range(fr3.DOF + 1):
        inside = []
        for number, (points, faces, colour) in enumerate(triangles(os.path.join(folders[-1], f"link{link}.glb"))):
            name = f"fr3_{link}_{number}"
            assets.append(f'<mesh name="{name}" inertia="shell" vertex="{numbers(points.ravel())}" face="{" ".join(map(str, faces.ravel()))}"/>')
            inside.append(f'<geom type="mesh" mesh="{name}" contype="0" conaffinity="0" mass="0" rgba="{numbers(colour)}"/>')
        bodies.append(f'<body name="fr3_link{link}" mocap="true">{"".join(inside)}</body>')
    return "".join(assets), "".join(bodies)
