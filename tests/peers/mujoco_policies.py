"""Policies in a cell in MuJoCo that has masses, friction, a lagging arm, a camera and noise of its own, as if it were reality:

    python tests/peers/mujoco_policies.py identified twin/tasks/close_laptop.toml --out laptop_identified.toml
    python tests/peers/mujoco_policies.py demonstrate twin/tasks/close_laptop.toml --commands laptop_lerobot --out laptop_mujoco
    python tests/peers/mujoco_policies.py trials twin/tasks/close_laptop.toml --program target/release/twin \\
      --policy twin=ws://localhost:8000 --seed 1000 --episodes 60 --out twin.csv
    python tests/peers/mujoco_policies.py compare twin_0.csv twin_1.csv --to mujoco_0.csv mujoco_1.csv

`identified` writes the task file as identification would leave it: what is hidden, with errors as in mujoco_scene/hidden.py. `demonstrate`
sends the commands of a data set of the twin to the arm in MuJoCo from the same starts, and keeps what was a success, as a data set
that adapters/cloud_policy/train.py reads. `trials` writes a world for `calibration evaluate --worlds twin,FILE.csv`. `compare` says
how often each policy succeeds and the ratio of the first ones to the others, over starts and trainings.

    pip install -r tests/peers/requirements.txt pyarrow pillow tomli-w websockets msgpack; where there is no screen, MUJOCO_GL=egl
"""
import argparse
import csv
import io
import os
import shutil
import sys
import tomllib

from program import Failed, answer, built, ending_by_signals, note
from verdicts import wilson

try:
    import numpy as np
    import tomli_w

    from mujoco_cell.fr3 import DOF
    from mujoco_scene.acting import Stage
    from mujoco_scene.hidden import Hidden
except ModuleNotFoundError as missing:
    sys.exit(f"{missing.name} is not installed; the head of this file says how")

REALITY = 20  # the number by which all that is hidden is drawn
GOES_ON = 1.0  # [s] for which the last command is held, so that an arm that lags arrives


def read(path):
    with open(path, "rb") as stream:
        return tomllib.load(stream)


def whole(path, text):
    """Writes a file whole or not at all."""
    if os.path.exists(path):
        raise ValueError(f"{path} is there, and is kept; give another --out")
    beside = path + ".unfinished"
    with open(beside, "w") as stream:
        stream.write(text)
        stream.flush()
        os.fsync(stream.fileno())
    os.replace(beside, path)


def identified(given):
    whole(given.out, tomli_w.dumps(Hidden(read(given.task), given.reality).identified(given.reality)))


def commands(folder):
    """State, surroundings and actions of each episode of a data set, and the rate."""
    import json

    import pyarrow.parquet as parquet
    with open(os.path.join(folder, "meta", "info.json")) as stream:
        rate = json.load(stream)["fps"]
    table = parquet.read_table(os.path.join(folder, "data"), columns=["observation.state", "observation.environment_state", "action", "episode_index"])
    columns = [np.array(table[name].to_pylist()) for name in table.column_names]
    ends = np.flatnonzero(np.diff(columns[3])) + 1
    return [[part[0], around[0], actions] for part, around, actions in zip(*(np.split(column, ends) for column in columns[:3]))], rate


def demonstrate(given):
    if os.path.exists(given.out):
        raise ValueError(f"{given.out} is there, and is kept; give another --out")
    from mujoco_scene.written import Written
    stage = Stage(Hidden(read(given.task), given.reality), given.pictures)
    beside = given.out + ".unfinished"
    shutil.rmtree(beside, ignore_errors=True)
    found = [commands(folder) for folder in given.commands]
    episodes, rate = sum((episodes for episodes, _ in found), []), found[0][1]
    written = Written(beside, rate, stage)
    for number, (state, around, actions) in enumerate(episodes):
        acting, frames = stage.begin(stage.starts(state, around), number, state[-DOF:]), []
        for action in [*actions, *[actions[-1]] * round(GOES_ON * rate)]:
            frames.append((*acting.numbers(), *acting.seen(), action.astype(np.float32)))
            acting.act(action, 1 / rate)
            if acting.over:
                break
        if acting.success:
            written.episode(frames)
        note(f"episode {number + 1} of {len(episodes)}: {'kept' if acting.success else acting.fault or 'no success'}; {written.episodes} kept")
    written.close()
    os.replace(beside, given.out)


