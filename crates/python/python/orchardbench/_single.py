"""One environment."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.error import ClosedEnvironmentError
from numpy.typing import NDArray

from orchardbench._native import Core
from orchardbench._settings import Settings, checked_actions, interface_of, make_core, spaces_of, whole

if TYPE_CHECKING:
    from typing_extensions import Unpack

Observation = dict[str, NDArray[Any]]
ALL = np.ones(1, dtype=np.bool_)


class OrchardEnv(gymnasium.Env[Observation, NDArray[np.float32]]):
    """A task of the benchmark in one world; the same bits as the environment of the same seed and world among many."""

    metadata = {"render_modes": []}

    def __init__(
        self,
        task: str = "Harvest-v1",
        copy: bool = True,
        render_mode: None = None,
        **settings: Unpack[Settings],
    ) -> None:
        if render_mode is not None:
            raise ValueError(f"render_mode {render_mode}: the environment has none; `orchard render` draws a world")
        self.render_mode = None
        self._core: Core | None = make_core(task, 1, 1, copy, settings)
        self.interface = interface_of(self._core)
        """All conventions: units, signs and ranges of actions, observations and rewards."""
        self.observation_space, self.action_space = spaces_of(self.interface)

    def _open(self) -> Core:
        if self._core is None:
            raise ClosedEnvironmentError("the environment is closed")
        return self._core

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        core = self._open()
        if options:
            raise ValueError(f"unknown option {', '.join(options)}: a single environment has none")
        if seed is not None:
            seed = whole("seed", seed, 2**64)
        super().reset(seed=seed)
        core.reset([seed], ALL)
        return self._observation(core), core.report()[3]

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        core = self._open()
        core.step(checked_actions(action, self.action_space.shape or ())[None], None)
        return self._observation(core), *core.report()

    def _observation(self, core: Core) -> Observation:
        return {key: rows[0] for key, rows in core.observations(False).items()}

    def write_spec(self, file: str | PathLike[str]) -> None:
        """Writes :attr:`interface` into a JSON file, such as ``spec.json``."""
        self._open().write_interface(file)

    def snapshot(self) -> bytes:
        """The state of the environment; the same actions after :meth:`restore` give the same bits."""
        return self._open().snapshot()[0]

    def restore(self, state: bytes) -> tuple[Observation, dict[str, Any]]:
        """Goes back to a state of this environment, or of one made with the same settings."""
        core = self._open()
        core.restore([state])
        return self._observation(core), core.report()[3]

    def close(self) -> None:
        self._core = None
