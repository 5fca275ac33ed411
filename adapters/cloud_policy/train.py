"""A diffusion policy on partial clouds (or on pictures), trained on demonstrations:

    twin task twin/tasks/close_laptop.toml --episodes 50 --noise 0.003 --record laptop
    calibration export-episodes twin/tasks/close_laptop.toml laptop --to lerobot --out laptop_lerobot
    python adapters/cloud_policy/train.py laptop_lerobot --task twin/tasks/close_laptop.toml --out laptop_policy

writes OUT/checkpoint.pt, every minute and at the end; the same command goes on after Ctrl-C, as if there had been none.
"""
import argparse
import math
import os
import signal
import sys
import time

try:
    import numpy as np
    import torch

    import checkpoint
    import seeing
    from data_set import Frames, Scale
    from network import Policy
except ModuleNotFoundError as missing:
    sys.exit(f"{missing.name} is not installed; `pip install -r adapters/cloud_policy/requirements.txt` in a virtual environment")

SAVED = 60.0  # [s]
SAID = 5.0  # [s]
RISING = 200  # steps in which the rate of learning rises


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", nargs="+", metavar="DATASET", help="data sets of one task")
    parser.add_argument("--task", required=True, metavar="FILE.toml", help="the task file: where its camera stands")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder of the checkpoint")
    parser.add_argument("--camera", metavar="NAME", help="of the task [default: its first]")
    parser.add_argument("--see", choices=["cloud", "pictures"], default="cloud", help="what is learned from [default: cloud]")
    parser.add_argument("--episodes", type=int, metavar="N", help="no more than the first so many [default: all]")
    parser.add_argument("--steps", type=int, default=3000, metavar="N", help="a trained policy goes on with more of them [default: 3000]")
    parser.add_argument("--batch", type=int, default=32, metavar="N", help="frames a step [default: 32]")
    parser.add_argument("--draws", type=int, default=8, metavar="N", help="of noise for each frame of a step [default: 8]")
    parser.add_argument("--points", type=int, default=256, metavar="N", help="of a cloud [default: 256]")
    parser.add_argument("--horizon", type=int, default=32, metavar="N", help="actions of a chunk [default: 32]")
    parser.add_argument("--parts", type=int, default=32, metavar="N", help="principal directions that a chunk is made of, at most [default: 32]")
    parser.add_argument("--rate", type=float, default=1e-3, metavar="X", help="of learning, at most [default: 0.001]")
    parser.add_argument("--scatter", type=float, default=0.002, metavar="M", help="one sigma added to points in training [default: 0.002]")
    parser.add_argument("--state-scatter", type=float, default=0.003, metavar="SHARE",
                        help="one sigma added to the state in training, of half its range [default: 0.003]")
    parser.add_argument("--still", type=float, default=0.005, metavar="X", help="frames are left out whose command is in every number "
                        "nearer than this [m, rad] to that of the last frame before that is kept; 0 leaves none out [default: 0.005]")
    parser.add_argument("--seed", type=int, default=0, metavar="S")
    parser.add_argument("--threads", type=int, default=1, metavar="N", help="of torch [default: 1]")
    return parser.parse_args()


class Ending:
    """Whether Ctrl-C or SIGTERM came; once training has begun it ends between two steps."""

    def __init__(self):
        self.asked = self.training = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self.ask)

    def ask(self, number, frame):
        self.asked = True
        if not self.training:
            raise KeyboardInterrupt


def note(text, end="\n"):
    print(text, end=end, file=sys.stderr, flush=True)


class Batches:
    """What a step learns from; it depends on the seed and the step's number alone."""

    def __init__(self, frames, given, scale):
        self.frames, self.given = frames, given
        self.states, self.actions = scale.to(frames.state), scale.to(frames.action)
        self.chunks = frames.chunks(given.horizon)

    def step(self, number):
        given, generator = self.given, np.random.default_rng([self.given.seed, number])
        rows = generator.integers(len(self.states), size=given.batch)
        if given.see == "cloud":
            seen = np.stack([seeing.drawn(self.frames.seen[row], given.points, generator) for row in rows])
            seen += generator.normal(0.0, given.scatter, seen.shape).astype(np.float32)
        else:
            seen = np.stack([self.changed(self.frames.seen[row], generator) for row in rows])
        state = self.states[rows] + generator.normal(0.0, given.state_scatter, (given.batch, self.states.shape[1])).astype(np.float32)
        return [torch.from_numpy(np.ascontiguousarray(part)) for part in (seen, state, self.actions[self.chunks[rows]])]

    @staticmethod
    def changed(picture, generator):
        """A picture [3, rows, columns] from 0 to 1, moved by up to four pixels, lighter or darker by up to a fifth, in other colours."""
        down, across = generator.integers(0, 9, size=2)
        moved = np.pad(picture, ((4, 4), (4, 4), (0, 0)), mode="edge")[down:down + seeing.PICTURE, across:across + seeing.PICTURE]
        light = generator.uniform(0.8, 1.2) * generator.uniform(0.9, 1.1, 3)
        return (moved.astype(np.float32) / 255 * light.astype(np.float32)).clip(0.0, 1.0).transpose(2, 0, 1)


