"""Scans of known objects and of a room, drawn by MuJoCo, through `twin reconstruct object` and `scene`: how far meshes and pictures are
from the truth, beside Open3D's fusion (of objects with screened Poisson reconstruction) of the same pictures.

    python3 -m venv scan_venv
    scan_venv/bin/pip install mujoco==4.0.0 numpy==2.4.6 scipy trimesh==5.2.0 manifold3d==3.5.4 pillow open3d==0.20.0
    scan_venv/bin/python tests/peers/scan.py --program target/release/twin --out scans --objects box mug
    scan_venv/bin/python tests/peers/scan.py --program target/release/twin --out scans --kinds depth masks exact
    scan_venv/bin/python tests/peers/scan.py --program target/release/twin --out scans --rooms 1 --views 60
    scan_venv/bin/python tests/peers/scan.py --program target/release/twin --out scans --rooms 1 --views 48 --colour-only

MUJOCO_GL=osmesa draws where there is no EGL. Scans are from above a table, as people take them, but for the kinds depth, masks and exact, in
which the object floats and is seen from all sides.

Licences: mujoco and scipy Apache-2.0 and BSD, trimesh and open3d MIT, manifold3d Apache-2.0, pillow MIT-CMU.
"""

import argparse
import glob
import json
import os
import subprocess
import time

import numpy as np
import trimesh
from PIL import Image
from scipy.ndimage import binary_erosion

from scan_objects import shapes

SAMPLES = 60_000
# Pixels of the object's rim that show what is behind it.
RIM = 3
# A corner farther from the truth is wrong [m]; the colour of what is not known.
WRONG, GREY = 2e-3, 128
# Depth of a room is counted that is off by at most this share of the distance.
WITHIN = 0.01
KINDS = {
    "above": {"noise": True, "depth": True, "above": True},
    "above_masks": {"noise": True, "depth": False, "above": True},
    "above_table": {"noise": True, "depth": False, "above": True, "table": True},
    "depth": {"noise": True, "depth": True},
    "masks": {"noise": True, "depth": False},
    "exact": {"noise": False, "depth": True},
}


def distances(points, mesh):
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32))
    return scene.compute_distance(points.astype(np.float32)).numpy()


def chamfer(mesh, truth):
    """Mean of the two mean distances [mm]."""
    ours, theirs = (trimesh.sample.sample_surface(m, SAMPLES, seed=1)[0] for m in (mesh, truth))
    return float(500.0 * (distances(ours, truth).mean() + distances(theirs, mesh).mean()))


def measured(mesh, truth):
    closed = bool(mesh.is_watertight and mesh.is_winding_consistent)
    return {
        "chamfer_mm": chamfer(mesh, truth),
        "volume": float(mesh.volume / truth.volume - 1) if closed else None,
        "closed": closed,
        "genus": int(1 - mesh.euler_number // 2) if closed and mesh.body_count == 1 else None,
    }


def marks(out, origin, truth):
    """Of the corners that are more than WRONG off the truth, and of the others, which share is grey, so not known; and the first's share."""
    mesh = trimesh.load(f"{out}/object.ply", process=False)
    off = distances(mesh.vertices + origin, truth)
    grey = (np.asarray(mesh.visual.vertex_colors)[:, :3] == GREY).all(axis=1)
    wrong = off > WRONG
    return [float(of.mean()) if of.size else 0.0 for of in (grey[wrong], grey[~wrong], wrong)]


def psnr(folder, out, of=""):
    """Of the held-out views, drawn from the field or of splats, inside the true mask [dB]: mean over views."""
    values = []
    for mask in sorted(glob.glob(f"{folder}/truth/mask_*.png")):
        name = os.path.basename(mask).removeprefix("mask_")
        drawn = f"{out}/held_out/images_{name.removesuffix('.png')}{of}.png"
        mask = np.asarray(Image.open(f"{folder}/truth/mask_{name}")) > 0
        mask = binary_erosion(mask, iterations=RIM)
        truth, ours = (np.asarray(Image.open(p).convert("RGB")).astype(float) for p in (f"{folder}/images/{name}", drawn))
        values.append(-10 * np.log10(((truth - ours)[mask] ** 2).mean() / 255**2))
    return float(np.mean(values))


def open3d_fused(folder, voxel, farthest, masked):
    """The same views fused by Open3D."""
    import open3d as o3d

    core = o3d.core
    with open(f"{folder}/transforms.json") as text:
        scan = json.load(text)
    camera = core.Tensor(np.array([[scan["fl_x"], 0, scan["cx"] - 0.5], [0, scan["fl_y"], scan["cy"] - 0.5], [0, 0, 1.0]]))
    volume = o3d.t.geometry.VoxelBlockGrid(
        attr_names=("tsdf", "weight"), attr_dtypes=(core.float32, core.float32), attr_channels=((1), (1)),
        voxel_size=voxel, block_resolution=16, block_count=40_000,
    )
    unit = scan.get("depth_unit_scale_factor", 1e-3)
    for number, frame in enumerate(scan["frames"]):
        if number % 8 == 4:
            continue
        mask = np.asarray(Image.open(f"{folder}/{frame['mask_path']}")) > 127 if masked else 1
        depth = np.asarray(Image.open(f"{folder}/{frame['depth_file_path']}")).astype(np.float32) * unit * mask
        depth = o3d.t.geometry.Image(np.ascontiguousarray(depth.astype(np.float32)))
        pose = np.array(frame["transform_matrix"]) @ np.diag([1.0, -1, -1, 1])
        seen = (depth, camera, core.Tensor(np.linalg.inv(pose)), 1.0, farthest, 4.0)
        volume.integrate(volume.compute_unique_block_coordinates(*seen), *seen)
    return volume.extract_triangle_mesh(weight_threshold=3.0).to_legacy()


def open3d_mesh(folder, voxel=0.001):
    """The same views fused and closed by Open3D: TSDF, then screened Poisson, its largest part."""
    import open3d as o3d

    surface = open3d_fused(folder, voxel, 3.0, masked=True)
    surface.compute_vertex_normals()
    cloud = o3d.geometry.PointCloud(surface.vertices)
    cloud.normals = surface.vertex_normals
    mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=8)
    mesh = trimesh.Trimesh(np.asarray(mesh.vertices), np.asarray(mesh.triangles))
    parts = mesh.split(only_watertight=False)
    return max(parts, key=lambda part: len(part.faces)) if len(parts) else mesh


