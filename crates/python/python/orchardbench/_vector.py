"""Many environments that step together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.error import ClosedEnvironmentError
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from orchardbench._native import Core
from orchardbench._settings import Settings, checked_actions, interface_of, make_core, spaces_of, whole
from orchardbench._tensors import given_as

if TYPE_CHECKING:
    from typing_extensions import Unpack

Observations = dict[str, Any]
Mask = NDArray[np.bool_]
Stepped = tuple[Observations, Any, Any, Any, dict[str, Any]]


class OrchardVectorEnv(VectorEnv[Observations, NDArray[np.float32], NDArray[Any]]):
    """A task of the benchmark in many worlds, on all cores. Environment ``k`` has world ``world + k`` of its seed, and its bits do not
    depend on the other environments.

    ``tensors`` is the form of observations, rewards and ends: ``"numpy"`` (default), ``"torch"``, or ``"dlpack"``. ``device`` is where they are:
    ``"cpu"`` (default), or with ``backend="gpu"`` on a card of NVIDIA ``"cuda"`` or ``"cuda:N"``, where observations stay on the card that draws them. With
    ``copy=False`` such a tensor is the memory that the environments write: the same at every step, overwritten by the next step or reset, which first
    waits for the work that CUDA has to do. With ``copy=True`` (default) each observation is a copy of its own, on the same device."""

    def __init__(
        self,
        task: str = "Harvest-v1",
        num_envs: int = 1,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        threads: int = 0,
        copy: bool = True,
        render_mode: None = None,
        tensors: str = "numpy",
        device: object = "cpu",
        **settings: Unpack[Settings],
    ) -> None:
        if render_mode is not None:
            raise ValueError(f"render_mode {render_mode}: the environment has none; `orchard render` draws a world")
        self.autoreset_mode = _mode(autoreset_mode)
        self._form = given_as(tensors, device, copy, self.autoreset_mode, settings.get("backend"))
        self._core: Core | None = make_core(task, num_envs, threads, copy, settings, self._form.card)
        self._form.open(self._core)
        self.metadata = {"render_modes": [], "autoreset_mode": self.autoreset_mode}
        self.num_envs = num_envs
        self.interface = interface_of(self._core)
        """All conventions: units, signs and ranges of actions, observations and rewards."""
        self.single_observation_space, self.single_action_space = spaces_of(self.interface)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._action_shape = (num_envs, len(self.interface["action"]))
        # Environments that the next step resets, if any: those that ended in the mode NextStep.
        self._resets: Mask | None = None

    @property
    def frames_by_place(self) -> dict[str, int] | None:
        """Frames so far by the place where they were computed: ``device``, or the reason for which it was the CPU. None with ``backend="cpu"``."""
        return self._open().frames()

    @property
    def step_times(self) -> dict[str, float] | None:
        """Seconds that the parts of all steps took since this was asked first: ``host.PART`` on the processor, ``device.KERNEL`` by the device's own clock where it has one,
        and the number of ``rounds`` in which frames were sent. Timing every kernel slows a step by about a fifth. None with ``backend="cpu"``."""
        return self._open().times()

    def _open(self) -> Core:
        if self._core is None:
            raise ClosedEnvironmentError("the environments are closed")
        return self._core

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observations, dict[str, Any]]:
        """Begins an episode in every environment, or in those of ``options["reset_mask"]``: with a seed the first one of the seed, without
        the next one. One number is the seed of all environments, whose worlds differ by their indices."""
        core = self._open()
        seeds = self._seeds(seed)
        mask = self._mask(options)
        core.reset(seeds, mask)
        if self._resets is not None:
            self._resets = self._resets & ~mask
        return self._form.observe(core, False), core.reports(mask)[4]

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        if seed is None or isinstance(seed, (int, np.integer)):
            seed = [seed] * self.num_envs
        if not isinstance(seed, Sequence):
            raise TypeError(f"seed must be a whole number or a list of them, not {seed!r}")
        if len(seed) != self.num_envs:
            raise ValueError(f"{len(seed)} seeds for {self.num_envs} environments")
        return [None if one is None else whole("seed", one, 2**64) for one in seed]

    def _mask(self, options: dict[str, Any] | None) -> Mask:
        if not isinstance(options, (dict, type(None))):
            raise TypeError(f"options must be a dictionary, not {options!r}")
        options = dict(options or {})
        mask = options.pop("reset_mask", None)
        if options:
            raise ValueError(f"unknown option {', '.join(options)}; the only one is reset_mask")
        if mask is None:
            return np.ones(self.num_envs, dtype=np.bool_)
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
            kind = mask.dtype if isinstance(mask, np.ndarray) else type(mask).__name__
            raise TypeError(f"reset_mask must be a numpy array of bool, not {kind}")
        if mask.shape != (self.num_envs,):
            raise ValueError(f"reset_mask has the shape {mask.shape}, but {(self.num_envs,)} is needed")
        if not mask.any():
            raise ValueError("reset_mask names no environment")
        return mask.copy()

    def step(self, actions: Any) -> Stepped:
        """Takes an action in every environment: a row of numbers each, as an array of numpy or a tensor."""
        core, form = self._open(), self._form
        observations, *ends, info = self._advance(core, form.actions(actions), lambda again: form.observe(core, again))
        reward, terminated, truncated = map(form.values, ends)
        return observations, reward, terminated, truncated, info

    def step_into(self, actions: NDArray[np.float32], buffers: dict[str, NDArray[Any]]) -> dict[str, Any]:
        """Steps as :meth:`step` does, and writes the results into arrays of the caller's: the observations under their keys, but for text,
        and ``reward``, ``terminated`` and ``truncated``. Returns the info."""
        core = self._open()
        if self._form.card is not None:
            raise ValueError("step_into writes arrays of numpy, but the observations stay on the device; give device=\"cpu\"")
        results = {key: buffers.get(key) for key in ("reward", "terminated", "truncated")}
        for key, array in results.items():
            kind = "f" if key == "reward" else "b"
            if not isinstance(array, np.ndarray) or array.dtype.kind != kind:
                raise TypeError(f"{key} must be a numpy array of {'float' if kind == 'f' else 'bool'}")
            if array.shape != (self.num_envs,):
                raise ValueError(f"{key} has the shape {array.shape}, but {(self.num_envs,)} is needed")
        observations = {key: value for key, value in buffers.items() if key not in results}
        # Before anything moves: a step whose results cannot be written is not taken.
        core.observe_into(observations)

        def observe(again: bool) -> Observations:
            core.observe_into(observations)
            return observations

        _, *ends, info = self._advance(core, actions, observe)
        for key, values in zip(results, ends):
            buffers[key][:] = values
        return info

    def _advance(self, core: Core, actions: NDArray[np.float32], observe: Callable[[bool], Observations]) -> Stepped:
        """Takes a step. ``observe`` reads observations, again if they change within the step."""
        core.step(checked_actions(actions, self._action_shape), self._resets)
        observations, (reward, terminated, truncated, any_ended, info) = observe(False), core.reports(None)
        self._resets = None
        if not any_ended or self.autoreset_mode == AutoresetMode.DISABLED:
            return observations, reward, terminated, truncated, info
        ended = terminated | truncated
        if self.autoreset_mode == AutoresetMode.NEXT_STEP:
            self._resets = ended
            return observations, reward, terminated, truncated, info
        final, places = np.full(self.num_envs, None, dtype=object), np.flatnonzero(ended)
        # Copies: the reset below writes the same memory.
        last = {
            key: [values[k] for k in places] if isinstance(values, tuple) else values[places]
            for key, values in observations.items()
        }
        for row, k in enumerate(places):
            final[k] = {key: values[row] for key, values in last.items()}
        finals = {"final_obs": final, "_final_obs": ended, "final_info": core.reports(ended)[4], "_final_info": ended}
        core.reset([None] * self.num_envs, ended)
        return observe(True), reward, terminated, truncated, finals | core.reports(None)[4]

    def write_spec(self, file: str | PathLike[str]) -> None:
        """Writes :attr:`interface` into a JSON file, such as ``spec.json``."""
        self._open().write_interface(file)

    def snapshot(self) -> list[bytes]:
        """The state of every environment; the same actions after :meth:`restore` give the same bits."""
        return self._open().snapshot()

    def restore(self, states: Sequence[bytes]) -> tuple[Observations, dict[str, Any]]:
        """Goes back to states of these environments, or of ones made with the same settings."""
        core = self._open()
        core.restore(list(states))
        _, terminated, truncated, any_ended, info = core.reports(None)
        self._resets = terminated | truncated if any_ended and self.autoreset_mode == AutoresetMode.NEXT_STEP else None
        return self._form.observe(core, False), info

    def close_extras(self, **kwargs: Any) -> None:
        self._core = None


def _mode(mode: object) -> AutoresetMode:
    names = [known.value for known in AutoresetMode]
    if not isinstance(mode, AutoresetMode) and mode not in names:
        raise ValueError(f"autoreset_mode {mode!r}: unknown; it is one of {', '.join(names)}")
    return AutoresetMode(mode)
