"""COLMAP (Schoenberger and Frahm 2016) in a process of its own, which can be ended at any moment: its calls do not return for a signal.

`run(job)` starts this file as a program, passes on how far it is, and gives what it has found. The job is written to its input as JSON:
the folder of the pictures, groups of pictures that one camera took, pairs to match (none: all), threads, seed, masks.
"""
import contextlib
import ctypes
import json
import os
import select
import signal
import sqlite3
import statistics
import subprocess
import sys
import time
import urllib.parse

FEATURES = 8192  # of a picture at most, as COLMAP has it
FEW, FAINT = 1000, 0.001  # where half of the pictures have fewer, fainter ones are taken as well: contrast, of which COLMAP asks for 0.0067
INLIERS = 15  # a pair of pictures with fewer agreeing matches says nothing, as COLMAP has it
EVERY_PAIR = 100  # more pictures than this are matched with their neighbours and some others alone
NEIGHBOURS = 12  # so many after it
ANCHORS = 60  # and so many of all pictures, evenly spread, with each other: where a walk around comes back to its beginning
LEAST_MODEL = 3
SAID = 2.0  # between two words on how far it is [s]


class Failed(Exception):
    """COLMAP found nothing, or ended; the text is one sentence."""


def pairs(count, neighbours_only=False):
    """Numbers of pictures that are matched with each other; None where that is each with each."""
    if count <= EVERY_PAIR and not neighbours_only:
        return None
    near = {(i, j) for i in range(count) for j in range(i + 1, min(i + 1 + NEIGHBOURS, count))}
    anchors = sorted({round(k * (count - 1) / (ANCHORS - 1)) for k in range(ANCHORS)}) if count > 1 else []
    return sorted(near | {(a, b) for a in anchors for b in anchors if a < b})


def _rows(database, table):
    """How many rows a table of the database has by now; None where it cannot be told."""
    try:
        address = f"file:{urllib.parse.quote(database)}?mode=ro"
        with contextlib.closing(sqlite3.connect(address, uri=True, timeout=0.0)) as connection:
            return connection.execute(f"SELECT COUNT(*) FROM {table}").fetchone()[0]
    except sqlite3.Error:
        return None


