"""Frames of a video through the program ffmpeg: all of them are looked at small, the sharpest of each few in a row are taken whole."""
import os
import shutil
import subprocess

import numpy as np

import pictures
from pictures import Refused

ENDINGS = (".mp4", ".mov", ".m4v", ".mkv", ".webm", ".avi", ".3gp")
RATE = 15  # frames a second that are looked at
GOAL = 60  # frames that are taken unless --every says otherwise


def frames(video, folder, every, note):
    """Writes sharp frames of the video as PNG files into the folder; gives their paths and how many were looked at."""
    program = shutil.which("ffmpeg")
    if program is None:
        raise Refused(f"{video} is a video, which the program ffmpeg cuts into frames, and there is none: install it (`apt install ffmpeg`)")
    note("looks for sharp frames in the video")
    sharp = [pictures.sharpness(np.asarray(frame, np.float32)) for frame in _small(program, video)]
    every = every or max(1, round(len(sharp) / GOAL))
    if len(sharp) < pictures.FEWEST * every:
        raise Refused(f"{video} has {len(sharp)} frames at {RATE} a second, of which the sharpest of each {every} would be taken: "
                      f"{pictures.FEWEST} are the least; walk around the object for half a minute"
                      + (", or give a smaller --every" if every > 1 else ""))
    taken = pictures.spread(sharp, every)
    note(f"takes {len(taken)} of {len(sharp)} frames, the sharpest of each {every}")
    os.makedirs(folder)
    select = "+".join(f"eq(n\\,{number})" for number in taken)
    # The first filter makes frames as regular as the encoder wants them, so that it neither doubles nor drops any; ffmpeg turns them upright.
    _run([program, "-v", "error", "-nostdin", "-i", video, "-map", "0:v:0", "-vf", f"fps={RATE},select={select},setpts=N/{RATE}/TB",
          "-start_number", "0", os.path.join(folder, "frame_%05d.png")], video)
    return [os.path.join(folder, name) for name in sorted(os.listdir(folder))], len(sharp)


def _run(command, video):
    done = subprocess.run(command, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)
    if done.returncode:
        raise Refused(_said(video, done.stderr))


def _said(video, errors):
    last = [line for line in errors.decode(errors="replace").splitlines() if line.strip()]
    return (f"ffmpeg cannot read {video}{': ' + last[-1].strip()[:200] if last else ''}; "
            "play it to see whether it is whole, and copy it from the phone again")


def _small(program, video):
    """All frames at RATE in grey, small."""
    side = pictures.LOOKED_AT
    command = [program, "-v", "error", "-nostdin", "-i", video, "-map", "0:v:0", "-vf",
               f"fps={RATE},scale={side}:{side}:force_original_aspect_ratio=decrease,format=gray", "-f", "image2pipe", "-c:v", "pgm", "-"]
    child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        while child.stdout.readline().strip() == b"P5":
            columns, rows = map(int, child.stdout.readline().split())
            child.stdout.readline()
            pixels = child.stdout.read(columns * rows)
            if len(pixels) < columns * rows:
                break
            yield np.frombuffer(pixels, np.uint8).reshape(rows, columns)
        errors = child.stderr.read()
        if child.wait():
            raise Refused(_said(video, errors))
    finally:
        child.kill()
        child.wait()
        child.stdout.close()
        child.stderr.close()
