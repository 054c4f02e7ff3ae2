"""Observations, rewards and ends of many environments as numpy arrays, as tensors of PyTorch, or as arrays for any library with DLPack."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

if TYPE_CHECKING:
    from orchardbench._native import Core

KINDS = ("numpy", "torch", "dlpack")


class Arrays:
    """numpy arrays, in the processor's memory."""

    card: int | None = None
    """Number of CUDA's device that the observations stay on, negative for any; None: they are in the processor's memory."""

    def open(self, core: Core) -> None:
        """Prepares what the environments give out."""

    def observe(self, core: Core, again: bool) -> dict[str, Any]:
        """The latest observations; ``again``: once more after a reset within the step."""
        return core.observations(again)

    def values(self, values: NDArray[Any]) -> Any:
        """Rewards or ends."""
        return values

    def actions(self, actions: Any) -> Any:
        """Actions as an array of numpy, or what numpy takes for one."""
        return actions


class CardArrays(Arrays):
    """The memory of the card itself, for ``from_dlpack`` of any library. Rewards and ends are numpy arrays."""

    def __init__(self, card: int) -> None:
        self.card = card
        self._arrays: dict[str, Any] = {}

    def open(self, core: Core) -> None:
        self._arrays = dict(core.card_arrays() or {})

    def observe(self, core: Core, again: bool) -> dict[str, Any]:
        texts = core.send()
        return self._arrays | texts


class Tensors(Arrays):
    """Tensors of PyTorch in the processor's memory."""

    def __init__(self, device: str) -> None:
        self._torch = imported(device)
        self._device = device

    def observe(self, core: Core, again: bool) -> dict[str, Any]:
        return {key: self._tensor(value) for key, value in core.observations(again).items()}

    def _tensor(self, value: Any) -> Any:
        return self._torch.from_numpy(value) if isinstance(value, np.ndarray) else value

    def values(self, values: NDArray[Any]) -> Any:
        values = values.astype(np.float32) if values.dtype.kind == "f" else values
        return self._torch.from_numpy(values).to(self._device)

    def actions(self, actions: Any) -> Any:
        if not isinstance(actions, self._torch.Tensor):
            return actions
        if not actions.is_floating_point():
            raise TypeError(f"actions must be floating-point numbers, not {actions.dtype}")
        return actions.detach().to("cpu", self._torch.float32).numpy()


class CardTensors(Tensors):
    """Tensors of PyTorch in the memory of the card: the memory that the environments write, or copies of it."""

    def __init__(self, device: str, card: int, copy: bool) -> None:
        super().__init__(device)
        self.card, self._copy = card, copy
        self._tensors: dict[str, Any] = {}

    def open(self, core: Core) -> None:
        arrays = core.card_arrays() or {}
        self._tensors = {key: self._torch.from_dlpack(array) for key, array in arrays.items()}
        # With a number, which "cuda" alone leaves open.
        self._device = next(iter(self._tensors.values())).device

    def observe(self, core: Core, again: bool) -> dict[str, Any]:
        texts = core.send()
        return {key: tensor.clone() if self._copy else tensor for key, tensor in self._tensors.items()} | texts


def imported(device: str) -> Any:
    """PyTorch, if it is installed and has the device."""
    try:
        # Not by name: the package is typed without it.
        torch: Any = import_module("torch")
    except ImportError as problem:
        raise ImportError("tensors torch: PyTorch is not installed; pip install 'orchardbench[torch]'") from problem
    if device != "cpu" and not torch.cuda.is_available():
        raise RuntimeError(f"device {device}: this PyTorch finds no device of CUDA; give device=\"cpu\"")
    return torch


def card_of(device: object) -> int | None:
    """Number of a device of CUDA, negative for any; None for the processor."""
    kind, _, number = str(device).partition(":")
    if kind == "cpu" and not number:
        return None
    if kind == "cuda" and (number.isdecimal() or str(device) == "cuda"):
        return int(number or -1)
    raise ValueError(f"device {device}: unknown; it is cpu, cuda or cuda:N")


def given_as(tensors: object, device: object, copy: bool, mode: AutoresetMode, backend: object) -> Arrays:
    """The form in which environments give out their results."""
    if tensors not in KINDS:
        raise ValueError(f"tensors {tensors!r}: unknown; it is one of {', '.join(KINDS)}")
    card = card_of(device)
    if card is None:
        return Tensors("cpu") if tensors == "torch" else Arrays()
    if tensors == "numpy":
        raise ValueError(f"device {device}: arrays of numpy are in the processor's memory; give tensors=\"torch\" or \"dlpack\"")
    if backend != "gpu":
        problem = 'with backend="cpu" the observations are in the processor\'s memory'
        raise ValueError(f"device {device}: {problem}; give backend=\"gpu\", or device=\"cpu\" and move the tensors yourself")
    if tensors == "torch":
        return CardTensors(str(device), card, copy)
    if copy:
        raise ValueError("tensors dlpack: an array is the memory that the next step overwrites; give copy=False, and copy it with the library that reads it")
    if mode == AutoresetMode.SAME_STEP:
        raise ValueError("autoreset_mode SameStep: with tensors=\"dlpack\" nothing can copy last observations; give NextStep or Disabled")
    return CardArrays(card)