def reconstruct(program, folder, out, kind, grid):
    command = [program, "reconstruct", "object", folder, "--out", out, "--json", "--force", "--grid", str(grid)]
    command += ["--scale", "1"] if not KINDS[kind]["depth"] else []
    begun = os.times()
    ended = subprocess.run(command, capture_output=True, text=True)
    if ended.returncode:
        return {"error": ended.stderr.strip().splitlines()[-1:]}
    after = os.times()
    answer = json.loads(ended.stdout)
    used = after.children_user + after.children_system - begun.children_user - begun.children_system
    return {**answer, "seconds": after.elapsed - begun.elapsed, "cpu_seconds": used}


def judged(args, name, truth, kind):
    folder, out = f"{args.out}/{name}_{kind}", f"{args.out}/{name}_{kind}_object"
    answer = reconstruct(args.program, folder, out, kind, args.grid)
    if "error" in answer:
        return answer
    row = {key: answer[key] for key in ("psnr_db", "seconds", "cpu_seconds", "cameras_moved_m", "voxel_m", "remarks")}
    for which in ("object_fine", "object"):
        mesh = trimesh.load(f"{out}/{which}.obj", process=False)
        mesh.apply_translation(answer["origin_in_scan_m"])
        row[which] = measured(mesh, truth)
    row["marks"] = marks(out, answer["origin_in_scan_m"], truth)
    row["true_mask_psnr_db"] = psnr(folder, out)
    row["true_mask_splats_db"] = psnr(folder, out, "_splats")
    row["pieces_volume"] = answer["pieces_volume_m3"] / answer["volume_m3"] - 1
    if KINDS[kind]["depth"]:
        row["open3d"] = measured(open3d_mesh(folder), truth)
    return row


def line(name, kind, row):
    if "error" in row:
        return f"| {name} | {kind} | {row['error']} |"
    fine, peer = row["object_fine"], row.get("open3d", {})
    volume = f"{100 * fine['volume']:+.1f} %" if fine["volume"] is not None else "open"
    other = f"{peer['chamfer_mm']:.2f}" if peer else "-"
    return (
        f"| {name} | {kind} | {1e3 * row['voxel_m']:.2f} | {fine['chamfer_mm']:.2f} | {other} | {volume} | {fine['genus']} of {shapes.GENUS[name]} "
        f"| {100 * row['marks'][2]:.0f} %, {100 * row['marks'][0]:.0f} % and {100 * row['marks'][1]:.0f} % "
        f"| {row['true_mask_psnr_db']:.1f} | {row['true_mask_splats_db']:.1f} | {row['seconds']:.0f} ({row['cpu_seconds']:.0f} CPU) |"
    )