def trials(given):
    from mujoco_scene.asked import Policy
    name, address = given.policy.split("=", 1) if "=" in given.policy else ("policy", given.policy)
    policy, task = Policy(address), read(given.task)
    stage = Stage(Hidden(task, given.reality), policy.metadata.get("see") != "cloud")
    starts = answer([given.program, "task", given.task, "--json", "--episodes", str(given.episodes), "--seed", str(given.seed),
                     "--duration", "0.001"])["episodes"]
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["policy", "task", "start", "success"])
    wins = 0
    for count, start in enumerate(starts, 1):
        acting = stage.begin(start["bodies"], start["seed"])
        while not acting.over:
            for action in policy.actions(acting.observation())[:given.chunk]:
                acting.act(action, 1 / given.rate)
                if acting.over:
                    break
        wins += acting.success
        table.writerow([name, os.path.basename(given.task).removesuffix(".toml"), start["seed"], int(acting.success)])
        note(f"start {start['seed']}: {'success' if acting.success else acting.fault or 'not within the horizon'}; {wins} of {count}")
    whole(given.out, text.getvalue())
    print(f"{name}: {wins} of {len(starts)}")


def table(paths):
    """Successes (task, start): [trainings] of files that have the same starts, or those that all of them have."""
    found = []
    for path in paths:
        with open(path, newline="") as stream:
            found.append({(row["task"], row["start"]): int(row["success"]) for row in csv.DictReader(stream)})
    return {key: [one[key] for one in found] for key in found[0] if all(key in one for one in found)}


def ratios(first, second, draws=20000, seed=0):
    """Ratios [draws] of the mean success of the first [trainings, starts] to that of the second [trainings, starts], the starts being the same
    ones. Starts are drawn again for both sides together, trainings on each side by itself, one fewer than there are (Rao and Wu 1988:
    then the spread of a mean of few has no bias)."""
    generator = np.random.default_rng(seed)
    starts = generator.integers(first.shape[1], size=(draws, first.shape[1]))
    shares = []
    for side in (first, second):
        trainings = generator.integers(len(side), size=(draws, max(1, len(side) - 1)))
        shares.append(side[trainings[:, :, None], starts[:, None, :]].mean(axis=(1, 2)))
    with np.errstate(divide="ignore", invalid="ignore"):
        return shares[0] / shares[1]


def compare(given):
    first, second = table(given.first), table(given.to)
    both = sorted(set(first) & set(second))
    if not both:
        raise ValueError("the files have no start in common; give trials of the same task and --seed")
    sides = [np.array([side[key] for key in both]).T for side in (first, second)]
    for paths, side in zip((given.first, given.to), sides):
        for path, wins in zip(paths, side.sum(axis=1)):
            low, high = wilson(wins, len(both))
            print(f"{path}: {wins} of {len(both)}, {wins / len(both):.2f} [{low:.2f}, {high:.2f}]")
    low, high = np.nanquantile(ratios(*sides), [0.025, 0.975])
    drawn = "starts and trainings drawn again" if min(map(len, sides)) > 1 else "starts drawn again; what trainings scatter by needs several of each"
    one, other = (side.mean(axis=0) for side in sides)
    print(f"ratio {one.mean() / other.mean():.2f} [{low:.2f}, {high:.2f}] (95 %, {drawn}); {sides[0].sum()} of {sides[0].size} to {sides[1].sum()} of "
          f"{sides[1].size}; the first does better at {int((one > other).sum())} starts, the second at {int((one < other).sum())}")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    modes = parser.add_subparsers(required=True, metavar="MODE")
    for mode, what in ((identified, "the task file after identification"), (demonstrate, "a data set recorded in MuJoCo"), (trials, "a policy's trials")):
        inner = modes.add_parser(mode.__name__, help=what)
        inner.set_defaults(mode=mode)
        inner.add_argument("task", metavar="TASK.toml")
        inner.add_argument("--out", required=True, metavar="PATH", help="new")
        inner.add_argument("--reality", type=int, default=REALITY, metavar="N", help=f"what is hidden is drawn by it [default: {REALITY}]")
        if mode is demonstrate:
            inner.add_argument("--commands", required=True, nargs="+", metavar="DATASET", help="of the twin")
            inner.add_argument("--pictures", action="store_true", help="in colour, too")
        if mode is trials:
            inner.add_argument("--program", required=True, type=built, metavar="TWIN", help="the built `twin`, which draws the starts")
            inner.add_argument("--policy", required=True, metavar="[NAME=]ws://HOST:PORT")
            inner.add_argument("--episodes", type=int, default=60, metavar="N", help="[default: 60]")
            inner.add_argument("--seed", type=int, default=1000, metavar="S", help="the first start [default: 1000]")
            inner.add_argument("--rate", type=int, default=20, metavar="HZ", help="actions a second [default: 20]")
            inner.add_argument("--chunk", type=int, default=8, metavar="N", help="actions carried out of each answer [default: 8]")
    inner = modes.add_parser("compare", help="trials of two sorts of policies, a file for each training")
    inner.set_defaults(mode=compare)
    inner.add_argument("first", nargs="+", metavar="FIRST.csv")
    inner.add_argument("--to", nargs="+", required=True, metavar="SECOND.csv")
    return parser.parse_args()


def main():
    given = arguments()
    ending_by_signals()
    try:
        given.mode(given)
    except (ValueError, OSError, Failed) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
