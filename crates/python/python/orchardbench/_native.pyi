"""The native half of the package."""

from collections.abc import Callable
from os import PathLike
from typing import Any, Self, final

import numpy as np
from numpy.typing import NDArray

__all__ = ["Core", "CudaTensor", "__version__", "command_log", "run_benchmark", "run_program"]
__version__: str

def run_program(line: list[str]) -> int: ...
def run_benchmark(
    begin: Callable[[str], Callable[[dict[str, NDArray[Any]]], tuple[Any, str | None]]],
    name: str,
    configs: list[tuple[str, str]],
    scenario: str | PathLike[str] | None,
    options: list[tuple[str, str]],
    obs: list[str],
    pixels: tuple[int, int, int],
    control: str | None,
    control_hz: int,
    line: list[str],
) -> None: ...
def command_log(folder: str | PathLike[str], episode: str) -> str: ...

@final
class CudaTensor:
    def __dlpack__(
        self,
        *,
        stream: Any | None = None,
        max_version: tuple[int, int] | None = None,
        dl_device: tuple[int, int] | None = None,
        copy: bool | None = None,
    ) -> Any: ...
    def __dlpack_device__(self) -> tuple[int, int]: ...

@final
class Core:
    def __new__(
        cls,
        task: str,
        scenario: str | PathLike[str] | None,
        options: list[tuple[str, str]],
        obs: list[str],
        pixels: tuple[int, int, int],
        control: str,
        control_hz: int,
        reward: str,
        privileged: bool,
        backend: str,
        pool: tuple[int, int] | None,
        worlds: tuple[int, int],
        threads: int,
        copy: bool,
        card: int | None,
    ) -> Self: ...
    def interface(self) -> str: ...
    def write_interface(self, file: str | PathLike[str]) -> None: ...
    def reset(self, seeds: list[int | None], mask: NDArray[np.bool_]) -> None: ...
    def step(self, actions: NDArray[np.float32], resets: NDArray[np.bool_] | None) -> None: ...
    def observations(self, again: bool) -> dict[str, Any]: ...
    def observe_into(self, arrays: dict[str, NDArray[Any]]) -> None: ...
    def card_arrays(self) -> dict[str, CudaTensor] | None: ...
    def send(self) -> dict[str, tuple[str, ...]]: ...
    def reports(
        self, mask: NDArray[np.bool_] | None
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], bool, dict[str, Any]]: ...
    def report(self) -> tuple[float, bool, bool, dict[str, Any]]: ...
    def frames(self) -> dict[str, int] | None: ...
    def times(self) -> dict[str, float] | None: ...
    def snapshot(self) -> list[bytes]: ...
    def restore(self, states: list[bytes]) -> None: ...
