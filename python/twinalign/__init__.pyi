"""What a recorded session says about a robot cell. Units SI, stamps in ns, quaternions w, x, y, z, poses in the base frame."""
from os import PathLike
from pathlib import Path
from typing import Any, Iterable, Literal, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

_Path = str | PathLike[str]
_Floats = NDArray[np.float64]
_Stamps = NDArray[np.uint64]
_Optimizer = Literal["least-squares", "pso", "cma"]

class Session:
    """A folder with cell.toml and clips, or one clip beside a cell.toml. `session[i]` reads a clip."""
    def __init__(self, path: _Path, *, cell: _Path | None = None, object: str | None = None) -> None: ...
    @property
    def folder(self) -> Path: ...
    @property
    def cell_toml(self) -> str:
        """cell.toml as it stands there."""
    @property
    def files(self) -> list[Path]:
        """The clips' files, in the order of cell.toml."""
    def __len__(self) -> int: ...
    def __getitem__(self, index: int) -> Clip: ...

class Clip:
    """One recorded motion. Arrays are the reader's own memory, not copies; what was not logged is None."""
    @property
    def file(self) -> Path: ...
    @property
    def kind(self) -> Literal["excitation", "control_hit_slide", "free_motion"]: ...
    @property
    def joint_names(self) -> list[str]: ...
    @property
    def stamps_ns(self) -> _Stamps:
        """Of what was measured [rows], ns."""
    @property
    def q(self) -> _Floats | None:
        """Measured positions [rows, joints], rad."""
    @property
    def dq(self) -> _Floats | None:
        """Measured velocities [rows, joints], rad/s."""
    @property
    def tau_J(self) -> _Floats | None:
        """Measured torques behind the gears, gravity included [rows, joints], N m."""
    @property
    def command_stamps_ns(self) -> _Stamps:
        """Of the commands [rows], ns."""
    @property
    def q_d(self) -> _Floats | None:
        """Desired positions [rows, joints], rad."""
    @property
    def dq_d(self) -> _Floats | None:
        """Desired velocities [rows, joints], rad/s."""
    @property
    def tau_J_d(self) -> _Floats | None:
        """Desired torques without gravity [rows, joints], N m."""
    @property
    def object_stamps_ns(self) -> _Stamps:
        """Of the object's poses [poses], ns."""
    @property
    def object_position(self) -> _Floats | None:
        """Geometric centre in the base frame [poses, 3], m."""
    @property
    def object_orientation(self) -> _Floats | None:
        """Quaternions w, x, y, z in the base frame [poses, 4]."""
    @property
    def others(self) -> dict[str, tuple[_Stamps, _Floats | None, _Floats | None]]:
        """Of the other objects of cell.toml, by name: stamps, positions, quaternions as of the object."""
    @property
    def warnings(self) -> list[str]: ...

class TaskEpisode:
    """A task in which a policy acts, as `twinalign.env.TaskEnv` without Gymnasium: rows of 10 ms."""
    def __init__(self, task: _Path, cell: _Path | None = None, theta: str | None = None) -> None:
        """`theta`: content of a theta.toml as JSON."""
    @property
    def name(self) -> str: ...
    @property
    def instruction(self) -> str: ...
    @property
    def horizon(self) -> float:
        """s."""
    @property
    def rows_a_second(self) -> int: ...
    @property
    def state_names(self) -> list[str]: ...
    @property
    def surroundings_names(self) -> list[str]: ...
    @property
    def cameras(self) -> list[tuple[str, int, int, float]]:
        """Name, rows, columns, focal length in pixels."""
    def reset(self, seed: int) -> None: ...
    def step(self, action: NDArray[np.float32], rows: int) -> tuple[bool, float, bool, float, str | None]:
        """Success, progress 0 to 1, whether it is over, time s, what would have stopped a robot."""
    def state(self) -> NDArray[np.float32]: ...
    def surroundings(self) -> NDArray[np.float32]: ...
    def pictures(self) -> list[tuple[NDArray[np.uint8], NDArray[np.uint16]]]:
        """Of each camera colour [rows, columns, 3] and depth [rows, columns], mm."""

