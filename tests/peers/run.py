"""How often does the diagnosis find what another engine hides? Draws worlds, records their sessions in MuJoCo, diagnoses
each, and prints a table of verdicts.

    python tests/peers/run.py --program target/release/calibration --out FOLDER --sessions 40
"""
import argparse
import json
import os
import sys
import time

import verdicts
from program import Failed, answer, built, ending_by_signals, note

try:
    import numpy as np

    from mujoco_cell import session, world
except ModuleNotFoundError as missing:
    sys.exit(f"{missing.name} is not installed; `pip install -r tests/peers/requirements.txt` in a virtual environment")

SHORT = 22
SINGLE = ("arm", "hit", "slide", "camera", "arm-strokes")
EPILOG = """
Each session lies in FOLDER/NUMBER_KIND: session/ is what a laboratory has, truth.json what is hidden, diagnosis.json the answer,
result.json the score. All are written whole or not at all: after Ctrl-C or a kill the same command goes on where it was, inside
of a diagnosis too. The table goes to standard output and to FOLDER/table.txt.

kinds, in turn until there are so many sessions:
  none-arm, none-strokes        nothing is hidden; in half of the strokes friction scatters twice as much as cell.toml says
  none-arm-logs                 nothing is hidden; commands logged at 1000 to 100 Hz and held or filled in by the controller, stamps that
                                jitter by up to a quarter of a millisecond, logs that begin while the arm moves
  arm, hit, slide, camera       one effect of the diagnosis's own list, each in turn, from a tenth of its usual size to three times
                                the largest plausible one
  arm-strokes                   one effect on the arm, seen in strokes
  pair-arm, pair-strokes        two of them
  outside-arm, outside-strokes  something that the list lacks: a sloshing load, a cable, a shaking base, a magnet, wind, a second object, ...

examples:
  run.py --program target/release/calibration --out peers --short             half an hour on two cores
  run.py --program target/release/calibration --out peers --sessions 200      a night
  run.py --out peers --sessions 20 --kinds slide,none-strokes                 records, diagnoses nothing
  run.py --program target/release/calibration --out tilt --sessions 5 --effect table_tilt
"""


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, metavar="FOLDER", help="where sessions and results go, or lie already")
    parser.add_argument("--program", type=built, metavar="CALIBRATION", help="the built `calibration`; without it sessions are only recorded")
    parser.add_argument("--sessions", type=int, default=40, metavar="N", help="how many [default: 40]")
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="another seed, other worlds [default: 1]")
    parser.add_argument("--kinds", default=",".join(world.KINDS), metavar="A,B", help="kinds of sessions, see below [default: all]")
    parser.add_argument("--effect", metavar="NAME", help="hide only this effect, by its name in docs/effects.md")
    parser.add_argument("--short", action="store_true", help=f"{SHORT} sessions")
    given = parser.parse_args()
    given.kinds = given.kinds.split(",")
    for kind in given.kinds:
        if kind not in world.KINDS:
            parser.error(f"no kind is called `{kind}`; there are {', '.join(world.KINDS)}")
    if given.effect is not None:
        given.kinds = [kind for kind in SINGLE if given.effect in names(kind)][:1]
        if not given.kinds:
            known = ", ".join(name for kind in SINGLE for name in names(kind))
            parser.error(f"no effect is called `{given.effect}`; there are {known}")
    if given.short:
        given.sessions = SHORT
    return given


def names(kind):
    return [effect.name for effect in world.KINDS[kind][1]]


def whole(path, text):
    """Writes a file whole or not at all."""
    beside = f"{path}.unfinished"
    with open(beside, "w") as stream:
        stream.write(text)
        stream.flush()
        os.fsync(stream.fileno())
    os.replace(beside, path)


def read(path):
    with open(path) as stream:
        return json.load(stream)


