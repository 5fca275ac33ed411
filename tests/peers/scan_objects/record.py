"""Scans of an object drawn by MuJoCo: pictures, masks, depth and poses, with the noise of a real camera or none. From above, as people
take them: the object on a table under a lamp whose shadow falls, nothing from below. Around: the object in the air, from all sides."""

import json
import os

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
import numpy as np
from PIL import Image
from scipy.ndimage import distance_transform_edt, gaussian_filter
from scipy.spatial.transform import Rotation

from scan_objects.shapes import paint, unfolded

WIDTH, HEIGHT, FOCAL = 640, 480, 600.0
HOLD_OUT = 8
# Rounds of a scan from above [degrees over the table]; the object's longest edge fills this share of the picture's width.
ROUNDS = (14.0, 36.0, 62.0)
FILLS = 0.5
# Group of the table, which is hidden where the mask is drawn.
TABLE = 3


def _obj(path, mesh):
    corners, normals, texture = unfolded(mesh)
    with open(path, "w") as out:
        for word, rows in (("v", corners), ("vn", normals), ("vt", texture)):
            for row in rows.reshape(-1, rows.shape[-1]):
                out.write(f"{word} " + " ".join(f"{value:.7f}" for value in row) + "\n")
        for face in range(len(corners)):
            out.write("f " + " ".join(f"{i}/{i}/{i}" for i in range(3 * face + 1, 3 * face + 4)) + "\n")


def _atlas(rng):
    """Six fields, three beside each other and two on top; a texture's origin is at its lower left."""
    rows = [np.concatenate([paint(rng, 512) for _ in range(3)], axis=1) for _ in range(2)]
    return np.concatenate(rows, axis=0)


def _lights(above):
    """Three fixed lights, of which the first is a lamp that casts shadows where there is a table."""
    return f"""<light directional="true" dir="-.4 .5 -1" diffuse=".45 .45 .45" specular="0 0 0" castshadow="{str(above).lower()}"/>
        <light directional="true" dir=".6 -.3 {'-.5' if above else '.5'}" diffuse=".3 .3 .3" specular="0 0 0" castshadow="false"/>
        <light directional="true" dir=".2 -.8 -.3" diffuse=".2 .2 .2" specular="0 0 0" castshadow="false"/>"""


def _table(height):
    """A printed board of 1 m whose top is so high."""
    return f"""<geom type="box" size=".5 .5 .01" pos="0 0 {height - 0.01}" group="{TABLE}" material="board"/>"""


def world(mesh, folder, rng, above):
    """The object under three fixed lights, nothing that shines; seen from above on a table."""
    os.makedirs(folder, exist_ok=True)
    _obj(f"{folder}/object.obj", mesh)
    Image.fromarray(_atlas(rng)).save(f"{folder}/paint.png")
    Image.fromarray(paint(rng, 1024)).save(f"{folder}/board.png")
    text = f"""<mujoco>
      <compiler meshdir="{folder}" texturedir="{folder}"/>
      <visual><headlight ambient=".35 .35 .35" diffuse="0 0 0" specular="0 0 0"/>
        <global offwidth="{WIDTH}" offheight="{HEIGHT}"/><quality offsamples="8" shadowsize="{4096 if above else 0}"/>
        <map znear="0.005" zfar="5"/></visual>
      {'<statistic extent="0.5" center="0 0 0"/>' if above else ""}
      <asset><mesh name="m" file="object.obj" inertia="shell"/>
        <texture name="t" type="2d" file="paint.png"/>
        <material name="p" texture="t" specular="0" shininess="0"/>
        <texture name="board" type="2d" file="board.png"/><material name="board" texture="board" specular="0" shininess="0"/>
        <texture type="skybox" builtin="flat" rgb1=".45 .5 .42" rgb2=".45 .5 .42" width="8" height="8"/></asset>
      <worldbody>
        {_lights(above)}
        {_table(mesh.bounds[0][2]) if above else ""}
        <body><geom type="mesh" mesh="m" material="p"/></body>
        <camera name="c" mode="fixed" resolution="{WIDTH} {HEIGHT}" focalpixel="{FOCAL} {FOCAL}"
          sensorsize="{WIDTH * 1e-5} {HEIGHT * 1e-5}"/>
      </worldbody></mujoco>"""
    return mujoco.MjModel.from_xml_string(text)


def _looking(at):
    """Camera to world (x right, y down, z forwards) of a camera at a place that looks at the origin."""
    forwards = -at / np.linalg.norm(at)
    right = np.cross(forwards, [0, 0, 1])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forwards, right), forwards], axis=1)
    pose[:3, 3] = at
    return pose


def around(mesh, count):
    """From all sides, the object filling two thirds of the picture."""
    away = max(0.30, FOCAL * np.linalg.norm(mesh.extents) / (0.85 * HEIGHT))
    for i in range(count):
        height = 0.95 - 1.75 * (i + 0.5) / count
        turn = i * 2.399963
        across = np.sqrt(1 - height * height)
        yield _looking(away * np.array([across * np.cos(turn), across * np.sin(turn), height]))


