"""Scenes drawn by MuJoCo: the corner of a room with a table and things on it, and how far a reconstruction is from it."""

import glob
import json
import os

import mujoco
import numpy as np
from PIL import Image
from scipy.ndimage import binary_erosion

from scan_objects.record import FOCAL, HEIGHT, WIDTH, draw, record
from scan_objects.shapes import paint

TABLE = 0.74
WALL_X, WALL_Y = 1.1, 1.0
FARTHEST = 4.0
# Errors beyond count as this [m]: a view past an edge sees another surface.
CLIP = 0.05
# Pixels at the edge of a wall that may show what stands before it: three standard deviations of a pose, and the width of a splat.
RIM = 5


def _textures(folder, rng):
    for name in ("floor", "table", "wall", "things"):
        Image.fromarray(paint(rng, 512)).save(f"{folder}/{name}.png")


def world(folder, rng):
    """Floor, two walls, a table on four legs, three boxes and a can on it; fixed lights, nothing that shines."""
    os.makedirs(folder, exist_ok=True)
    _textures(folder, rng)
    assets = "".join(
        f'<texture name="{n}" type="2d" file="{n}.png"/>'
        f'<material name="{n}" texture="{n}" texuniform="true" texrepeat="{r} {r}" specular="0" shininess="0"/>'
        for n, r in (("floor", 1), ("table", 2), ("wall", 1), ("things", 6))
    )
    legs = "".join(
        f'<geom type="box" size=".03 .03 {(TABLE - 0.04) / 2}" pos="{x} {y} {(TABLE - 0.04) / 2}" material="wall"/>'
        for x in (-0.5, 0.5) for y in (-0.3, 0.3)
    )
    text = f"""<mujoco>
      <compiler texturedir="{folder}"/><statistic extent="1" center="0 0 0.7"/>
      <visual><headlight ambient=".35 .35 .35" diffuse="0 0 0" specular="0 0 0"/>
        <global offwidth="{WIDTH}" offheight="{HEIGHT}"/><quality offsamples="8" shadowsize="0"/>
        <map znear="0.02" zfar="6"/></visual>
      <asset>{assets}<texture type="skybox" builtin="flat" rgb1=".45 .5 .42" rgb2=".45 .5 .42" width="8" height="8"/></asset>
      <worldbody>
        <light directional="true" dir="-.4 .5 -1" diffuse=".45 .45 .45" specular="0 0 0" castshadow="false"/>
        <light directional="true" dir=".6 .5 -.3" diffuse=".3 .3 .3" specular="0 0 0" castshadow="false"/>
        <geom type="box" size="2 2 .05" pos="0 0 -.05" material="floor"/>
        <geom type="box" size=".05 2 1.2" pos="{WALL_X + 0.05} 0 1.2" material="wall"/>
        <geom type="box" size="2 .05 1.2" pos="0 {WALL_Y + 0.05} 1.2" material="wall"/>
        <geom type="box" size=".6 .4 .02" pos="0 0 {TABLE - 0.02}" material="table"/>{legs}
        <geom type="box" size=".05 .08 .06" pos=".15 -.05 {TABLE + 0.06}" euler="0 0 30" material="things"/>
        <geom type="box" size=".06 .06 .06" pos="-.2 .12 {TABLE + 0.06}" material="things"/>
        <geom type="box" size=".10 .03 .02" pos="-.1 -.18 {TABLE + 0.02}" euler="0 0 -20" material="things"/>
        <geom type="cylinder" size=".035 .055" pos=".3 .18 {TABLE + 0.055}" material="things"/>
        <camera name="c" mode="fixed" resolution="{WIDTH} {HEIGHT}" focalpixel="{FOCAL} {FOCAL}"
          sensorsize="{WIDTH * 1e-5} {HEIGHT * 1e-5}"/>
      </worldbody></mujoco>"""
    return mujoco.MjModel.from_xml_string(text)


def cameras(count, rng):
    """Camera to world (x right, y down, z forwards), on the open side: two of three look at the table, one into the corner."""
    for i in range(count):
        turn = np.radians(-170 + 130 * ((i * 0.618034) % 1))
        at = np.array([0.95 * np.cos(turn), 0.95 * np.sin(turn), TABLE + rng.uniform(0.35, 0.85)])
        far = i % 3 == 2
        towards = np.array([WALL_X, WALL_Y, 0.9]) * (0.6 if far else 0.0) + [0, 0, TABLE * (0.3 if far else 1.0)]
        forwards = towards + rng.uniform(-0.15, 0.15, 3) - at
        forwards /= np.linalg.norm(forwards)
        right = np.cross(forwards, [0, 0, 1])
        right /= np.linalg.norm(right)
        pose = np.eye(4)
        pose[:3, :3] = np.stack([right, np.cross(forwards, right), forwards], axis=1)
        pose[:3, 3] = at
        yield pose