def same_draw(given):
    """Whether the folder holds sessions of this draw, or none yet."""
    path = os.path.join(given.out, "draw.json")
    draw = {"seed": given.seed, "kinds": given.kinds, "effect": given.effect}
    if not os.path.exists(path):
        whole(path, json.dumps(draw, indent=1) + "\n")
    return read(path) == draw


def which(given, kind, turn):
    """The effect of a kind's session number `turn`: all in an order drawn by lot, then again."""
    if given.effect is not None:
        return names(kind).index(given.effect)
    order = np.random.default_rng([given.seed, list(world.KINDS).index(kind)]).permutation(max(1, len(names(kind))))
    return int(order[turn % len(order)])


def recorded(given, number):
    """Folder of session `number`, recorded unless it is there."""
    kind, turn = given.kinds[number % len(given.kinds)], number // len(given.kinds)
    folder = os.path.join(given.out, f"{number:04d}_{kind}")
    if os.path.isdir(folder):
        return folder
    for attempt in range(6):
        drawn = world.draw(given.seed, number + 100_000 * attempt, kind, which(given, kind, turn))
        try:
            session.record(drawn, folder)
            return folder
        except session.Unusable as error:
            note(f"{folder}: {error}; another world is drawn")
    return None


def diagnosed(given, folder):
    """Result of a session, diagnosed unless it is there."""
    path = os.path.join(folder, "result.json")
    if os.path.exists(path):
        return read(path)
    truth, began = read(os.path.join(folder, "truth.json")), time.monotonic()
    out = os.path.join(folder, "diagnosis.json")
    try:
        command = [given.program, "diagnose", os.path.join(folder, "session"), "--out", out, "--force", "--json"]
        found = answer(command)
        verdict = found["verdict"]
    except Failed as error:
        note(f"{folder}: {error}")
        found, verdict = {}, {"kind": "failed", "effects": []}
    gap = found.get("gap") or {}
    before, floor = gap.get("before"), gap.get("floor")
    result = {
        "session": os.path.basename(folder), "kind": truth["kind"], "truth": truth["effects"], "outcome": verdicts.outcome(truth, verdict),
        "said": " ".join([verdict["kind"], *verdict["effects"]]), "confidence": verdict.get("confidence"),
        "shrink": (gap.get("shrink") or {}).get("value"), "gap": before / floor if before is not None and floor else None,
        "seconds": found.get("seconds", time.monotonic() - began)}
    whole(path, json.dumps(result, indent=1) + "\n")
    return result


def report(given, results):
    text = verdicts.table(results)
    whole(os.path.join(given.out, "table.txt"), text)
    print(text, end="", flush=True)


def main():
    given = arguments()
    ending_by_signals()
    try:
        os.makedirs(given.out, exist_ok=True)
    except OSError as error:
        sys.exit(f"{given.out}: {error.strerror}; give --out a folder that can be written")
    if not same_draw(given):
        sys.exit(f"{given.out} holds sessions of another --seed, --kinds or --effect; give another --out")
    results, times = [], []
    try:
        for number in range(given.sessions):
            began = time.monotonic()
            folder = recorded(given, number)
            if folder is None:
                continue
            done = f"{number + 1}/{given.sessions} {folder}"
            if given.program is not None:
                results.append(diagnosed(given, folder))
                last = results[-1]
                done += f": {'+'.join(last['truth']) or 'nothing'}: {last['outcome']}, said {last['said']}; {last['seconds']:.0f} s"
            times.append(time.monotonic() - began)
            # One that was there already takes no time.
            fresh = [took for took in times if took > 1.0]
            note(f"{done}; about {sum(fresh) / max(1, len(fresh)) * (given.sessions - number - 1) / 60:.0f} min left")
    except KeyboardInterrupt:
        note("interrupted; the same command goes on from here")
        if results:
            report(given, results)
        sys.exit(130)
    if given.program is not None:
        report(given, results)


if __name__ == "__main__":
    main()
