"""Whether `lerobot-train` learns from what `calibration export-episodes --to lerobot` has written: an ACT policy for a few steps on
the processor, from random weights (nothing is fetched), and its checkpoint. Depth pictures are left out: ACT takes three channels.

    python3.12 -m venv lerobot && lerobot/bin/pip install "lerobot[training]==0.6.1"
    lerobot/bin/python tests/peers/lerobot_train.py carrot_lerobot

prints the command that it runs; more steps, a larger policy and a graphics card are options of that.
"""

import argparse
import json
import os
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path


def inputs(data):
    """What of the data set the policy sees: numbers, and pictures in colour."""
    features = json.loads((data / "meta" / "info.json").read_text())["features"]
    seen = {}
    for name, feature in features.items():
        shape = feature["shape"]
        if name.startswith("observation.images."):
            if not name.endswith("_depth"):
                seen[name] = {"type": "VISUAL", "shape": [shape[2], shape[0], shape[1]]}
        elif name == "observation.state":
            seen[name] = {"type": "STATE", "shape": shape}
        elif name == "observation.environment_state":
            seen[name] = {"type": "ENV", "shape": shape}
    return seen


def command(data, out, steps):
    return [
        str(Path(sys.executable).parent / "lerobot-train"),
        f"--dataset.repo_id=twinalign/{data.name}",
        f"--dataset.root={data}",
        "--policy.type=act",
        "--policy.device=cpu",
        "--policy.push_to_hub=false",
        "--policy.pretrained_backbone_weights=null",
        f"--policy.input_features={json.dumps(inputs(data))}",
        "--policy.chunk_size=20",
        "--policy.n_action_steps=20",
        "--policy.dim_model=128",
        "--policy.dim_feedforward=256",
        "--policy.n_encoder_layers=1",
        "--batch_size=2",
        "--num_workers=0",
        "--persistent_workers=false",
        f"--steps={steps}",
        "--log_freq=1",
        "--wandb.enable=false",
        f"--output_dir={out}",
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="the data set's folder")
    parser.add_argument("--steps", type=int, default=3, metavar="N", help="of training [default: 3]")
    given = parser.parse_args()
    data = given.data.resolve()
    if not (data / "meta" / "info.json").is_file():
        sys.exit(f"{data} is no LeRobot data set; write one with `calibration export-episodes TASK CLIPS --to lerobot --out {given.data}`")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "trained"
        words = command(data, out, given.steps)
        print(shlex.join(words))
        sys.stdout.flush()
        began = time.monotonic()
        done = subprocess.run(words, capture_output=True, text=True, env={**os.environ, "HF_HUB_OFFLINE": "1"})
        said = done.stdout + done.stderr
        if done.returncode:
            print(said[-3000:], file=sys.stderr)
            sys.exit(f"lerobot-train ended with {done.returncode}")
        losses = [line.split("loss:")[1].split()[0] for line in said.splitlines() if "loss:" in line]
        weights = {path.resolve() for path in out.glob("checkpoints/*/pretrained_model/model.safetensors")}
        print(f"{given.steps} steps in {time.monotonic() - began:.0f} s; losses {', '.join(losses)}; {len(weights)} checkpoint")
        sys.exit(0 if weights and len(losses) == given.steps else "it trained, but wrote no checkpoint or no loss for each step")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
