"""Mounts of a camera: `calibration hand-eye` beside OpenCV's calibrateHandEye.

    pip install numpy "opencv-python-headless<5"        (BSD-3-Clause, Apache-2.0)
    hand_eye.py --program target/release/calibration --simulated 100
    hand_eye.py --program target/release/calibration --pictures 14
    hand_eye.py --program target/release/calibration --captured FOLDER

--simulated draws corners and arm's poses with noise: how far each answer is off, and how often the program's intervals hold.
--pictures draws pictures of a ChArUco board with OpenCV, with blur, noise and a lens, and finds the corners in them, too.
--captured takes a folder of kvasios/franka-handeye (captured-data/pose_NN/data.json: O_T_EE and the board by each picture, and its
authors' answer): every picture is left out once, and its corners are compared with what the others say.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

COLUMNS, ROWS, SQUARE, MARKER = 5, 7, 0.034, 0.028
CORNERS = np.array([[SQUARE * (k % 4 + 1), SQUARE * (k // 4 + 1), 0.0] for k in range(24)])
METHODS = {
    name: getattr(cv2, f"CALIB_HAND_EYE_{name}") for name in ["TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS"]
}


def transform(rotation_vector, translation):
    out = np.eye(4)
    out[:3, :3] = cv2.Rodrigues(np.asarray(rotation_vector, float))[0]
    out[:3, 3] = np.asarray(translation, float).ravel()
    return out


def project(k, distortion, camera_from_board):
    rotation = cv2.Rodrigues(camera_from_board[:3, :3])[0]
    return cv2.projectPoints(CORNERS, rotation, camera_from_board[:3, 3], k, distortion)[0].reshape(-1, 2)


def answer_of(program, folder, *more):
    command = [program, "hand-eye", str(folder), "--json", *more]
    done = subprocess.run(command, capture_output=True, text=True)
    if not done.stdout.strip():
        sys.exit(f"{' '.join(command)}: {done.stderr.strip()}")
    return json.loads(done.stdout)


def matrix_of(pose):
    w, x, y, z = pose["orientation"]
    out = np.eye(4)
    out[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    out[:3, 3] = pose["position"]
    return out


def ours(program, k, distortion, poses, corners):
    """The program's answer from corners; pixels count from the picture's corner in its lists."""
    names = dict(zip(["k1", "k2", "p1", "p2", "k3"], np.ravel(distortion).tolist()))
    frames = [
        {
            "file_path": f"{n:03}.png",
            "O_T_EE": pose.T.ravel().tolist(),
            "points": [[*xy[:2], u + 0.5, v + 0.5] for xy, (u, v) in zip(CORNERS.tolist(), pixels.tolist())],
        }
        for n, (pose, pixels) in enumerate(zip(poses, corners))
    ]
    camera = {"fl_x": k[0, 0], "fl_y": k[1, 1], "cx": k[0, 2] + 0.5, "cy": k[1, 2] + 0.5}
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "poses.json").write_text(json.dumps({**camera, **names, "frames": frames}))
        return answer_of(program, folder)


def opencv(method, poses, boards):
    rotations = [pose[:3, :3] for pose in poses], [board[:3, :3] for board in boards]
    shifts = [pose[:3, 3] for pose in poses], [board[:3, 3] for board in boards]
    turn, shift = cv2.calibrateHandEye(rotations[0], shifts[0], rotations[1], shifts[1], method=method)
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = turn, shift.ravel()
    return out


def board_of(k, distortion, pixels):
    _, turn, shift = cv2.solvePnP(CORNERS, pixels, k, distortion, flags=cv2.SOLVEPNP_ITERATIVE)
    return transform(turn, shift)


def middle(matrices):
    u, _, v = np.linalg.svd(sum(m[:3, :3] for m in matrices))
    out = np.eye(4)
    out[:3, :3] = u @ v
    out[:3, 3] = np.mean([m[:3, 3] for m in matrices], axis=0)
    return out


def apart(a, b):
    """Distance [mm] and angle [degrees]."""
    turn = cv2.Rodrigues(a[:3, :3].T @ b[:3, :3])[0]
    return 1e3 * np.linalg.norm(a[:3, 3] - b[:3, 3]), np.degrees(np.linalg.norm(turn))


def captured(program, folder):
    views = [json.loads(path.read_text()) for path in sorted(folder.glob("captured-data/pose_*/data.json"))]
    said = json.loads((folder / "hand-eye-calibration-output/calibration_result.json").read_text())
    said = np.array(said["T_cam_gripper"])
    k, distortion = np.array(views[0]["camera_intrinsics"]), np.array(views[0]["dist_coeffs"])
    poses = [np.array(view["O_T_EE"]).reshape(4, 4) for view in views]
    boards = [transform(np.ravel(v["T_cam_target_rvec"]), np.ravel(v["T_cam_target_tvec"])) for v in views]
    corners = [project(k, distortion, board) for board in boards]

    def all_ways(keep):
        some = [poses[i] for i in keep], [boards[i] for i in keep], [corners[i] for i in keep]
        answer = ours(program, k, distortion, some[0], some[2])
        found = {"hand-eye": (matrix_of(answer["EE_T_camera"]), matrix_of(answer["O_T_board"]))}
        for name, method in METHODS.items():
            camera = opencv(method, some[0], some[1])
            found[name] = camera, middle([e @ camera @ b for e, b in zip(some[0], some[1])])
        return answer, found

    answer, whole = all_ways(range(len(views)))
    held = {name: [] for name in whole}
    for left in range(len(views)):
        _, found = all_ways([i for i in range(len(views)) if i != left])
        for name, (camera, board) in found.items():
            seen = project(k, distortion, np.linalg.inv(camera) @ np.linalg.inv(poses[left]) @ board)
            held[name].append(np.sqrt(np.mean(np.sum((seen - corners[left]) ** 2, axis=1))))
    print(f"{len(views)} pictures; left out: {answer['residual']['left_out']}")
    pose = answer["EE_T_camera"]
    half = [500 * (hi - lo) for lo, hi in pose["position_ci90"]], [np.degrees(hi) for _, hi in pose["rotation_ci90"]]
    print("90 % half-widths:", np.round(half[0], 2), "mm", np.round(half[1], 3), "degrees")
    inside = [lo <= value <= hi for value, (lo, hi) in zip(said[:3, 3], pose["position_ci90"])]
    print("the authors' x, y, z inside of the intervals:", inside)
    print("way          position [mm]             from the authors'       held-out corners [pixel], rms and median")
    for name, (camera, _) in whole.items():
        distance, angle = apart(camera, said)
        place = np.round(1e3 * camera[:3, 3], 2)
        rms = np.sqrt(np.mean(np.square(held[name])))
        print(f"{name:12} {str(place):25} {distance:5.2f} mm {angle:5.3f} deg    {rms:6.2f} {np.median(held[name]):6.2f}")


def drawn(random, views, arm, pixel):
    """A mount, and what is seen and said of it."""
    mount = transform([0.0, 0.0, 1.57] + random.uniform(-0.2, 0.2, 3), [0.05, 0.0, 0.04] + random.uniform(-0.03, 0.03, 3))
    board = transform(random.uniform(-0.3, 0.3, 3), [0.5, 0.0, 0.0] + random.uniform(-0.1, 0.1, 3))
    k = np.array([[634.0, 0.0, 642.0], [0.0, 633.0, 359.0], [0.0, 0.0, 1.0]])
    distortion = np.array([-0.06, 0.07, -0.0002, 0.0005, -0.02])
    poses, corners, exact = [], [], []
    middle_of_board = transform([0, 0, 0], [-COLUMNS * SQUARE / 2, -ROWS * SQUARE / 2, 0])
    for _ in range(views):
        place = [*random.uniform([-0.06, -0.04], [0.06, 0.04]), random.uniform(0.3, 0.5)]
        seen = transform([0, 0, 0], place) @ transform(random.uniform([-0.5, -0.5, -1], [0.5, 0.5, 1]), [0, 0, 0])
        seen = seen @ middle_of_board
        pose = board @ np.linalg.inv(seen) @ np.linalg.inv(mount)
        poses.append(pose @ transform(random.normal(0, arm[0], 3), random.normal(0, arm[1], 3)))
        corners.append(project(k, distortion, seen) + random.normal(0, pixel, (24, 2)))
        exact.append(seen)
    return mount, k, distortion, poses, corners, exact


def simulated(program, count):
    for views, arm in [(8, (1e-3, 0.5e-3)), (15, (1e-3, 0.5e-3)), (15, (0.0, 0.0))]:
        off, inside = {name: [] for name in ["hand-eye", *METHODS]}, []
        for seed in range(count):
            mount, k, distortion, poses, corners, _ = drawn(np.random.default_rng(seed), views, arm, 0.1)
            answer = ours(program, k, distortion, poses, corners)["EE_T_camera"]
            off["hand-eye"].append(apart(matrix_of(answer), mount))
            inside.append([lo <= value <= hi for value, (lo, hi) in zip(mount[:3, 3], answer["position_ci90"])])
            boards = [board_of(k, distortion, pixels) for pixels in corners]
            for name, method in METHODS.items():
                off[name].append(apart(opencv(method, poses, boards), mount))
        print(f"{views} pictures, arm {1e3 * arm[0]} mrad {1e3 * arm[1]} mm, {count} seeds; position inside of 90 %:",
              np.round(100 * np.mean(inside, axis=0), 1))
        for name, values in off.items():
            rms = np.sqrt(np.mean(np.square(values), axis=0))
            print(f"  {name:12} rms {rms[0]:.3f} mm {rms[1]:.4f} degrees")


def pictures(program, views):
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    board = cv2.aruco.CharucoBoard((COLUMNS, ROWS), SQUARE, MARKER, dictionary)
    random, scale, rim = np.random.default_rng(7), 8000, 0.02
    size = int((COLUMNS * SQUARE + 2 * rim) * scale), int((ROWS * SQUARE + 2 * rim) * scale)
    sheet = board.generateImage(size, marginSize=int(rim * scale))
    mount, k, distortion, poses, _, exact = drawn(random, views, (3e-4, 2e-4), 0.0)
    # From metres on the board to pixels of the sheet.
    onto = np.array([[scale, 0, rim * scale - 0.5], [0, scale, rim * scale - 0.5], [0, 0, 1.0]])
    columns, rows = np.meshgrid(np.arange(1280), np.arange(720))
    pixels = np.stack([columns, rows], -1).reshape(-1, 1, 2).astype(np.float64)
    straight = cv2.undistortPoints(pixels, k, distortion, P=k).reshape(-1, 2)
    homogeneous = np.column_stack([straight, np.ones(len(straight))])
    with tempfile.TemporaryDirectory() as folder:
        for number, (pose, seen) in enumerate(zip(poses, exact)):
            to_sheet = onto @ np.linalg.inv(k @ seen[:, [0, 1, 3]][:3])
            at = homogeneous @ to_sheet.T
            at = (at[:, :2] / at[:, 2:]).reshape(720, 1280, 2).astype(np.float32)
            blurred = cv2.GaussianBlur(sheet, (0, 0), 0.35 * scale * seen[2, 3] / k[0, 0])
            image = cv2.remap(blurred, at, None, cv2.INTER_LINEAR, borderValue=150).astype(float)
            image = 30 + 0.75 * image + random.normal(0, 3, image.shape)
            cv2.imwrite(f"{folder}/{number:03}.png", np.clip(image, 0, 255).astype(np.uint8))
            beside = {"O_T_EE": pose.T.ravel().tolist(), "K": k.ravel().tolist(), "D": distortion.tolist()}
            Path(f"{folder}/{number:03}.json").write_text(json.dumps(beside))
        answer = answer_of(program, folder, "--board", f"{COLUMNS}x{ROWS},{SQUARE},{MARKER},DICT_5X5_100")
    distance, angle = apart(matrix_of(answer["EE_T_camera"]), mount)
    print(f"{views} pictures, {len(answer['without_board'])} without the board, corners",
          [view["corners"] for view in answer["views"]], "left out", answer["residual"]["left_out"])
    print(f"off by {distance:.3f} mm {angle:.4f} degrees; corners {answer['residual']['corner_sigma_px']:.3f} pixel;"
          f" {answer['seconds']:.1f} s")
    print("90 % half-widths:", [round(500 * (hi - lo), 3) for lo, hi in answer["EE_T_camera"]["position_ci90"]], "mm")


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--program", required=True, help="target/release/calibration")
    arguments.add_argument("--captured", type=Path, metavar="FOLDER")
    arguments.add_argument("--simulated", type=int, metavar="SEEDS")
    arguments.add_argument("--pictures", type=int, metavar="N")
    given = arguments.parse_args()
    if given.captured:
        captured(given.program, given.captured)
    if given.simulated:
        simulated(given.program, given.simulated)
    if given.pictures:
        pictures(given.program, given.pictures)


if __name__ == "__main__":
    main()
