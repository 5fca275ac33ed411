"""Is the generator right? Records short sessions and replays them in the twin under the true gains and object, without and
with what is hidden. Without anything hidden next to nothing may be left; with a known effect in the twin as little.

    python tests/peers/check.py --program target/release/twin
"""
import argparse
import os
import sys
import tempfile

from program import Failed, answer, built, ending_by_signals, note

try:
    import numpy as np

    from mujoco_cell import session, world
except ModuleNotFoundError as missing:
    sys.exit(f"{missing.name} is not installed; `pip install -r tests/peers/requirements.txt` in a virtual environment")


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="Joints: mean over joints 1 to 6 of the root mean square, in microrad; box: mean and median ADD in mm. Nine minutes for\n"
               "all on one core.")
    parser.add_argument("--program", required=True, type=built, metavar="TWIN", help="the built `twin`")
    parser.add_argument("--only", default="", metavar="A,B", help="only these effects, or `nothing` [default: all]")
    parser.add_argument("--kinds", default="", metavar="A,B", help="only these kinds of sessions, as in run.py [default: all]")
    parser.add_argument("--seed", type=int, default=1, metavar="S")
    parser.add_argument("--clips", type=int, default=4, metavar="N", help="of each session [default: 4]")
    return parser.parse_args()


def cases(only, kinds):
    """Kind and place in its list of everything that is checked."""
    found = [("none-arm", None, "nothing"), ("none-strokes", None, "nothing")]
    for kind in ("arm", "hit", "slide", "camera", "arm-strokes"):
        found += [(kind, i, effect.name) for i, effect in enumerate(world.KINDS[kind][1])]
    return [case for case in found if (not only or case[2] in only) and (not kinds or case[0] in kinds)]


def left(program, folder, text):
    """What the twin leaves under parameters: microrad, and mean and median mm or nothing."""
    path = os.path.join(folder, "theta.toml")
    with open(path, "w") as stream:
        stream.write(text)
    clips = answer([program, "replay", os.path.join(folder, "session"), "--parameters", path, "--json"])["clips"]
    joints = 1e6 * np.mean([clip["joint_rms_rad"][:6] for clip in clips])
    box = [1e3 * clip["object_add_m"] for clip in clips if clip["object_add_m"] is not None]
    return f"{joints:9.1f} " + (f"{np.mean(box):7.2f} /{np.median(box):6.2f}" if box else f"{'-':>15s}")


def main():
    given = arguments()
    ending_by_signals()
    chosen = cases(given.only.split(",") if given.only else [], given.kinds.split(",") if given.kinds else [])
    if not chosen:
        sys.exit("nothing is called so; `run.py --help` lists the kinds, docs/effects.md the effects")
    print(f"{'kind':12s} {'hidden':27s} {'without: joints':>15s} {'box':>11s} {'with: joints':>15s} {'box':>10s}   size")
    for kind, which, name in chosen:
        with tempfile.TemporaryDirectory() as place:
            folder, drawn = os.path.join(place, "one"), world.draw(given.seed, 0, kind, which)
            try:
                session.record(drawn, folder, given.clips)
                without, with_ = (left(given.program, folder, session.theta(drawn, with_effects)) for with_effects in (False, True))
            except (session.Unusable, Failed) as error:
                note(f"{name}: {error}")
                continue
            sizes = "; ".join(f"{key} {value}" for effect in drawn.effects for key, value in effect.sizes().items())
            print(f"{kind:12s} {name:27s} {without:>27s} {with_:>27s}   {sizes[:90]}", flush=True)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