def room(args, seed):
    """A room through `twin reconstruct scene`, with and without the terms for planes."""
    from scan_objects import rooms

    folder = f"{args.out}/room_{seed}{'_colour' if args.colour_only else ''}"
    if not os.path.exists(f"{folder}/transforms.json"):
        rooms.scan(folder, args.views, seed, depth=not args.colour_only)
    answers = {}
    for kind in ("planes", "plain"):
        out = f"{folder}_{kind}"
        command = [args.program, "reconstruct", "scene", folder, "--out", out, "--json", "--force"]
        command += ["--scale", "1"] if args.colour_only else []
        command += ["--steps", str(args.steps)] + (["--planes"] if kind == "planes" else [])
        begun = os.times()
        ended = subprocess.run(command, capture_output=True, text=True)
        if ended.returncode:
            return {"error": ended.stderr.strip().splitlines()[-1:]}
        after = os.times()
        answers[kind] = answer = json.loads(ended.stdout)
        answer["seconds"] = after.elapsed - begun.elapsed
        answer["cpu_seconds"] = after.children_user + after.children_system - begun.children_user - begun.children_system
        answer["rough_mm"] = rooms.roughness(folder, out)
    ours = trimesh.load(f"{folder}_planes/scene.ply", process=False)
    meshes = [(np.asarray(ours.vertices), np.asarray(ours.faces))]
    if not args.colour_only:
        peer = open3d_fused(folder, answer["voxel_m"], rooms.FARTHEST, masked=False)
        meshes.append((np.asarray(peer.vertices), np.asarray(peer.triangles)))
    errors, shares = rooms.depth_errors(meshes, folder)
    within = float(rooms.shares_within(meshes[0], folder, WITHIN))
    table = answers["planes"]["table"]
    tilt = np.degrees(np.arccos(min(1.0, table["normal"][2])))
    height = 1e3 * (table["middle_m"][2] - rooms.TABLE)
    return {"depth_mm": errors, "covered": shares, "within": within, "table_mm": height, "table_degrees": float(tilt), **answers}


def room_line(seed, row):
    if "error" in row:
        return f"| {seed} | {row['error']} |"
    cells = [f"{error:.2f} ({100 * share:.1f} %)" for error, share in zip(row["depth_mm"], row["covered"])]
    ours, peer = cells if len(cells) > 1 else (*cells, "-")
    planes, plain = row["planes"], row["plain"]
    return (
        f"| {seed} | {ours} | {100 * row['within']:.1f} % | {peer} | {row['table_mm']:+.2f} mm, "
        f"{row['table_degrees']:.3f} degrees | {planes['rough_mm']:.2f} | {plain['rough_mm']:.2f} | {planes['psnr_db']:.2f} "
        f"| {plain['psnr_db']:.2f} | {planes['seconds']:.0f} ({planes['cpu_seconds']:.0f} CPU) |"
    )


def all_rooms(args):
    print("| room | depth off [mm] (covered) | within 1 % | Open3D | table off | walls rough [mm] | without planes | PSNR [dB] | without | time [s] |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    rows = {}
    for seed in range(1, args.rooms + 1):
        rows[seed] = row = room(args, seed)
        print(room_line(seed, row), flush=True)
        with open(f"{args.out}/rooms.json", "w") as out:
            json.dump(rows, out, indent=1)


def drawn_anew(truth, path, kinds, views):
    """Draws an object once from above and once from all sides, as far as the kinds need it, and writes their scans."""
    from scan_objects.record import record, shots

    for above in (True, False):
        wanted = [kind for kind in kinds if KINDS[kind].get("above", False) == above]
        drawn = shots(truth, f"{path}_world", above, views=views) if wanted else []
        for kind in wanted:
            table = float(truth.bounds[0][2]) if KINDS[kind].get("table") else None
            record(drawn, f"{path}_{kind}", noise=KINDS[kind]["noise"], depth=KINDS[kind]["depth"], table=table)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="target/release/twin", help="the program twin")
    parser.add_argument("--out", required=True, help="folder for scans and results; scans that are there are kept")
    parser.add_argument("--objects", nargs="+", choices=list(shapes.GENUS), default=list(shapes.GENUS))
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=[kind for kind in KINDS if KINDS[kind].get("above")])
    parser.add_argument("--grid", type=int, default=128, help="nodes along each edge of an object's grid")
    parser.add_argument("--views", type=int, default=60)
    parser.add_argument("--rooms", type=int, default=0, help="so many rooms in place of objects")
    parser.add_argument("--colour-only", action="store_true", help="rooms without depth pictures")
    parser.add_argument("--steps", type=int, default=1500, help="of the training of a room's splats")
    args = parser.parse_args()
    os.makedirs(args.out, exist_ok=True)
    if args.rooms:
        all_rooms(args)
        return
    rows = {}
    print("| object | input | voxel [mm] | Chamfer-L1 [mm] | Open3D | volume | genus | over 2 mm off, grey of these and of the rest | held-out PSNR [dB] | splats [dB] | time [s] |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for name, truth in shapes.objects():
        if name not in args.objects:
            continue
        missing = [kind for kind in args.kinds if not os.path.exists(f"{args.out}/{name}_{kind}/transforms.json")]
        if missing:
            drawn_anew(truth, f"{args.out}/{name}", missing, args.views)
        for kind in args.kinds:
            begun = time.time()
            rows[f"{name} {kind}"] = row = judged(args, name, truth, kind)
            row["all_seconds"] = time.time() - begun
            print(line(name, kind, row), flush=True)
            with open(f"{args.out}/results.json", "w") as out:
                json.dump(rows, out, indent=1)


if __name__ == "__main__":
    main()
