"""Many environments for PufferLib 3, which are written into its buffers.

    import pufferlib.vector
    from orchardbench.pufferlib import OrchardPuffer
    envs = pufferlib.vector.make(OrchardPuffer, env_kwargs={"task": "Reach-v1", "num_envs": 8})
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from pufferlib import PufferEnv

from orchardbench._settings import Settings
from orchardbench._vector import OrchardVectorEnv

if TYPE_CHECKING:
    from typing_extensions import Unpack

Infos = list[dict[str, float]]


class OrchardPuffer(PufferEnv):
    """A task in many worlds as a native environment of PufferLib. An observation is one row of float32: all numbers of all fields, one field after
    another in the order of ``envs.interface["observation"]``; ``columns`` tells which are whose."""

    def __init__(
        self,
        task: str = "Harvest-v1",
        num_envs: int = 1,
        threads: int = 0,
        buf: dict[str, NDArray[Any]] | None = None,
        seed: int = 0,
        **settings: Unpack[Settings],
    ) -> None:
        self.envs = OrchardVectorEnv(task, num_envs, AutoresetMode.SAME_STEP, threads, **settings)
        fields = {field["key"]: field for field in self.envs.interface["observation"]}
        if "task_description" in fields:
            raise ValueError("obs task_description: PufferLib's observations are numbers")
        self._fields = {key: np.zeros((num_envs, *field["shape"]), field["dtype"]) for key, field in fields.items()}
        self.columns: dict[str, slice] = {}
        size = 0
        for key, values in self._fields.items():
            self.columns[key] = slice(size, size := size + values[0].size)
        self.single_observation_space = spaces.Box(-np.inf, np.inf, (size,), np.float32)
        self.single_action_space = self.envs.single_action_space
        self.num_agents = num_envs
        self._seed = seed
        super().__init__(buf)

    def reset(self, seed: int | None = None) -> tuple[NDArray[np.float32], Infos]:
        observations, _ = self.envs.reset(seed=self._seed if seed is None else seed)
        self._write(observations)
        self.rewards[:], self.terminals[:], self.truncations[:], self.masks[:] = 0.0, False, False, True
        return self.observations, []

    def step(self, actions: NDArray[np.float32]) -> tuple[Any, Any, Any, Any, Infos]:
        ends = {"reward": self.rewards, "terminated": self.terminals, "truncated": self.truncations}
        info = self.envs.step_into(actions, self._fields | ends)
        self._write(self._fields)
        return self.observations, self.rewards, self.terminals, self.truncations, _ends(info)

    def close(self) -> None:
        self.envs.close()

    def _write(self, observations: dict[str, NDArray[Any]]) -> None:
        for key, columns in self.columns.items():
            self.observations[:, columns] = observations[key].reshape(self.num_agents, -1)


def _ends(info: dict[str, Any]) -> Infos:
    """One entry for each episode that ended in a step."""
    if "final_info" not in info:
        return []
    final = info["final_info"]
    values = {"success": final["is_success"]} | {key: final["statistics"][key] for key in ("return", "length", "cost", "completeness")}
    return [{key: float(array[k]) for key, array in values.items()} for k in np.flatnonzero(info["_final_info"])]
