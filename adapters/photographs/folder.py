"""The folder of a scan while it is written: it appears whole or not at all, and two programs never write the same one."""
import fcntl
import json
import os
import shutil

from pictures import Refused, some

OWN = {"images", "masks", "sparse", "photographs.json"}


class Unfinished:
    """`with Unfinished(SCAN, force) as folder`: SCAN.unfinished, which `done()` makes SCAN; anything else removes it."""

    def __init__(self, scan, force):
        self.scan = os.path.abspath(scan)
        self.path, self.held = self.scan + ".unfinished", None
        if os.path.lexists(self.scan):
            if not force:
                raise Refused(f"{scan} exists; give another --out, or --force to replace it")
            self._replaceable(scan)

    def _replaceable(self, scan):
        """Refuses to replace what is no scan of this program, and masks that are nowhere else."""
        entries = set(os.listdir(self.scan)) if os.path.isdir(self.scan) and not os.path.islink(self.scan) else None
        if entries is None or not ({"images", "sparse", "photographs.json"} <= entries <= OWN):
            raise Refused(f"{scan} is not a folder that this program alone has written, so --force does not replace it: give another --out")
        kept = os.path.join(self.scan, "masks")
        try:
            with open(os.path.join(self.scan, "photographs.json"), encoding="utf-8") as stream:
                taken_over = set(json.load(stream)["masks"])
        except (ValueError, KeyError, TypeError):
            taken_over = set()
        lost = sorted(set(os.listdir(kept)) - taken_over) if os.path.isdir(kept) else []
        if lost:
            raise Refused(f"{scan} holds masks that would be lost ({some(lost)}): move them into a folder `masks` beside the pictures, "
                          "from where they are taken over, or give another --out")

    def __enter__(self):
        while True:
            os.makedirs(os.path.dirname(self.path), exist_ok=True)
            os.makedirs(self.path, exist_ok=True)
            self.held = os.open(self.path, os.O_RDONLY | os.O_DIRECTORY)
            try:
                fcntl.flock(self.held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(self.held)
                raise Refused(f"another run is writing {self.scan}: wait until it has ended, or give another --out") from None
            # The folder may have been another run's, which has renamed or removed it in between.
            if os.path.isdir(self.path) and os.path.samestat(os.stat(self.path), os.fstat(self.held)):
                break
            os.close(self.held)
        for name in os.listdir(self.path):  # of a run that was killed
            path = os.path.join(self.path, name)
            shutil.rmtree(path) if os.path.isdir(path) and not os.path.islink(path) else os.remove(path)
        return self

    def done(self):
        """Gives the folder its name, in place of what was there."""
        before = self.scan + ".replaced"
        replaces = os.path.lexists(self.scan)
        if replaces:
            shutil.rmtree(before, ignore_errors=True)
            os.rename(self.scan, before)
        try:
            os.rename(self.path, self.scan)
        except OSError:
            if replaces:
                os.rename(before, self.scan)
            raise
        if replaces:
            shutil.rmtree(before, ignore_errors=True)

    def __exit__(self, *_):
        if os.path.isdir(self.path) and os.path.samestat(os.stat(self.path), os.fstat(self.held)):
            shutil.rmtree(self.path, ignore_errors=True)
        os.close(self.held)
