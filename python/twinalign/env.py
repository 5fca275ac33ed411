"""Tasks of the twin as Gymnasium environments.

    import gymnasium
    import twinalign.env

    env = gymnasium.make("twinalign/Task-v0", task="twin/tasks/pick_carrot.toml", cell="config/fr3_cell.toml")
    observation, info = env.reset(seed=3)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

Observations and actions are those of demonstrations that `calibration export-episodes` writes, so that a policy trained on them acts
here without more ado: `agent_pos` is `observation.state`, `environment_state` the poses of free bodies, `pixels` a picture of each
camera, an action `action`. The seed of a reset draws the same start as `twin task --seed` and `calibration evaluate --seed`.
"""
import os as _os

import gymnasium as _gymnasium
import numpy as _np

from . import _twinalign, _theta

__all__ = ["TaskEnv", "cloud"]

_FAR = 1e3


class TaskEnv(_gymnasium.Env):
    """A task in which a policy acts.

    task: path of a task file. cell: path of a cell.toml: its arm carries the task out under its controller; None: the arm is where it
    is commanded to be. parameters: what was identified of that cell, a path of a theta.toml or a dict of its content. rate: actions a second,
    which divides 100. pictures: whether `pixels` are drawn; depth: whether `depth` is, too.

    Observation, a dict: `agent_pos` [n] float32, `environment_state` [m] float32 where there is any, `pixels` {camera: [rows, columns, 3]
    uint8}, `depth` {camera: [rows, columns, 1] uint16, mm, 0 where nothing is}. `state_names` and `surroundings_names` say which number is what.
    Action [n] float32, in the order of `state_names`: where everything that is commanded is to be after 1 / rate s.
    Reward: how much farther it came towards success, 1 in all. Terminated: success, or whatever would stop a robot (`info["fault"]`).
    Truncated: the horizon. `info`: `is_success`, `progress`, `time` s, `fault`.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}

    def __init__(self, task, cell=None, parameters=None, rate=20, pictures=True, depth=False, render_mode=None):
        self._episode = _twinalign.TaskEpisode(
            _os.fspath(task), None if cell is None else _os.fspath(cell), _theta(parameters))
        if rate < 1 or self._episode.rows_a_second % rate:
            raise ValueError(f"rate {rate} does not divide {self._episode.rows_a_second} a second; give 1, 2, 4, 5, 10, 20, 25, 50 or 100")
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode {render_mode!r} does not exist; give rgb_array or None")
        self.metadata = dict(self.metadata, render_fps=rate)
        self.render_mode, self.rate = render_mode, rate
        self.task, self.task_description = self._episode.name, self._episode.instruction
        self.state_names, self.surroundings_names = self._episode.state_names, self._episode.surroundings_names
        self._rows = self._episode.rows_a_second // rate
        self._max_episode_steps = int(round(self._episode.horizon * rate))
        self._cameras = [name for name, *_ in self._episode.cameras] if pictures else []
        self._depth = depth and pictures
        self._progress = 0.0
        spaces = _gymnasium.spaces
        numbers = lambda names: spaces.Box(-_FAR, _FAR, (len(names),), _np.float32)
        observed = {"agent_pos": numbers(self.state_names)}
        if self.surroundings_names:
            observed["environment_state"] = numbers(self.surroundings_names)
        if self._cameras:
            shape = {name: (rows, columns) for name, rows, columns, _ in self._episode.cameras}
            observed["pixels"] = spaces.Dict({name: spaces.Box(0, 255, (*shape[name], 3), _np.uint8) for name in self._cameras})
            if self._depth:
                observed["depth"] = spaces.Dict({name: spaces.Box(0, 65535, (*shape[name], 1), _np.uint16) for name in self._cameras})
        self.observation_space = spaces.Dict(observed)
        self.action_space = numbers(self.state_names)

    @property
    def cameras(self):
        """Of each camera by name: focal length in pixels; the middle of the picture is its centre."""
        return {name: focal for name, _, _, focal in self._episode.cameras}

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        # Without a seed another start each time, drawn by the seed before.
        start = seed if seed is not None else int(self.np_random.integers(2**31))
        self._episode.reset(start)
        self._progress = 0.0
        return self._observed(), {"is_success": False, "progress": 0.0, "time": 0.0, "fault": "", "start": start}

    def step(self, action):
        action = _np.asarray(action, dtype=_np.float32).reshape(-1)
        success, progress, over, time, fault = self._episode.step(action, self._rows)
        reward, self._progress = progress - self._progress, progress
        info = {"is_success": success, "progress": progress, "time": time, "fault": fault or ""}
        ended = success or fault is not None
        return self._observed(), float(reward), ended, over and not ended, info

    def render(self):
        if self.render_mode != "rgb_array" or not self._episode.cameras:
            return None
        return self._episode.pictures()[0][0]

    def _observed(self):
        observed = {"agent_pos": self._episode.state()}
        if self.surroundings_names:
            observed["environment_state"] = self._episode.surroundings()
        if self._cameras:
            pictures = self._episode.pictures()
            observed["pixels"] = {name: colour for name, (colour, _) in zip(self._cameras, pictures)}
            if self._depth:
                observed["depth"] = {name: depth[..., None] for name, (_, depth) in zip(self._cameras, pictures)}
        return observed


def cloud(depth, focal, points=1024, seed=0):
    """A partial point cloud [points, 3] float32 in the camera's axes (x right, y down, z forward, m) of a depth picture in mm.

    depth: [rows, columns] or [rows, columns, 1]. focal: pixels. Points are drawn by `seed` out of those that are there, again where there are
    fewer; zeros where there are none.
    """
    depth = _np.asarray(depth)
    depth = depth.reshape(depth.shape[0], depth.shape[1]).astype(_np.float32) * 1e-3
    rows, columns = _np.nonzero(depth)
    if rows.size == 0:
        return _np.zeros((points, 3), _np.float32)
    chosen = _np.random.default_rng(seed).choice(rows.size, points, replace=rows.size < points)
    rows, columns = rows[chosen], columns[chosen]
    z = depth[rows, columns]
    x = (columns - 0.5 * (depth.shape[1] - 1)) * z / focal
    y = (rows - 0.5 * (depth.shape[0] - 1)) * z / focal
    return _np.stack([x, y, z], axis=1).astype(_np.float32)


_gymnasium.register("twinalign/Task-v0", entry_point=TaskEnv)
