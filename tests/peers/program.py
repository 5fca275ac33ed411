"""Runs a program of this project and takes its JSON answer; ends it within a second when this process is asked to end."""
import argparse
import json
import os
import signal
import subprocess
import sys

GRACE = 0.7  # [s]


class Failed(Exception):
    """A program gave no answer; its last line says why."""


def built(path):
    """An argument that names a program."""
    if not os.access(path, os.X_OK) or os.path.isdir(path):
        raise argparse.ArgumentTypeError(f"{path} is no program; build it with `cargo build --release`")
    return path


def ending_by_signals():
    """SIGTERM ends as Ctrl-C does."""
    def end(number, frame):
        raise KeyboardInterrupt
    signal.signal(signal.SIGTERM, end)
    signal.signal(signal.SIGINT, end)


def answer(command):
    """The JSON object that `command` prints."""
    # In a session of its own, so that a Ctrl-C comes to it once, from here.
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    try:
        out, err = child.communicate()
    except KeyboardInterrupt:
        child.send_signal(signal.SIGINT)
        try:
            child.wait(GRACE)
        except subprocess.TimeoutExpired:
            child.kill()
        raise
    if child.returncode != 0:
        lines = err.strip().splitlines() or [f"exit code {child.returncode}"]
        raise Failed(lines[-1])
    return json.loads(out)


def note(text):
    """A line on standard error."""
    print(text, file=sys.stderr, flush=True)
