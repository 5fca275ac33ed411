"""Makes a scan, which `twin reconstruct` reads, out of pictures that a phone has taken, or out of a video: where each was taken from.

    python adapters/photographs/poses.py mug_pictures --out mug_scan
    python adapters/photographs/poses.py mug_pictures --out mug_scan --board 5x7,0.034,0.028,DICT_5X5_100
    python adapters/photographs/poses.py mug.mp4 --out mug_scan --every 10
    twin reconstruct object mug_scan --out mug --scale 1

Take forty to eighty pictures from all sides, in rounds of low and high views, neighbours some 10 degrees apart, without changing the
zoom. Keep everything in the picture still; what has a print or a grain helps, a newspaper beneath a plain object, say.

Pictures alone do not say how large something is. Lay a printed ChArUco board beside the object and say it with --board, as
`calibration hand-eye` takes it (columns x rows, edge of a square and of a marker in metres, dictionary; measure a square of the print): the
scan is then in metres. Otherwise the answer says how to find the number for --scale.

`twin reconstruct object` needs a mask of each picture too, white where the object is: masks/NAME.png in the folder of the pictures or beside
it, which are taken over, or put into SCAN/masks later. Without any, `twin reconstruct scene` reads the scan.

The scan holds images/ (upright, at most --size pixels long), masks/, sparse/0 (a COLMAP model) and photographs.json (what this program
says). COLMAP runs on the processor; sixty pictures take minutes. With --threads 1 the same pictures give the same scan.
"""
import argparse
import json
import os
import signal
import sys

signal.signal(signal.SIGINT, signal.SIG_DFL)  # until there is something to put away
try:
    import cv2
    import numpy as np
    import pycolmap

    import folder
    import model
    import pictures
    import scale
    import summary
    import video
    from pictures import Refused
except ModuleNotFoundError as missing:
    sys.exit(f"{missing.name} is not installed; `pip install -r adapters/photographs/requirements.txt` in a virtual environment")

PARAMETERS = {"SIMPLE_RADIAL": lambda f, w, h: [f, w / 2, h / 2, 0], "RADIAL": lambda f, w, h: [f, w / 2, h / 2, 0, 0],
              "OPENCV": lambda f, w, h: [f, f, w / 2, h / 2, 0, 0, 0, 0]}
ONE_ZOOM = 0.85  # focal length of a phone's camera as a share of the longer side, where EXIF does not say it


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pictures", metavar="PICTURES", help="folder of PNG and JPEG files, or one video")
    parser.add_argument("--out", required=True, metavar="SCAN", help="new folder for the scan")
    parser.add_argument("--board", metavar="CxR,SQUARE,MARKER,DICT", help="a ChArUco board that lies still in the pictures: the scan is in metres")
    parser.add_argument("--scale", type=float, metavar="METRES", help="metres for one unit, as the answer to the same command "
                        "with --threads 1 says how to find it: the scan is in metres")
    parser.add_argument("--every", type=int, metavar="N", help="takes the sharpest of each N pictures or frames in a row [default: all pictures; "
                        f"of a video so that about {video.GOAL} stay]")
    parser.add_argument("--size", type=int, default=1600, metavar="PIXELS", help="longer side of the pictures in the scan at most, 0: as they are "
                        "[default: 1600]")
    parser.add_argument("--camera", choices=sorted(PARAMETERS), default="SIMPLE_RADIAL", help="the lens; OPENCV where edges stay bent, "
                        "with many pictures [default: SIMPLE_RADIAL]")
    parser.add_argument("--turned", action="store_true", help="the object was turned and the camera stood: only what is white in the masks counts")
    parser.add_argument("--blurred", action="store_true", help="takes blurred pictures all the same")
    parser.add_argument("--threads", type=int, default=-1, metavar="N", help="of COLMAP [default: all]")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of its draws")
    parser.add_argument("--force", action="store_true", help="replaces a scan that this program has written")
    parser.add_argument("--json", action="store_true", help="prints one JSON object on stdout at the end")
    given = parser.parse_args()
    for wrong, line in ((given.board and given.scale, "give --board or --scale, not both"),
                        (given.scale is not None and not 1e-6 <= given.scale <= 1000, "--scale is 1e-6 to 1000 metres for one unit"),
                        (given.every is not None and given.every < 1, "--every begins at 1"),
                        (given.size and given.size < 320, "--size is 320 pixels at least, or 0 for pictures as they are"),
                        (given.threads == 0 or given.threads < -1, "--threads begins at 1"),
                        (given.seed < 0, "--seed begins at 0")):
        if wrong:
            sys.exit(line)
    return given


def in_a_line(text):
    """Names of files may hold anything."""
    return "".join(c if c.isprintable() else "?" for c in text)


class Notes:
    """Remarks for stderr, kept for the answer where they are about the pictures."""

    def __init__(self):
        self.kept = []

    def progress(self, text):
        print(in_a_line(text), file=sys.stderr, flush=True)

    def __call__(self, text):
        self.kept.append(text)
        self.progress(text)


def named(taken):
    """Gives each picture the name that it has in the scan: its own, without blanks, which separate words in COLMAP's lists, and unlike the others."""
    used = set()
    for picture in taken:
        stem, ending = os.path.splitext(picture.file)
        stem = "".join("_" if c.isspace() or not c.isprintable() or "\ud800" <= c <= "\udfff" else c for c in stem)
        name, count = stem + ending, 1
        while name.lower() in used:
            count += 1
            name = f"{stem}_{count}{ending}"
        used.add(name.lower())
        picture.name = name
    stems = [os.path.splitext(picture.name)[0] for picture in taken]
    for picture, stem in zip(taken, stems):
        picture.mask_name = f"{stem if stems.count(stem) == 1 else picture.name}.png"


