"""What is said of pictures and poses: remarks with a remedy, and the answer."""
import os
import shlex
import shutil

import numpy as np

import pictures
from pictures import FEWEST, Refused, some

DETAILS = 400  # of a picture; fewer tell little
ONE_SIDE = 90.0  # directions of the cameras within this angle show one side [degrees]
GAP = 100.0  # around the object without a picture [degrees]
ROUGH = 1.5  # mean error of the poses [pixel]


def light(taken, notes):
    """Remarks on pictures in which hardly anything can be told."""
    dark, bright = [p.file for p in taken if p.dark], [p.file for p in taken if p.bright]
    if dark:
        notes(f"dark: {some(dark)}; have more light, or take them again")
    if bright:
        notes(f"so bright that {100 * pictures.BRIGHT:.0f} % of the picture and more are white: {some(bright)}; take them again with less exposure")


def enough(found, taken, notes):
    """Refuses a model of too few pictures, and says what may be the reason where many have no pose."""
    count, all_of = len(found["names"]), len(taken)
    few = [picture.file for picture in taken if found["details"].get(picture.name, 0) < DETAILS]
    reasons = "let neighbours show two thirds of the same, keep everything in the picture still (an object that was turned needs masks and --turned)"
    if 2 * len(few) > all_of:
        reasons = (f"{len(few)} of them show few details to hold on to: put a newspaper or a cloth with a print beneath the object, "
                   "go nearer, or give --size 0")
    if count < FEWEST:
        raise Refused(f"only {count} of {all_of} pictures fit together, {FEWEST} are the least: {reasons}")
    if count < 0.6 * all_of:
        notes(f"only {count} of {all_of} pictures fit together: {reasons}")
    others = [size for size in found["models"][1:] if size >= 3]
    if others:
        notes(f"{', '.join(map(str, others))} more pictures fit with each other, but not with the {count}: take some that show what both show")


def around(reconstruction):
    """Of the cameras, seen from the middle of what they see: mean distance [unit], widest angle between two, widest gap around [degrees]."""
    middle = np.median([point.xyz for point in reconstruction.points3D.values()], axis=0)
    images = [reconstruction.image(number) for number in reconstruction.reg_image_ids()]
    ways = np.array([image.projection_center() for image in images]) - middle
    far = np.linalg.norm(ways, axis=1)
    ways /= far[:, None]
    widest = float(np.degrees(np.arccos(np.clip((ways @ ways.T).min(), -1, 1))))
    up = np.mean([-image.cam_from_world().rotation.matrix()[1] for image in images], axis=0)
    up /= max(np.linalg.norm(up), 1e-9)
    one = np.cross(up, [1.0, 0, 0] if abs(up[0]) < 0.8 else [0, 1.0, 0])
    angles = np.sort(np.degrees(np.arctan2(ways @ np.cross(up, one), ways @ one)))
    gap = float(np.diff(angles, append=angles[0] + 360).max())
    return float(far.mean()), widest, gap


def tidied(root, taken, with_pose):
    """Takes away what COLMAP needed, and pictures without a pose."""
    shutil.rmtree(os.path.join(root, "work"))
    for picture in taken:
        if picture.name not in with_pose:
            os.remove(os.path.join(root, "images", picture.name))
            if picture.mask:
                os.remove(os.path.join(root, "masks", picture.mask_name))
    if not os.listdir(os.path.join(root, "masks")):
        os.rmdir(os.path.join(root, "masks"))


class Answer:
    """The sentence for a person, and the numbers of it."""

    def __init__(self, given, taken, left_out, found, reconstruction, known, notes):
        placed = set(found["names"])
        without = [picture.file for picture in taken if picture.name not in placed]
        distance, widest, gap = around(reconstruction)
        masked = [picture for picture in taken if picture.name in placed and (picture.mask or picture.alpha)]
        unmasked = [picture.file for picture in taken if picture.name in placed and not (picture.mask or picture.alpha)]
        if without:
            notes(f"without a pose, left out: {some(without, 8)}")
        if found["error"] > ROUGH:
            notes(f"poses are off by {found['error']:.1f} pixels on average, which is much: leave the zoom alone, keep things still, "
                  "or try --camera OPENCV")
        if widest < ONE_SIDE:
            notes(f"all pictures were taken from within {widest:.0f} degrees, seen from the middle of what they show: take more from other sides, "
                  "an object from all of them")
        elif masked and gap > GAP:
            notes(f"no picture was taken along {gap:.0f} of the 360 degrees around: an object has no surface there; take more from that side")
        if masked and unmasked:
            notes(f"no mask of {some(unmasked)}, without which `twin reconstruct object` ends: draw it, or take the picture away")
        scan = shlex.quote(given.out)
        kind = "object" if masked else "scene"
        name = f"{os.path.basename(os.path.normpath(given.out))}_{kind}"
        ready = f"twin reconstruct {kind} {scan} --out {shlex.quote(name)} --scale"
        if known:
            command = f"{ready} 1"
        else:
            command = f"{ready} METRES"
        if known and known["source"] == "board":
            plane = ",".join(f"{number:.6g}" for number in known["table"])
            notes(f"the board was found in {known['pictures']} pictures, its corners are off by {known['off_mm']:.2f} mm; "
                  f"where it lies on the table, its plane is --table={plane}")
        total = len(taken) + sum(map(len, left_out.values()))
        self.line = f"{len(placed)} of {total} pictures have a pose; mean error {found['error']:.1f} px. Next: {command}"
        if not known:
            self.line += (f" (METRES: how far the cameras were in truth from the middle of what they show, divided by {distance:.4g}, "
                          f"their mean distance in the scan; one that was 0.5 m away gives {0.5 / distance:.4g})")
        if not masked:
            self.line += f". An object needs masks first, {os.path.join(given.out, 'masks', 'NAME.png')}, white where it is"
        cameras = [{"model": camera.model_name, "size": [camera.width, camera.height], "parameters": list(map(float, camera.params))}
                   for camera in reconstruction.cameras.values()]
        self.numbers = {"scan": given.out, "pictures": total, "with_pose": len(placed), "left_out": {**left_out, "without_pose": without},
                        "mean_error_px": found["error"], "points": found["points"], "models": found["models"], "cameras": cameras,
                        "scale": known, "mean_camera_distance": distance, "unit": "m" if known else None,
                        "widest_angle_deg": widest, "widest_gap_deg": gap,
                        "masks": [picture.mask_name for picture in masked if picture.mask], "remarks": notes.kept, "next": command}