def run(job, say):
    """What COLMAP makes of the job, a dict as `found` below; `say(text)` hears how far it is.

    Raises Failed with a sentence. Whatever ends this function ends the child as well.
    """
    with open(os.path.join(job["work"], "colmap.log"), "w+b") as log:
        child = subprocess.Popen([sys.executable, os.path.abspath(__file__)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log,
                                 start_new_session=True)  # Ctrl-C in a terminal is for the parent alone
        try:
            return _heard(child, job, say, log)
        finally:
            child.kill()
            child.wait()
            child.stdin.close()
            child.stdout.close()


def _heard(child, job, say, log):
    stage, total, table, told, database = "start", None, None, -1, None
    try:
        child.stdin.write(json.dumps({**job, "parent": os.getpid()}).encode())
        child.stdin.close()
    except BrokenPipeError:
        pass  # how it ended is said below
    waiting, said = b"", 0.0
    while True:
        ready, _, _ = select.select([child.stdout], [], [], SAID)
        if not ready:
            done = _rows(database, table) if table else None
            if done and done != told:
                told = done
                say(f"{stage}: {done} of {total}")
            continue
        data = os.read(child.stdout.fileno(), 1 << 16)
        if not data:
            break
        *lines, waiting = (waiting + data).split(b"\n")
        for message in map(json.loads, lines):
            if "found" in message:
                return message["found"]
            if "failed" in message:
                raise Failed(message["failed"])
            if "placed" in message:
                if time.monotonic() - said < SAID:
                    continue
                said = time.monotonic()
                say(f"{stage}: {message['placed']} of {total} have a pose")
                continue
            stage, total, table, told, database = message["stage"], message["total"], message.get("table"), -1, message.get("database")
            say(stage)
    raise Failed(_ended(child.wait(), stage, log))


def _ended(code, stage, log):
    """Why the child ended without an answer."""
    log.seek(0)
    last = [line.strip() for line in log.read().decode(errors="replace").splitlines() if line.strip()]
    said = f", after it had said: {last[-1][:200]}" if last else ""
    if code == -signal.SIGKILL:
        return f"COLMAP was killed at `{stage}`, as the system does when memory is short; try --size 1000, or fewer pictures with --every 2"
    name = signal.Signals(-code).name if code < 0 else f"code {code}"
    return f"COLMAP ended by itself at `{stage}` ({name}){said}; try --size 1000 or --threads 1"


# What follows runs in the child.

def _with_parent(parent):
    """Has the kernel end this process with its parent, even one that is killed (Linux; elsewhere it runs to its end)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
        if os.getppid() != parent:
            os._exit(1)


def work(job, tell):
    """Features, matches and poses; the largest model is written to job["model"]."""
    import pycolmap
    pycolmap.logging.minloglevel = int(pycolmap.logging.Level.WARNING.value)
    pycolmap.set_random_seed(job["seed"])
    threads, seed = job["threads"], job["seed"]
    names = [name for group in job["groups"] for name in group["names"]]
    details = _details(job, None, tell, pycolmap)
    if statistics.median(details.values()) < FEW:
        job["database"] += ".fainter"  # a new one: the first one's logs may still be open
        details = _details(job, FAINT, tell, pycolmap)
    database = job["database"]
    matching = pycolmap.FeatureMatchingOptions(num_threads=threads, use_gpu=False)
    verification = pycolmap.TwoViewGeometryOptions(min_num_inliers=INLIERS)
    verification.ransac.random_seed = seed
    chosen = {"matching_options": matching, "verification_options": verification, "device": pycolmap.Device.cpu}
    if job["pairs"] is None:
        tell(stage="pairs of pictures", total=len(names) * (len(names) - 1) // 2, table="two_view_geometries", database=database)
        pycolmap.match_exhaustive(database, **chosen)
    else:
        tell(stage="pairs of pictures", total=len(job["pairs"]), table="two_view_geometries", database=database)
        listed = os.path.join(job["work"], "pairs.txt")
        _matched(database, job["pairs"], listed, chosen, pycolmap)
    tell(stage="poses", total=len(names))
    models = _mapped(job, tell, pycolmap)
    if not models:
        raise Failed("no two of the pictures fit together: neighbours have to show two thirds of the same, from places some degrees apart, "
                     "of something with a print or grain that keeps still; a newspaper beneath the object helps")
    models.sort(key=lambda model: (-model.num_reg_images(), -model.num_points3D()))
    best = models[0]
    os.makedirs(job["model"])
    best.write(job["model"])
    return {"details": details, "models": [model.num_reg_images() for model in models], "error": best.compute_mean_reprojection_error(),
            "points": best.num_points3D(), "names": sorted(best.image(number).name for number in best.reg_image_ids())}


def _details(job, contrast, tell, pycolmap):
    """Finds the details by which pictures are matched; how many each has. `contrast`: the least of one, None as COLMAP has it."""
    options, database = pycolmap.FeatureExtractionOptions(num_threads=job["threads"], use_gpu=False), job["database"]
    options.sift.max_num_features = FEATURES
    if contrast:
        options.sift.peak_threshold = contrast
    count = sum(len(group["names"]) for group in job["groups"])
    tell(stage="fainter details of the pictures" if contrast else "details of the pictures", total=count, table="keypoints", database=database)
    for group in job["groups"]:
        reader = pycolmap.ImageReaderOptions(camera_model=job["camera"], camera_params=",".join(map(str, group["parameters"])))
        if job["masks"]:
            reader.mask_path = job["masks"]
        pycolmap.extract_features(database, job["pictures"], image_names=group["names"], camera_mode=pycolmap.CameraMode.SINGLE,
                                  reader_options=reader, extraction_options=options, device=pycolmap.Device.cpu)
    with pycolmap.Database.open(database) as stored:
        return {image.name: stored.num_keypoints_for_image(image.image_id) for image in stored.read_all_images()}


def _matched(database, pairs_of_names, listed, chosen, pycolmap):
    """Matches pairs out of a list. Its separator is the blank, so pictures have names without blanks (see pictures.py) here."""
    with open(listed, "w", encoding="utf-8") as stream:
        stream.writelines(f"{one} {other}\n" for one, other in pairs_of_names)
    pycolmap.match_image_pairs(database, pairing_options=pycolmap.ImportedPairingOptions(match_list_path=listed), **chosen)


def _mapped(job, tell, pycolmap):
    options = pycolmap.IncrementalPipelineOptions(num_threads=job["threads"], random_seed=job["seed"], min_model_size=LEAST_MODEL,
                                                  extract_colors=True)
    options.mapper.random_seed = options.triangulation.random_seed = job["seed"]
    placed, output = [1], os.path.join(job["work"], "models")
    os.makedirs(output)

    def another():
        placed[0] += 1
        tell(placed=placed[0])

    def first():
        placed[0] = 1

    found = pycolmap.incremental_mapping(database_path=job["database"], image_path=job["pictures"], output_path=output, options=options,
                                         initial_image_pair_callback=first, next_image_callback=another)
    return list(found.values())


def main():
    job = json.load(sys.stdin)
    _with_parent(job["parent"])
    sink = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # whatever C++ prints goes to the log
    tell = lambda **message: sink.write(json.dumps(message).encode() + b"\n")
    try:
        tell(found=work(job, tell))
    except Failed as why:
        tell(failed=str(why))
    except Exception as error:  # of pycolmap: its first line, and what may help
        said = f"{type(error).__name__}: {error}".splitlines()[0][:300]
        tell(failed=f"COLMAP ends with {said}; try --size 1000 or --threads 1, and see that the disk is not full")


if __name__ == "__main__":
    main()