def left(seconds):
    return f"{int(seconds) // 60} min {int(seconds) % 60} s" if seconds >= 60 else f"{int(seconds)} s"


class Training:
    def __init__(self, given, camera_name, camera, frames):
        self.given, self.path = given, os.path.join(given.out, checkpoint.NAME)
        given.parts = min(given.parts, given.horizon * len(frames.names))
        scale = Scale.of(np.concatenate([frames.state, frames.action]))
        self.settings = {key: value for key, value in vars(given).items() if key not in ("out", "threads", "data", "task", "camera")}
        self.kept = {"names": frames.names, "rate": frames.rate, "camera_name": camera_name, "camera": camera.kept(), "scale": scale.kept(),
                     "frames": len(frames.state), "settings": self.settings}
        torch.manual_seed(given.seed)
        self.batches = Batches(frames, given, scale)
        self.policy = Policy(given.see, len(frames.names), given.horizon, given.parts)
        self.policy.find_directions(*(torch.from_numpy(part) for part in (self.batches.states, self.batches.actions[self.batches.chunks])))
        self.mean = {key: value.clone() for key, value in self.policy.state_dict().items()}
        self.optimiser = torch.optim.AdamW(self.policy.parameters(), lr=given.rate, weight_decay=1e-4)
        self.done = 0
        if os.path.exists(self.path):
            self.go_on()

    def go_on(self):
        before = checkpoint.read(self.path)
        before["settings"]["steps"] = self.given.steps  # more of them go on from here
        differs = [key for key in self.kept if before.get(key) != self.kept[key]]
        if differs:
            raise ValueError(f"{self.path} is of another training ({', '.join(differs)}); give another --out, or remove it")
        self.policy.load_state_dict(before["weights"])
        self.optimiser.load_state_dict(before["optimiser"])
        self.mean, self.done = before["mean"], before["step"]

    def save(self):
        os.makedirs(self.given.out, exist_ok=True)
        checkpoint.write(self.path, {**self.kept, "step": self.done, "mean": self.mean, "weights": self.policy.state_dict(),
                                     "optimiser": self.optimiser.state_dict()})

    def step(self):
        given, number = self.given, self.done
        rate = given.rate * min(1.0, (number + 1) / RISING) * 0.5 * (1 + math.cos(math.pi * number / given.steps))
        for group in self.optimiser.param_groups:
            group["lr"] = rate
        generator = torch.Generator().manual_seed(given.seed * 1_000_003 + number)
        loss = self.policy.loss(*self.batches.step(number), given.draws, generator)
        self.optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.policy.parameters(), 1.0)
        self.optimiser.step()
        self.done += 1
        remembered = min(0.995, (1 + self.done) / (10 + self.done))
        for key, value in self.policy.state_dict().items():
            self.mean[key].lerp_(value, 1 - remembered)
        return float(loss.detach())

    def run(self, ending):
        began = saved = said = time.monotonic()
        first, losses = self.done, []
        while self.done < self.given.steps and not ending.asked:
            losses.append(self.step())
            now = time.monotonic()
            if now - saved > SAVED:
                self.save()
                saved = now
            if now - said > SAID or self.done == self.given.steps:
                remaining = (self.given.steps - self.done) * (now - began) / (self.done - first)
                note(f"step {self.done} of {self.given.steps}, loss {np.mean(losses):.4f}, {left(remaining)} left")
                said, losses = now, []
        self.save()


def main():
    given, ending = arguments(), Ending()
    if min(given.steps, given.batch, given.draws, given.points, given.horizon, given.parts, given.threads, given.episodes or 1) < 1:
        sys.exit("--episodes, --steps, --batch, --draws, --points, --horizon, --parts and --threads begin at 1")
    torch.set_num_threads(given.threads)
    try:
        camera_name, camera = seeing.Camera.of_task(given.task, given.camera)
        frames = Frames(given.data, camera_name, camera, given, lambda count: note(f"\r{count} frames read", end=""))
        note(f"\r{len(frames.state)} of {frames.read} frames move")
        training = Training(given, camera_name, camera, frames)
    except (ValueError, OSError) as error:
        sys.exit(str(error))
    ending.training = True
    note(f"goes on at step {training.done} of {given.steps}")
    training.run(ending)
    if training.done < given.steps:
        note(f"ended at step {training.done} of {given.steps}; the same command goes on")
        sys.exit(130)
    print(f"{training.path}: {given.steps} steps on {len(frames.state)} frames of {len(set(frames.episode))} episodes")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
