"""Are poses of photographs right? Gives `adapters/photographs/poses.py` the pictures of scans whose poses are known, as `scan.py` writes them,
and says how far the cameras are off once scale and frame are fitted.

    venv/bin/python tests/peers/photographs.py scans/box_above scans/room_1_colour

It runs in the adapter's own environment. What is off is in part the scans' own: their poses have noise.
"""
import json
import os
import subprocess
import sys
import tempfile
import time

ADAPTER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "adapters", "photographs")
sys.path.insert(0, ADAPTER)
try:
    import numpy as np
    import pycolmap

    from scale import similarity
except ModuleNotFoundError as missing:
    sys.exit(f"{missing.name} is not installed; `pip install -r adapters/photographs/requirements.txt` in a virtual environment")

FLIPPED = np.diag([1.0, -1.0, -1.0])  # nerfstudio's camera axes against COLMAP's


def known(scan):
    """The pose of the camera of each picture."""
    with open(os.path.join(scan, "transforms.json"), encoding="utf-8") as stream:
        return {os.path.basename(frame["file_path"]): np.array(frame["transform_matrix"]) for frame in json.load(stream)["frames"]}


def off(model, truth):
    """Errors of the cameras' places [m] and turns [degrees] after the similarity of least squares."""
    images = [model.image(number) for number in model.reg_image_ids()]
    found = np.array([image.projection_center() for image in images])
    places = np.array([truth[image.name][:3, 3] for image in images])
    scale, turn, shift = similarity(found, places)
    apart = [(turn @ image.cam_from_world().rotation.matrix().T).T @ truth[image.name][:3, :3] @ FLIPPED for image in images]
    turns = np.degrees(np.arccos(np.clip([(np.trace(rotation) - 1) / 2 for rotation in apart], -1, 1)))
    return np.linalg.norm(scale * found @ turn.T + shift - places, axis=1), turns


def main():
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    print("| scan | poses | places off, median and largest | of the cameras' extent | turns off | time |\n|---|---|---|---|---|---|")
    for scan in sys.argv[1:]:
        truth = known(scan)
        with tempfile.TemporaryDirectory() as folder:
            out, begun = os.path.join(folder, "scan"), time.monotonic()
            command = [sys.executable, f"{ADAPTER}/poses.py", os.path.join(scan, "images"), "--out", out, "--threads", "1"]
            ended = subprocess.run(command, capture_output=True, text=True)
            took = time.monotonic() - begun
            if ended.returncode:
                print(f"| {scan} | {ended.stderr.strip().splitlines()[-1]} |")
                continue
            model = pycolmap.Reconstruction(os.path.join(out, "sparse", "0"))
            places, turns = off(model, truth)
        corners = np.array([pose[:3, 3] for pose in truth.values()])
        share = np.median(places) / np.linalg.norm(np.ptp(corners, axis=0))
        print(f"| {scan} | {len(places)} of {len(truth)} | {1e3 * np.median(places):.2f}, {1e3 * places.max():.2f} mm | {100 * share:.3f} % "
              f"| {np.median(turns):.2f}, {turns.max():.2f} degrees | {took:.0f} s |", flush=True)


if __name__ == "__main__":
    main()