class Twin:
    """The simulated cell under its joint impedance controller: 1 ms a step, deterministic."""
    def __init__(self, cell: _Path, parameters: _Path | dict[str, Any] | None = None) -> None: ...
    @property
    def dof(self) -> int: ...
    def reset(
        self,
        *,
        q: _Floats | None = None,
        dq: _Floats | None = None,
        object_position: Iterable[float] | None = None,
        object_orientation: Iterable[float] | None = None,
        objects: Mapping[str, tuple[_Floats | Sequence[float], _Floats | Sequence[float]]] | None = None,
    ) -> None:
        """Everything back where cell.toml has it, or where it is given: q [dof] rad, dq [dof] rad/s, position [3] m and quaternion
        w, x, y, z [4] of the first object, and the same of any by its name in `objects`; at rest. ValueError, and everything where
        cell.toml has it, where two of them would overlap. A link goes as near to its pose as its joint lets it."""
    def step(self, q_d: _Floats, dq_d: _Floats | None = None, periods: int = 1) -> None:
        """Lets `periods` of 1 ms pass under desired positions [dof] rad and velocities [dof] rad/s (0 where None)."""
    def roll_out(self, q_d: _Floats, dq_d: _Floats) -> tuple[_Floats, _Floats, _Floats | None, _Floats | None]:
        """Plays commands [rows, dof], one each 1 ms. States at the end of each: q, dq [rows, dof], object position [rows, 3] and
        orientation [rows, 4] of the first object, None without one. Other threads run meanwhile."""
    def roll_out_named(
        self, q_d: _Floats, dq_d: _Floats
    ) -> tuple[_Floats, _Floats, dict[str, tuple[_Floats, _Floats]]]:
        """The same with position [rows, 3], m, and orientation [rows, 4] of every object by its name."""
    def render(self) -> tuple[NDArray[np.uint8], NDArray[np.uint16]]:
        """What the `[camera]` of cell.toml shows now, with all objects: colour [rows, columns, 3] and depth [rows, columns], mm, 0
        where nothing is measured. Its noise begins anew at a reset."""
    @property
    def time(self) -> float:
        """Simulated, s."""
    @property
    def q(self) -> _Floats:
        """What the encoders read [dof], rad."""
    @property
    def dq(self) -> _Floats:
        """[dof], rad/s."""
    @property
    def tau_J(self) -> _Floats:
        """Behind the gears, gravity included, mean over the last 1 ms [dof], N m."""
    @property
    def tau_J_d(self) -> _Floats:
        """Asked for, without gravity [dof], N m."""
    @property
    def object_position(self) -> _Floats | None:
        """Geometric centre of the first object in the base frame [3], m."""
    @property
    def object_orientation(self) -> _Floats | None:
        """Quaternion w, x, y, z of the first object in the base frame [4]."""
    @property
    def object_names(self) -> list[str]:
        """Of every `[[object]]` in the order of cell.toml, with the links (`NAME_LINK`) of one that moves in itself; `object` for one
        without a name."""
    @property
    def objects(self) -> dict[str, tuple[_Floats, _Floats]]:
        """By name: geometric centre in the base frame [3], m, and quaternion w, x, y, z [4]; of a link its own frame."""
    @property
    def contact_force(self) -> float:
        """Between tool and objects, N."""

def diagnose(
    session: _Path,
    *,
    cell: _Path | None = None,
    object: str | None = None,
    parameters: _Path | dict[str, Any] | None = None,
    seed: int = 0,
    torques: bool = False,
    budget: float | None = None,
    engine: str | None = None,
    engine_limit: float = 60.0,
    as_recorded: bool = False,
    mix: bool = False,
) -> dict[str, Any]:
    """The JSON object of `calibration diagnose --json`."""

def identify_arm(
    session: _Path,
    *,
    cell: _Path | None = None,
    parameters: _Path | None = None,
    also: Iterable[str] = (),
    optimizer: _Optimizer = "least-squares",
    budget: int = 4000,
    seed: int = 0,
    out: _Path | None = None,
    engine: str | None = None,
    engine_limit: float = 60.0,
    mix: bool = False,
) -> dict[str, Any]:
    """The JSON object of `calibration identify arm --json`."""

def identify_object(
    session: _Path,
    *,
    cell: _Path | None = None,
    object: str | None = None,
    parameters: _Path | None = None,
    optimizer: _Optimizer = "least-squares",
    budget: int = 1200,
    seed: int = 0,
    out: _Path | None = None,
    engine: str | None = None,
    engine_limit: float = 60.0,
    mix: bool = False,
) -> dict[str, Any]:
    """The JSON object of `calibration identify object --json`."""

def effects() -> list[dict[str, Any]]:
    """Every effect: name, stage, parameters (name, unit, numbers, plausible, resting, is_size), confusable_with."""
