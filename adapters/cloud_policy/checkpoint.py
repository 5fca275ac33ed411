"""A checkpoint is one file, written whole or not at all: settings, camera, scales, weights, and what training needs to go on."""
import os

import torch

from data_set import Scale
from network import Policy
from seeing import Camera

NAME = "checkpoint.pt"


def write(path, content):
    beside = f"{path}.unfinished"
    with open(beside, "wb") as stream:
        torch.save(content, stream)
        stream.flush()
        os.fsync(stream.fileno())
    os.replace(beside, path)


def read(path):
    path = os.path.join(path, NAME) if os.path.isdir(path) else path
    try:
        # Tensors and plain values alone: a checkpoint of a stranger runs nothing.
        return torch.load(path, weights_only=True)
    except FileNotFoundError:
        raise ValueError(f"{path} is not there; train.py writes it") from None
    except Exception as error:
        raise ValueError(f"{path} is no checkpoint of train.py ({type(error).__name__})") from None


class Trained:
    """A policy out of a checkpoint, with the running mean of its weights."""

    def __init__(self, path):
        kept = read(path)
        self.settings, self.step = kept["settings"], kept["step"]
        if "parts" not in self.settings:
            raise ValueError(f"{path} is of an earlier train.py; train it again, with another --out")
        self.names, self.rate, self.camera_name = kept["names"], kept["rate"], kept["camera_name"]
        self.camera = Camera(**kept["camera"])
        self.scale = Scale(**kept["scale"])
        self.policy = Policy(self.settings["see"], len(self.names), self.settings["horizon"], self.settings["parts"])
        self.policy.load_state_dict(kept["mean"])
        self.policy.eval()
