"""Tasks of twinalign as environments of LeRobot 0.6: `lerobot-eval --policy.path=... --env.type=twinalign --env.task=twin/tasks/pick_carrot.toml`.

Observations come under the names that `calibration export-episodes` gives them: `observation.state`, `observation.environment_state`,
`observation.images.CAMERA`.
"""
from dataclasses import dataclass, field

from lerobot.configs import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig
from lerobot.utils.constants import ACTION, OBS_ENV_STATE, OBS_IMAGES, OBS_STATE

import twinalign.env


@EnvConfig.register_subclass("twinalign")
@dataclass
class TwinalignEnv(EnvConfig):
    """task: path of a task file. cell, parameters: paths of a cell.toml and a theta.toml, as of `twinalign.env.TaskEnv`."""

    task: str | None = None
    fps: int = 20
    cell: str | None = None
    parameters: str | None = None
    pictures: bool = True
    features: dict[str, PolicyFeature] = field(default_factory=dict)
    features_map: dict[str, str] = field(default_factory=dict)

    def __post_init__(self):
        if self.task is None:
            return
        env = twinalign.env.TaskEnv(**self.arguments())
        spaces = env.observation_space.spaces
        state = PolicyFeature(type=FeatureType.STATE, shape=spaces["agent_pos"].shape)
        self.features = {"agent_pos": state, ACTION: PolicyFeature(type=FeatureType.ACTION, shape=env.action_space.shape)}
        self.features_map = {"agent_pos": OBS_STATE, ACTION: ACTION}
        if "environment_state" in spaces:
            self.features["environment_state"] = PolicyFeature(type=FeatureType.ENV, shape=spaces["environment_state"].shape)
            self.features_map["environment_state"] = OBS_ENV_STATE
        for camera, space in spaces["pixels"].spaces.items() if "pixels" in spaces else ():
            self.features[f"pixels/{camera}"] = PolicyFeature(type=FeatureType.VISUAL, shape=space.shape)
            self.features_map[f"pixels/{camera}"] = f"{OBS_IMAGES}.{camera}"

    def arguments(self):
        return {"task": self.task, "cell": self.cell, "parameters": self.parameters, "rate": self.fps, "pictures": self.pictures}

    @property
    def package_name(self) -> str:
        return "twinalign.env"

    @property
    def gym_id(self) -> str:
        return "twinalign/Task-v0"

    @property
    def gym_kwargs(self) -> dict:
        return dict(self.arguments(), render_mode="rgb_array")
