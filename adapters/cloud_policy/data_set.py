"""Frames of a data set as `calibration export-episodes --to lerobot` writes it (LeRobot version 3.0), read with pyarrow alone."""
import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet

import seeing


class Frames:
    """All frames of some data sets. `state`, `action` [n, numbers] float32; `episode` [n]; `seen`: a cloud [up to 2048, 3] or a picture
    [96, 96, 3] of each; `rate` a second; `names` of the numbers."""

    def __init__(self, folders, camera_name, camera, given, said):
        self.state, self.action, self.episode, self.seen = [], [], [], []
        self.names = self.rate = None
        image = f"observation.images.{camera_name}" + ("_depth" if given.see == "cloud" else "")
        generator, before = np.random.default_rng(given.seed), 0
        for folder in map(Path, folders):
            info = folder / "meta" / "info.json"
            if not info.is_file():
                raise ValueError(f"{folder} is no data set; write one with `calibration export-episodes TASK CLIPS --to lerobot --out {folder}`")
            info = json.loads(info.read_text())
            if image not in info["features"]:
                raise ValueError(f"{folder} has no `{image}`; give --camera, or record the task with a [[camera]]")
            names = info["features"]["action"]["names"]
            if self.names not in (None, names) or self.rate not in (None, info["fps"]):
                raise ValueError(f"{folder} has other numbers or another rate than the data sets before it; train on each by itself")
            self.names, self.rate = names, info["fps"]
            files = sorted((folder / "data").glob("chunk-*/file-*.parquet"))
            for file in files:
                for batch in parquet.ParquetFile(file).iter_batches(256, columns=["observation.state", "action", "episode_index", image]):
                    column = batch.column
                    if given.episodes and before + column("episode_index")[0].as_py() >= given.episodes:
                        break
                    self.state += column("observation.state").to_pylist()
                    self.action += column("action").to_pylist()
                    self.episode += [before + episode for episode in column("episode_index").to_pylist()]
                    for picture in column(image).field("bytes"):
                        png = picture.as_py()
                        self.seen.append(camera.cloud(seeing.depth_of(png), generator) if given.see == "cloud" else seeing.small(png))
                    said(len(self.seen))
            before = max(self.episode, default=-1) + 1
        if not self.state:
            raise ValueError("there is no frame in the data; record episodes first")
        self.state, self.action = np.array(self.state, np.float32), np.array(self.action, np.float32)
        self.episode = np.array(self.episode)
        if given.episodes:
            kept = int(np.searchsorted(self.episode, given.episodes))
            self.keep(np.arange(kept))
        self.read = len(self.state)
        self.keep(moving(self.action, self.episode, given.still))

    def keep(self, rows):
        self.state, self.action, self.episode, self.seen = self.state[rows], self.action[rows], self.episode[rows], [self.seen[row] for row in rows]

    def chunks(self, horizon):
        """Which frames' actions follow each frame [n, horizon]; the last of an episode goes on at its end."""
        last = np.searchsorted(self.episode, self.episode, side="right") - 1
        return np.minimum(np.arange(len(self.episode))[:, None] + np.arange(horizon), last[:, None])


def moving(action, episode, still):
    """Rows of frames whose command [m, rad] is in some number at least `still` away from that of the last row before it in their episode, with
    the first and the last of each: where a script rests, one moment does not say whether the arm arrives or leaves."""
    rows = []
    for row in range(len(action)):
        ends = row in (0, len(action) - 1) or episode[row - 1] != episode[row] or episode[row] != episode[row + 1]
        if ends or np.abs(action[row] - action[rows[-1]]).max() >= still:
            rows.append(row)
    return np.array(rows)


class Scale:
    """Numbers to -1 .. 1 and back; what does not change in the data stays where it is."""

    def __init__(self, low, high):
        self.low, self.high = np.asarray(low, np.float32), np.asarray(high, np.float32)
        self.middle, self.half = 0.5 * (self.low + self.high), np.maximum(0.5 * (self.high - self.low), 1e-3).astype(np.float32)

    @classmethod
    def of(cls, rows):
        return cls(rows.min(axis=0), rows.max(axis=0))

    def to(self, rows):
        return (rows - self.middle) / self.half

    def back(self, rows):
        return rows * self.half + self.middle

    def kept(self):
        return {"low": self.low.tolist(), "high": self.high.tolist()}
