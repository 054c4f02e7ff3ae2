"""The configuration by which LeRobot makes the environment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gymnasium.vector import VectorEnv
from lerobot.configs import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig
from lerobot.utils.constants import ACTION, OBS_ENV_STATE, OBS_IMAGES, OBS_STATE

from lerobot_env_orchardbench.env import LeRobotOrchard, make_envs


@EnvConfig.register_subclass("orchardbench")
@dataclass
class OrchardBenchEnv(EnvConfig):
    """``--env.type=orchardbench``; empty texts stand for the benchmark's own."""

    task: str | None = "Harvest-v1"
    fps: int = 10
    preset: str = ""
    scenario: str = ""
    robot: str = ""
    camera: str = ""
    control: str = "joint_delta"
    pixels_size: int = 128
    world: int = 0

    def __post_init__(self) -> None:
        env = LeRobotOrchard(**self.gym_kwargs)
        observed = env.observation_space.spaces
        self.features = {ACTION: PolicyFeature(type=FeatureType.ACTION, shape=env.action_space.shape or ())}
        self.features_map = {ACTION: ACTION}

        def feature(key: str, kind: FeatureType, shape: tuple[int, ...], name: str) -> None:
            self.features[key] = PolicyFeature(type=kind, shape=shape)
            self.features_map[key] = name

        feature("agent_pos", FeatureType.STATE, observed["agent_pos"].shape or (), OBS_STATE)
        if "environment_state" in observed:
            feature("environment_state", FeatureType.ENV, observed["environment_state"].shape or (), OBS_ENV_STATE)
        for camera, space in observed["pixels"].spaces.items():
            feature(f"pixels/{camera}", FeatureType.VISUAL, space.shape, f"{OBS_IMAGES}.{camera}")
        env.close()

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        given = {name: value for name in ("preset", "scenario", "robot", "camera") if (value := getattr(self, name))}
        shared = {"control": self.control, "control_hz": self.fps, "pixels_size": self.pixels_size, "world": self.world}
        return {"task": self.task, **shared, **given}

    def create_envs(self, n_envs: int, use_async_envs: bool = False) -> dict[str, dict[int, VectorEnv[Any, Any, Any]]]:
        return make_envs(n_envs, use_async_envs, **self.gym_kwargs)