def from_above(mesh, count):
    """In rounds over the table, the object filling half of the picture, nothing from below."""
    away = FOCAL * mesh.extents.max() / (FILLS * WIDTH)
    for i in range(count):
        high = np.radians(ROUNDS[i * len(ROUNDS) // count])
        turn = 2 * np.pi * i * len(ROUNDS) / count + 0.3 * high
        yield _looking(away * np.array([np.cos(high) * np.cos(turn), np.cos(high) * np.sin(turn), np.sin(high)]))


def draw(model, pose, renderers):
    """Colour, depth [m] (0: nothing) and mask from a pose."""
    data = mujoco.MjData(model)
    # MuJoCo centres and turns a mesh by its inertia and keeps its place through the geom; a camera looks along -z.
    turn = Rotation.from_matrix(pose[:3, :3] @ np.diag([1, -1, -1])).as_quat()
    model.cam_pos[0], model.cam_quat[0] = pose[:3, 3], turn[[3, 0, 1, 2]]
    mujoco.mj_forward(model, data)
    colour, depth = renderers
    everything, alone = mujoco.MjvOption(), mujoco.MjvOption()
    everything.geomgroup[TABLE], alone.geomgroup[TABLE] = 1, 0
    # What shows nothing lies at the far plane, which is given in units of the model's extent.
    farthest = 0.95 * model.vis.map.zfar * model.stat.extent
    depth.update_scene(data, "c", scene_option=alone)
    mask = depth.render() < farthest
    depth.update_scene(data, "c", scene_option=everything)
    z = depth.render().astype(float)
    colour.update_scene(data, "c", scene_option=everything)
    return colour.render().copy(), np.where(z < farthest, z, 0.0), mask


def _wrong_mask(mask, rng, pixels):
    """A mask whose border wanders by `pixels` (one sigma), smoothly along it."""
    signed = distance_transform_edt(mask) - distance_transform_edt(~mask)
    wander = gaussian_filter(rng.standard_normal(mask.shape), 8)
    return signed + wander / wander.std() * pixels > 0


def _wrong_pose(pose, rng, metres, degrees):
    out = pose.copy()
    out[:3, 3] += rng.normal(0, metres, 3)
    out[:3, :3] = Rotation.from_rotvec(np.radians(rng.normal(0, degrees, 3))).as_matrix() @ pose[:3, :3]
    return out


def shots(mesh, folder, above, seed=1, views=60):
    """The object from above or from all sides, without any noise: colour, depth, mask and pose of each view."""
    model = world(mesh, folder, np.random.default_rng(seed), above)
    renderers = [mujoco.Renderer(model, HEIGHT, WIDTH) for _ in range(2)]
    renderers[1].enable_depth_rendering()
    drawn = [(*draw(model, pose, renderers), pose) for pose in (from_above if above else around)(mesh, views)]
    for renderer in renderers:
        renderer.close()
    return drawn


def record(drawn, folder, seed=1, noise=True, depth=True, table=None):
    """Writes transforms.json, images, masks, depth (PNG, mm); in truth/ the exact masks of the held-out views and all poses. `table`:
    height of the table, where the scan says it [m]."""
    rng = np.random.default_rng(seed)
    for part in ("images", "masks", "truth") + (("depth",) if depth else ()):
        os.makedirs(f"{folder}/{part}", exist_ok=True)
    frames = []
    for i, (rgb, z, mask, pose) in enumerate(drawn):
        name = f"{i:03}.png"
        seen, given = (_wrong_mask(mask, rng, 2.0), _wrong_pose(pose, rng, 5e-4, 0.1)) if noise else (mask, pose)
        Image.fromarray(rgb).save(f"{folder}/images/{name}")
        Image.fromarray((seen * 255).astype(np.uint8)).save(f"{folder}/masks/{name}")
        frame = {"file_path": f"images/{name}", "mask_path": f"masks/{name}"}
        if depth:
            unit = 1e-3 if noise else 1e-4
            measured = z + (rng.standard_normal(z.shape) * 0.005 * z * z if noise else 0)
            counts = np.where(z > 0, np.round(measured / unit), 0).astype(np.uint16)
            Image.fromarray(counts).save(f"{folder}/depth/{name}")
            frame["depth_file_path"] = f"depth/{name}"
        frame["transform_matrix"] = (given @ np.diag([1.0, -1, -1, 1])).tolist()
        frames.append(frame)
        if i % HOLD_OUT == HOLD_OUT // 2:
            Image.fromarray((mask * 255).astype(np.uint8)).save(f"{folder}/truth/mask_{name}")
    camera = {"fl_x": FOCAL, "fl_y": FOCAL, "cx": WIDTH / 2, "cy": HEIGHT / 2, "w": WIDTH, "h": HEIGHT}
    scan = {"camera_model": "PINHOLE", **camera, "frames": frames}
    if depth and not noise:
        scan["depth_unit_scale_factor"] = 1e-4
    if table is not None:
        scan["table"] = table
    with open(f"{folder}/transforms.json", "w") as out:
        json.dump(scan, out, indent=1)
    with open(f"{folder}/truth/poses.json", "w") as out:
        json.dump([pose.tolist() for *_, pose in drawn], out)