def scan(folder, views, seed=1, depth=True):
    """A scan with the noise of a real camera, with depth or without; in truth/ the depth of the held-out views and all poses."""
    rng = np.random.default_rng(seed)
    model = world(os.path.abspath(f"{folder}_world"), rng)
    renderers = [mujoco.Renderer(model, HEIGHT, WIDTH) for _ in range(2)]
    renderers[1].enable_depth_rendering()
    drawn = [(*draw(model, pose, renderers), pose) for pose in cameras(views, rng)]
    record(drawn, folder, seed=seed, depth=depth)
    for i, (_, z, _, _) in enumerate(drawn):
        if i % 8 == 4:
            np.save(f"{folder}/truth/depth_{i:03}.npy", z.astype(np.float32))


def held_out(folder):
    """Name, true pose and true depth of each held-out view."""
    with open(f"{folder}/truth/poses.json") as text:
        poses = json.load(text)
    for path in sorted(glob.glob(f"{folder}/truth/depth_*.npy")):
        name = path[-7:-4]
        yield name, np.array(poses[int(name)]), np.load(path)


def shares_within(mesh, folder, share):
    """Of the true depth of the held-out views, the share at which a mesh is off by at most this share of the distance."""
    within, all_of_it = 0, 0
    for _, pose, truth in held_out(folder):
        known = (truth > 0) & (truth < FARTHEST)
        depth = seen_depth(*mesh, pose)
        within += (np.abs(depth - truth) <= share * truth)[known].sum()
        all_of_it += known.sum()
    return within / all_of_it


def directions():
    x = (np.arange(WIDTH) + 0.5 - WIDTH / 2) / FOCAL
    y = (np.arange(HEIGHT) + 0.5 - HEIGHT / 2) / FOCAL
    return np.stack([*np.meshgrid(x, y), np.ones((HEIGHT, WIDTH))], axis=-1)


def seen_depth(vertices, triangles, pose):
    """Depth of a mesh from a pose [m], 0: nothing."""
    import open3d as o3d

    caster = o3d.t.geometry.RaycastingScene()
    caster.add_triangles(vertices.astype(np.float32), triangles.astype(np.uint32))
    rays = np.concatenate([np.broadcast_to(pose[:3, 3], (HEIGHT, WIDTH, 3)), directions() @ pose[:3, :3].T], axis=-1)
    hit = caster.cast_rays(rays.astype(np.float32))["t_hit"].numpy()
    return np.where(np.isfinite(hit), hit, 0.0)


def depth_errors(meshes, folder):
    """Mean error [mm] of each mesh where all of them have a surface, and which share of the true one each has."""
    errors, shares = [[] for _ in meshes], [[] for _ in meshes]
    for _, pose, truth in held_out(folder):
        known = (truth > 0) & (truth < FARTHEST)
        depths = [seen_depth(*mesh, pose) for mesh in meshes]
        common = known & np.all([depth > 0 for depth in depths], axis=0)
        for error, share, depth in zip(errors, shares, depths):
            error.append(np.minimum(np.abs(depth - truth)[common], CLIP))
            share.append((depth > 0)[known].mean())
    return [1e3 * float(np.concatenate(e).mean()) for e in errors], [float(np.mean(s)) for s in shares]


def roughness(folder, out):
    """How far the splats' depth of the walls is off a plane, root mean square of each view's pixels [mm], mean over views. Not at
    their edges: a pose that is a pixel off shows there what stands before the wall."""
    rough = []
    for name, pose, truth in held_out(folder):
        depth = np.asarray(Image.open(f"{out}/held_out/images_{name}_depth.png")).astype(float) * 1e-4
        point = (directions() * truth[..., None]) @ pose[:3, :3].T + pose[:3, 3]
        drawn = (directions() * depth[..., None]) @ pose[:3, :3].T + pose[:3, 3]
        for axis, at in ((0, WALL_X), (1, WALL_Y)):
            wall = (truth > 0) & (np.abs(point[..., axis] - at) < 2e-3) & (point[..., 2] > 0.1)
            on = binary_erosion(wall, iterations=RIM) & (depth > 0)
            if on.sum() < 5000:
                continue
            off = drawn[on][:, axis] - at
            others = np.delete(point[on], axis, axis=1)
            plane = np.column_stack([others, np.ones(len(others))])
            off = off - plane @ np.linalg.lstsq(plane, off, rcond=None)[0]
            rough.append(np.sqrt(np.mean(np.minimum(np.abs(off), CLIP) ** 2)))
    return 1e3 * float(np.mean(rough)) if rough else None