def looked_at(given, work, notes):
    """The pictures to be used, and what was left out."""
    source = given.pictures
    if os.path.isdir(source):
        return pictures.chosen(pictures.listed(source, notes), given.every or 1, given.blurred, notes)
    if not os.path.isfile(source):
        raise Refused(f"{source}: no such folder or video")
    if os.path.splitext(source)[1].lower() in pictures.ENDINGS:
        raise Refused(f"{source} is one picture; give the folder with all of them, or a video")
    if os.path.splitext(source)[1].lower() not in video.ENDINGS:
        raise Refused(f"{source} is neither a folder nor a video ({', '.join(video.ENDINGS)})")
    paths, _ = video.frames(source, os.path.join(work, "frames"), given.every, notes.progress)
    return pictures.chosen(paths, 1, given.blurred, notes)


def written(taken, root, given, notes):
    """Writes pictures and masks; masks for COLMAP alone where the object was turned. Gives groups of pictures of one camera."""
    for name in ("images", "masks"):
        os.makedirs(os.path.join(root, name))
    masks = os.path.join(root, "work", "masks") if given.turned else None
    if masks:
        os.makedirs(masks)
    groups = {}
    for count, picture in enumerate(taken):
        if count and count % 25 == 0:
            notes.progress(f"writes pictures: {count} of {len(taken)}")
        picture.goal = picture.written(os.path.join(root, "images"), given.size)
        if picture.mask:
            picture.written_mask(os.path.join(root, "masks", picture.mask_name), picture.goal)
        if masks:
            picture.written_mask(os.path.join(masks, picture.name + ".png"), picture.goal)
        groups.setdefault((picture.goal, picture.zoom), []).append(picture)
    if len({size for size, _ in groups}) > 1:
        notes(f"pictures of {len({size for size, _ in groups})} sizes ({', '.join(sorted(f'{w} x {h}' for w, h in {s for s, _ in groups}))}): "
              "each gets a camera of its own, which is weaker; keep the phone upright or level all the time")
    elif len(groups) > 1:
        notes(f"pictures of {len(groups)} zooms or cameras by their EXIF numbers: each gets a camera of its own, which is weaker; "
              "leave the zoom alone")
    out = []
    for ((width, height), _), group in groups.items():
        shares = [picture.focal for picture in group if picture.focal]
        focal = (float(np.median(shares)) if shares else ONE_ZOOM) * max(width, height)
        out.append({"names": [picture.name for picture in group], "parameters": PARAMETERS[given.camera](focal, width, height)})
    return out, masks


def finished(reconstruction, given, board, seen):
    """Scales the model; what is known of its scale."""
    if board:
        found = {"source": "board", **scale.of_board(board, reconstruction, seen)}
    elif given.scale:
        found = {"metres": given.scale, "source": "given"}
    else:
        return None
    reconstruction.transform(pycolmap.Sim3d(found["metres"], pycolmap.Rotation3d(), np.zeros(3)))
    return found


def make(given, notes):
    board = scale.Board(given.board) if given.board else None
    if os.path.isdir(given.pictures) and os.path.realpath(given.pictures).startswith(os.path.realpath(given.out) + os.sep):
        raise Refused(f"{given.pictures} lies in {given.out}; give another --out")
    with folder.Unfinished(given.out, given.force) as unfinished:
        root = unfinished.path
        work = os.path.join(root, "work")
        os.makedirs(work)
        taken, left_out = looked_at(given, work, notes)
        if given.turned and not all(picture.mask or picture.alpha for picture in taken):
            without = [picture.file for picture in taken if not picture.mask and not picture.alpha]
            raise Refused(f"--turned needs a mask of each picture; there is none of {pictures.some(without)}")
        summary.light(taken, notes)
        named(taken)
        groups, masks = written(taken, root, given, notes)
        order = [picture.name for picture in taken]
        seen = board and board.seen({name: os.path.join(root, "images", name) for name in order}, notes.progress)
        chosen = model.pairs(len(order), not os.path.isdir(given.pictures) and len(order) > model.EVERY_PAIR)
        job = {"pictures": os.path.join(root, "images"), "work": work, "database": os.path.join(work, "database.db"),
               "model": os.path.join(root, "sparse", "0"), "groups": groups, "threads": given.threads, "seed": given.seed, "camera": given.camera,
               "masks": masks, "pairs": chosen and [[order[i], order[j]] for i, j in chosen]}
        found = model.run(job, notes.progress)
        summary.enough(found, taken, notes)
        reconstruction = pycolmap.Reconstruction(job["model"])
        known = finished(reconstruction, given, board, seen)
        reconstruction.write(job["model"])
        answer = summary.Answer(given, taken, left_out, found, reconstruction, known, notes)
        summary.tidied(root, taken, set(found["names"]))
        with open(os.path.join(root, "photographs.json"), "w", encoding="utf-8") as stream:
            json.dump(answer.numbers, stream, indent=1)
        unfinished.done()
    print(json.dumps(answer.numbers) if given.json else answer.line)


def ended(*_):
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)  # what is begun is put away in peace
    raise KeyboardInterrupt


def main():
    given, notes = arguments(), Notes()
    if given.threads > 0:
        cv2.setNumThreads(given.threads)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, ended)
    try:
        make(given, notes)
    except (Refused, model.Failed) as why:
        sys.exit(in_a_line(str(why)))
    except OSError as error:
        sys.exit(in_a_line(f"{error.filename or given.out}: {error.strerror or error}; give an --out that can be written, on a disk with room"))
    except KeyboardInterrupt:
        print(in_a_line(f"ended before {given.out} was complete; nothing of it was kept"), file=sys.stderr)
        sys.exit(130)


if __name__ == "__main__":
    main()
