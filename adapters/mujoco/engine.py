"""MuJoCo as the engine of `calibration diagnose` and `identify`: your model of the robot in place of the twin.

    calibration diagnose SESSION --engine 'python adapters/mujoco/engine.py --model cell.xml'

Where you have no model yet: `calibration export-model SESSION --to mjcf --out cell.xml` writes one from cell.toml.
"""
import argparse

import mujoco
import stroke
from arm import Arm
from protocol import serve


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", required=True, metavar="FILE.XML", help="MJCF or URDF of the robot with its tool")
    parser.add_argument("--joints", metavar="NAME,...", help="the model's joints in the order of cell.toml's [default: the same names]")
    parser.add_argument("--flange", metavar="BODY", help="the body whose frame is the flange's, for payloads [default: flange, attachment]")
    parser.add_argument("--step", type=float, default=0.5, metavar="MS", help="MuJoCo's time step in ms [default: 0.5]")
    parser.add_argument("--tool", default="tool", metavar="GEOM",
                        help="the geom that hits the object [default: tool, and where there is none the capsule of cell.toml on the flange]")
    parser.add_argument("--contact-step", type=float, default=0.25, metavar="MS",
                        help="MuJoCo's time step in ms while tool and object are near each other [default: 0.25]")
    parser.add_argument("--tip", type=solref, default=[0.002, 1.0], metavar="TIME,RATIO",
                        help="solref of tool and object: time constant in s and damping ratio [default: 0.002,1]")
    parser.add_argument("--table", type=solref, default=[0.003, 1.0], metavar="TIME,RATIO",
                        help="solref of object and table [default: 0.003,1]")
    parser.add_argument("--effects", metavar="NAME,...", help="only these are simulated here; `none`: none of them [default: all that it can]")
    return parser.parse_args()


def solref(text):
    time, ratio = map(float, text.split(","))
    return [time, ratio]


def main():
    given = arguments()
    arm, strokes = [], []

    def greet(cell):
        joints = given.joints.split(",") if given.joints else cell["joints"]
        arm[:] = [Arm(given.model, cell["cell"], joints, cell["period"], 1e-3 * given.step, given.flange)]
        strokes[:] = [stroke.Strokes(arm[0], cell["cell"], given)] if {"tool", "table"} <= set(cell["cell"]) else []
        known = arm[0].effects() | (stroke.EFFECTS if strokes else {})
        if given.effects is not None:
            known = {name: parameters for name, parameters in known.items() if name in given.effects.split(",")}
        return {"name": f"MuJoCo {mujoco.__version__}", "parameters": ["stiffness", "damping"] + (stroke.PARAMETERS if strokes else []),
                "effects": known, "readings": ["q", "dq", "tau_J", "tau_J_d"], "object": bool(strokes)}

    serve(greet, lambda asked: (strokes[0] if asked.object else arm[0]).roll_out(asked))


if __name__ == "__main__":
    main()
