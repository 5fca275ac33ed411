"""Scripted policies of several qualities on the tasks that ship, in MuJoCo, as a world for `calibration evaluate`:

    python tests/peers/mujoco_trials.py --program target/release/twin --episodes 60 --out mujoco.csv
    calibration evaluate --policies expert expert:noise=0.005 expert:noise=0.015 --tasks twin/tasks/*.toml --worlds twin,mujoco.csv \\
      --episodes 200 --out against_mujoco

Starts are the twin's; deviates of way points are drawn here, so that a policy with noise is another draw of the same policy.
"""
import argparse
import csv
import io
import os
import sys
import tomllib

from program import Failed, answer, built, ending_by_signals, note

try:
    import numpy as np

    from mujoco_scene.run import Scene
except ModuleNotFoundError as missing:
    sys.exit(f"{missing.name} is not installed; `pip install -r tests/peers/requirements.txt` in a virtual environment")

TASKS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "twin", "tasks")


def trial(task, bodies, noise, seed):
    """Whether an episode is a success before the horizon."""
    scene = Scene(task, bodies, noise=noise, generator=np.random.default_rng(seed))
    needed, held = round(task.get("hold", 0.5) / scene.step), 0
    for i in range(round(task["horizon"] / scene.step)):
        scene.advance(i)
        held = held + 1 if scene.succeeds() else 0
        if held >= needed:
            return True
    return False


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, type=built, metavar="TWIN", help="the built `twin`")
    parser.add_argument("--tasks", default="", metavar="FILE,..", help="names of files in twin/tasks/ [default: all]")
    parser.add_argument("--noise", default="0,0.005,0.015", metavar="M,..", help="one sigma of each policy [default: 0,0.005,0.015]")
    parser.add_argument("--episodes", type=int, default=60, metavar="N", help="of each policy on each task [default: 60]")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="the first start [default: 0]")
    parser.add_argument("--out", required=True, metavar="FILE.csv", help="new file")
    given = parser.parse_args()
    ending_by_signals()
    if os.path.exists(given.out):
        sys.exit(f"{given.out} is there, and is kept; give another --out")
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["policy", "task", "start", "success"])
    for name in given.tasks.split(",") if given.tasks else sorted(os.listdir(TASKS)):
        path = os.path.join(TASKS, name)
        with open(path, "rb") as stream:
            task = tomllib.load(stream)
        try:
            starts = answer([given.program, "task", path, "--json", "--episodes", str(given.episodes), "--seed", str(given.seed),
                             "--duration", "0.001"])["episodes"]
        except Failed as error:
            sys.exit(str(error))
        for noise in given.noise.split(","):
            policy = "expert" if float(noise) == 0 else f"expert:noise={noise}"
            wins = 0
            for start in starts:
                won = trial(task, start["bodies"], float(noise), start["seed"])
                wins += won
                table.writerow([policy, name.removesuffix(".toml"), start["seed"], int(won)])
            note(f"{policy} on {name}: {wins} of {len(starts)}")
    beside = given.out + ".unfinished"
    with open(beside, "w") as stream:
        stream.write(text.getvalue())
        stream.flush()
        os.fsync(stream.fileno())
    os.replace(beside, given.out)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
