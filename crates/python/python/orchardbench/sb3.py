"""Many environments for Stable-Baselines3 (``pip install orchardbench[rl]``).

    from stable_baselines3 import PPO
    from orchardbench.sb3 import OrchardSB3
    model = PPO("MultiInputPolicy", OrchardSB3("Reach-v1", num_envs=8)).learn(100_000)

A single environment needs no adapter: ``gymnasium.make`` gives what Stable-Baselines3 takes.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from orchardbench._rows import row_of
from orchardbench._settings import Settings
from orchardbench._vector import Observations, OrchardVectorEnv

if TYPE_CHECKING:
    from typing_extensions import Unpack


class OrchardSB3(VecEnv):
    """A task in many worlds as the vector environment of Stable-Baselines3. The last observation of an episode is in
    ``infos[k]["terminal_observation"]``, and ``infos[k]["TimeLimit.truncated"]`` tells that it was cut off, so that its value is
    bootstrapped. ``infos[k]["episode"]`` and ``infos[k]["is_success"]`` are what its logger shows."""

    def __init__(self, task: str = "Harvest-v1", num_envs: int = 1, threads: int = 0, **settings: Unpack[Settings]) -> None:
        self.envs = OrchardVectorEnv(task, num_envs, AutoresetMode.SAME_STEP, threads, **settings)
        self._actions: NDArray[np.float32] | None = None
        super().__init__(num_envs, self.envs.single_observation_space, self.envs.single_action_space)

    def reset(self) -> Observations:
        unknown = sorted({key for options in self._options for key in options})
        if unknown:
            raise ValueError(f"unknown option {', '.join(unknown)}: these environments have none")
        observations, info = self.envs.reset(seed=self._seeds)
        self.reset_infos = [row_of(info, k) for k in range(self.num_envs)]
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: NDArray[np.float32]) -> None:
        self._actions = actions

    def step_wait(self) -> tuple[Observations, NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        if self._actions is None:
            raise RuntimeError("step_wait without step_async")
        observations, reward, terminated, truncated, info = self.envs.step(self._actions)
        self._actions = None
        dones = terminated | truncated
        infos = [row_of(info["final_info"] if dones[k] else info, k) for k in range(self.num_envs)]
        for k in np.flatnonzero(dones):
            statistics = infos[k]["statistics"]
            infos[k]["terminal_observation"] = info["final_obs"][k]
            infos[k]["TimeLimit.truncated"] = bool(truncated[k] and not terminated[k])
            infos[k]["episode"] = {"r": statistics["return"], "l": statistics["length"], "t": statistics["time"]}
        return observations, reward.astype(np.float32), dones, infos

    def close(self) -> None:
        self.envs.close()

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        value = None if attr_name == "render_mode" else getattr(self.envs, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: int | Iterable[int] | None = None) -> None:
        raise NotImplementedError("the environments share their settings, which do not change")

    def env_method(self, method_name: str, *args: Any, indices: int | Iterable[int] | None = None, **kwargs: Any) -> list[Any]:
        raise NotImplementedError(f"{method_name}: call it on `envs`, which steps all environments at once")

    def env_is_wrapped(self, wrapper_class: type, indices: int | Iterable[int] | None = None) -> list[bool]:
        # Statistics of episodes are in the infos, as those of a Monitor.
        from stable_baselines3.common.monitor import Monitor

        return [wrapper_class is Monitor for _ in self._get_indices(indices)]
