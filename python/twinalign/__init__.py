"""What a recorded session says about a robot cell.

Sessions and clips as numpy arrays, identification and diagnosis with the answers of the command `calibration`, and the twin step
by step. Units are SI (m, kg, s, rad, N, N m), stamps integer nanoseconds, quaternions w, x, y, z, poses in the robot's base frame.
An error is a RuntimeError or ValueError of one line with a remedy; Ctrl-C ends long work within a moment.
"""
import json as _json
import os as _os
import tomllib as _tomllib

from . import _twinalign
from ._twinalign import Clip, Session, TaskEpisode

__all__ = ["Clip", "Session", "TaskEpisode", "Twin", "diagnose", "effects", "identify_arm", "identify_object"]


def _theta(parameters):
    """theta.toml as JSON, from a path or from a dict as it reads."""
    if parameters is None:
        return None
    if not isinstance(parameters, dict):
        with open(parameters, "rb") as stream:
            parameters = _tomllib.load(stream)
    return _json.dumps(parameters)


def _text(parameters):
    return parameters if parameters is None else _os.fspath(parameters)


def diagnose(session, *, cell=None, object=None, parameters=None, seed=0, torques=False, budget=None, engine=None, engine_limit=60.0,
             as_recorded=False, mix=False):
    """Where the twin differs from the cell, which effect causes it, and how far the gap shrinks with it.

    The answer is the JSON object of `calibration diagnose --json`: `verdict`, `gap`, `where`, `candidates`, `theta`, ...

    session: path of a session folder. cell: another cell.toml than its own. object: of several in cell.toml the one to judge, else
    the one that moves. parameters: what is known already, a path of a theta.toml or a dict of its content. seed: draws the split of the clips and the intervals. torques: explains measured torques
    along the measured motion. budget: after so many seconds the best answer so far counts. engine: command of another simulator
    (docs/engine.md), engine_limit: seconds it may take for one roll-out. as_recorded: takes data that cannot mean what they say.
    mix: takes clips of several cells together (two robots, or a robot and the simulation).
    """
    return _json.loads(_twinalign.diagnose(
        _os.fspath(session), cell=_text(cell), object=object, theta=_theta(parameters), seed=seed, torques=torques, budget=budget,
        engine_command=engine, engine_limit=engine_limit, as_recorded=as_recorded, mix=mix))


def identify_arm(session, *, cell=None, parameters=None, also=(), optimizer="least-squares", budget=4000, seed=0, out=None,
                 engine=None, engine_limit=60.0, mix=False):
    """Stiffness [N m/rad] and damping [N m s/rad] of every joint, and the parameters of the effects in `also`, with 95 % intervals.

    The answer is the JSON object of `calibration identify arm --json`: `parameters`, `not_identifiable`, `gap`, ...

    session: path of a session folder or of a clip beside a cell.toml. parameters: path of a theta.toml that is known already.
    optimizer: least-squares, pso or cma; the last two try `budget` points. out: path of the theta.toml that is written.
    engine, engine_limit, mix: as of `diagnose`.
    """
    return _json.loads(_twinalign.identify_arm(
        _os.fspath(session), cell=_text(cell), parameters=_text(parameters), also=list(also), optimizer=optimizer,
        budget=budget, seed=seed, out=_text(out), engine_command=engine, engine_limit=engine_limit, mix=mix))


def identify_object(session, *, cell=None, object=None, parameters=None, optimizer="least-squares", budget=1200, seed=0, out=None,
                    engine=None, engine_limit=60.0, mix=False):
    """Friction, mass [kg], centre of mass [m, object frame, from the geometric centre] and tip friction of the object.

    The answer is the JSON object of `calibration identify object --json`; `object`: of several in cell.toml the one to identify,
    else the one that moves; other arguments as of `identify_arm`.
    """
    return _json.loads(_twinalign.identify_object(
        _os.fspath(session), cell=_text(cell), object=object, parameters=_text(parameters), optimizer=optimizer, budget=budget,
        seed=seed, out=_text(out), engine_command=engine, engine_limit=engine_limit, mix=mix))


def effects():
    """Every effect that a real cell may have and the nominal twin lacks: a list of dicts with `name`, `stage` (control, hit, slide,
    camera), `confusable_with`, and `parameters`, each with `name`, `unit`, `numbers` (1, a count, or "joints": one for each),
    `plausible` [low, high], `resting` (the value that changes nothing; None: infinite), and `is_size`."""
    return _json.loads(_twinalign.effects())


class Twin(_twinalign.Twin):
    """The simulated cell under its joint impedance controller: 1 ms a step, deterministic.

    cell: path of a cell.toml. parameters: what was identified and diagnosed, a path of a theta.toml or a dict of its content.

    State, each a new array: `q` [dof] rad and `dq` [dof] rad/s as the encoders read them, `tau_J` [dof] N m behind the gears,
    `tau_J_d` [dof] N m asked for without gravity, `object_position` [3] m and `object_orientation` [4] w, x, y, z of the first
    object in the base frame (None without one), `contact_force` N, `time` s. `objects` has the same of every `[[object]]`: a dict
    from its name to (position [3] m, orientation [4]), with the links of an object that moves in itself as `NAME_LINK`; one that
    cell.toml gives no name is called `object`. `object_names` lists them in the order of cell.toml.

    `reset(objects={"cup": (position, orientation)})` puts objects where they are given, at rest; a link goes as near to its pose as
    its joint lets it. `render()` returns what the `[camera]` of cell.toml shows now: colour [rows, columns, 3] uint8 and depth
    [rows, columns] uint16 in mm, 0 where nothing is measured. `roll_out_named` is `roll_out` with the ways of all objects by name.
    """

    def __new__(cls, cell, parameters=None):
        return super().__new__(cls, _os.fspath(cell), _theta(parameters))
