"""The environment with the keys that LeRobot knows."""

from __future__ import annotations

from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from orchardbench import OrchardEnv

STATE = ("agent_pos", "agent_vel", "forces")
"""Fields that LeRobot knows as ``agent_pos``, one after another."""
GOAL = "target"
"""Field that LeRobot knows as ``environment_state``."""


class LeRobotOrchard(gymnasium.Env[dict[str, Any], NDArray[np.float32]]):
    """A task in one world: ``agent_pos``, ``environment_state`` where the task names a target, and ``pixels`` by camera."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}

    def __init__(self, task: str = "Harvest-v1", render_mode: str | None = "rgb_array", **settings: Any) -> None:
        self._env = OrchardEnv(task, **{"obs": ("state", "pixels"), **settings})
        self.interface = self._env.interface
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": self.interface["spaces"]["control_hz"]}
        self.task = self.interface["task"]
        self.task_description = self.interface["task_description"]
        horizon, hz = self.interface["horizon"], self.interface["spaces"]["control_hz"]
        self._max_episode_steps = round(horizon * hz)
        self.action_space = self._env.action_space
        self._fields = {field["key"]: field for field in self.interface["observation"]}
        size = sum(self._fields[key]["shape"][0] for key in STATE if key in self._fields)
        observed: dict[str, spaces.Space[Any]] = {"agent_pos": spaces.Box(-np.inf, np.inf, (size,), np.float32)}
        if GOAL in self._fields:
            observed["environment_state"] = spaces.Box(-np.inf, np.inf, tuple(self._fields[GOAL]["shape"]), np.float32)
        cameras = {key.removeprefix("pixels_"): self._fields[key] for key in ("pixels_wrist", "pixels_base") if key in self._fields}
        if cameras:
            observed["pixels"] = spaces.Dict({name: spaces.Box(0, 255, tuple(field["shape"]), np.uint8) for name, field in cameras.items()})
        self.observation_space = spaces.Dict(observed)
        self._last: dict[str, Any] = {}

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[dict[str, Any], dict[str, Any]]:
        super().reset(seed=seed)
        observation, info = self._env.reset(seed=seed)
        return self._named(observation), info

    def step(self, action: NDArray[np.float32]) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self._env.step(np.asarray(action, dtype=np.float32))
        return self._named(observation), reward, terminated, truncated, info

    def render(self) -> NDArray[np.uint8] | None:
        pixels: dict[str, Any] = self._last.get("pixels", {})
        return pixels.get("base")

    def close(self) -> None:
        self._env.close()

    def _named(self, observation: dict[str, Any]) -> dict[str, Any]:
        named: dict[str, Any] = {"agent_pos": np.concatenate([observation[key] for key in STATE if key in observation])}
        if GOAL in observation:
            named["environment_state"] = observation[GOAL]
        pixels = {key.removeprefix("pixels_"): observation[key] for key in ("pixels_wrist", "pixels_base") if key in observation}
        if pixels:
            named["pixels"] = pixels
        self._last = named
        return named


def make_envs(n_envs: int = 1, use_async_envs: bool = False, **settings: Any) -> dict[str, dict[int, gymnasium.vector.VectorEnv[Any, Any, Any]]]:
    """Environments as LeRobot takes them; environment ``k`` has world ``k`` of a seed."""
    first = settings.pop("world", 0)
    makers = [partial(LeRobotOrchard, world=first + k, **settings) for k in range(n_envs)]
    mode = gymnasium.vector.AutoresetMode.SAME_STEP
    if use_async_envs and n_envs > 1:
        # Threads of an environment do not survive a fork.
        many: gymnasium.vector.VectorEnv[Any, Any, Any] = gymnasium.vector.AsyncVectorEnv(makers, autoreset_mode=mode, context="spawn")
    else:
        many = gymnasium.vector.SyncVectorEnv(makers, autoreset_mode=mode)
    return {"orchardbench": {0: many}}
