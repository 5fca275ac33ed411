"""What the policy sees: a cloud out of a depth picture, in the axes of the arm's base, or a small picture in colour. Metres, radians."""
import io
import tomllib

import numpy as np
from PIL import Image

# Of what a task file leaves out (docs/tasks.md).
COLUMNS, ROWS, FIELD = 320, 240, 0.8
# What of the cloud is kept, lowest and highest corner from the arm's base; the lower end leaves the table's surface out.
BOX = [[0.15, -0.55, 0.006], [1.0, 0.55, 0.5]]
# Of the points in a cube of this edge one is kept, so that a small thing nearby does not vanish among many points of a large one.
CUBE = 0.01
KEPT = 2048  # of a frame of a data set; a step of training draws its own among them
PICTURE = 96  # edge of a picture that is learned from


class Camera:
    """Where a camera of a task stands: `turn` and `place` bring a point of the camera (x right, y down, z forward) to the arm's base."""

    def __init__(self, columns, rows, focal, turn, place):
        self.columns, self.rows, self.focal = int(columns), int(rows), float(focal)
        self.turn, self.place = np.asarray(turn, float), np.asarray(place, float)
        across = (np.arange(self.columns) - 0.5 * (self.columns - 1)) / self.focal
        down = (np.arange(self.rows) - 0.5 * (self.rows - 1)) / self.focal
        rays = np.stack([*np.meshgrid(across, down), np.ones((self.rows, self.columns))], axis=-1)
        self.rays = (rays.reshape(-1, 3) @ self.turn.T).astype(np.float32)

    @classmethod
    def of_task(cls, path, name):
        """The camera `name` of a task file, or its first."""
        with open(path, "rb") as stream:
            task = tomllib.load(stream)
        cameras = {camera["name"]: camera for camera in task.get("camera", [])}
        name = name or next(iter(cameras), None)
        if name not in cameras:
            raise ValueError(f"{path} has no camera `{name}`; it has {', '.join(cameras) or 'none, so add a [[camera]] block'}")
        camera = cameras[name]
        place = np.array(camera["position"], float)
        forward = np.array(camera["look_at"], float) - place
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-6 else np.array([0.0, -1.0, 0.0])
        turn = np.stack([right, np.cross(forward, right), forward], axis=1)
        rows = camera.get("height", ROWS)
        focal = 0.5 * rows / np.tan(0.5 * camera.get("field_of_view", FIELD))
        base = np.array(task.get("arm", {}).get("base", [0.0, 0.0, 0.0]), float)
        return name, cls(camera.get("width", COLUMNS), rows, focal, turn, place - base)

    def kept(self):
        """What a checkpoint keeps of it."""
        return {"columns": self.columns, "rows": self.rows, "focal": self.focal, "turn": self.turn.tolist(), "place": self.place.tolist()}

    def cloud(self, depth, generator, most=KEPT):
        """At most `most` points [n, 3] float32 of a depth picture [rows, columns] in mm, inside of the box and evenly spread."""
        if depth.shape != (self.rows, self.columns):
            raise ValueError(f"a depth picture is {depth.shape[0]} x {depth.shape[1]}, the camera has {self.rows} x {self.columns} pixels")
        depth = depth.reshape(-1).astype(np.float32) * 1e-3
        # Most of a picture is table: what lies in the box is sought axis by axis, from above.
        there = np.flatnonzero(depth)
        for axis in (2, 0, 1):
            along = self.rays[there, axis] * depth[there] + np.float32(self.place[axis])
            there = there[(along > BOX[0][axis]) & (along < BOX[1][axis])]
        points = self.rays[there] * depth[there, None] + self.place.astype(np.float32)
        points = points[generator.permutation(len(points))]
        cube = np.floor(points / CUBE).astype(np.int64)
        _, first = np.unique(cube @ [1, 1 << 20, 1 << 40], return_index=True)
        return points[np.sort(first)[:most]]


def drawn(points, count, generator):
    """`count` points of a cloud, some of them again where there are fewer; zeros where there are none."""
    if len(points) == 0:
        return np.zeros((count, 3), np.float32)
    return points[generator.choice(len(points), count, replace=len(points) < count)]


def depth_of(png):
    """[rows, columns] mm out of a PNG of 16 bits."""
    return np.array(Image.open(io.BytesIO(png)), dtype=np.uint16)


def small(picture):
    """[PICTURE, PICTURE, 3] uint8 of a picture in colour: PNG bytes or [rows, columns, 3]."""
    image = Image.open(io.BytesIO(picture)) if isinstance(picture, bytes) else Image.fromarray(np.ascontiguousarray(picture))
    return np.array(image.convert("RGB").resize((PICTURE, PICTURE), Image.Resampling.BOX), dtype=np.uint8)
