"""Draws how far the twin is from a clip, joint by joint: `python plot_gap.py SESSION [--parameters theta.toml] [--clip N] --out gap.png`.

Needs matplotlib (`pip install "twinalign[examples]"`).
"""
import argparse

import matplotlib
import numpy as np
import twinalign

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("session", metavar="SESSION")
    parser.add_argument("--parameters", metavar="THETA.TOML", help="what was identified [default: cell.toml's nominal values]")
    parser.add_argument("--clip", type=int, default=0, metavar="N")
    parser.add_argument("--out", required=True, metavar="FILE.PNG")
    return parser.parse_args()


def in_force(clip, ticks_ns):
    """The newest command at each tick."""
    row = np.searchsorted(clip.command_stamps_ns, ticks_ns, side="right") - 1
    return clip.q_d[np.maximum(row, 0)], clip.dq_d[np.maximum(row, 0)]


def main():
    given = arguments()
    session = twinalign.Session(given.session)
    clip = session[given.clip]
    twin = twinalign.Twin(session.folder / "cell.toml", given.parameters)
    twin.reset(q=clip.q[0], dq=clip.dq[0])
    ticks_ns = np.arange(clip.stamps_ns[0], clip.stamps_ns[-1], 1_000_000, dtype=np.uint64)
    q, _, _, _ = twin.roll_out(*in_force(clip, ticks_ns))
    t = (ticks_ns + 1_000_000 - clip.stamps_ns[0]) * 1e-9
    figure, axes = plt.subplots(len(clip.joint_names), sharex=True, figsize=(9, 1.4 * len(clip.joint_names)))
    for joint, (axis, name) in enumerate(zip(np.atleast_1d(axes), clip.joint_names)):
        measured = np.interp(t, (clip.stamps_ns - clip.stamps_ns[0]) * 1e-9, clip.q[:, joint])
        gap = 1e3 * (measured - q[:, joint])
        axis.plot(t, gap, linewidth=0.8)
        axis.set_ylabel(f"{name}\n[mrad]", fontsize=7)
        print(f"{name}: {np.sqrt(np.mean(gap**2)):.4f} mrad root mean square")
    axis.set_xlabel("t [s]")
    figure.tight_layout()
    figure.savefig(given.out, dpi=120)


if __name__ == "__main__":
    main()
