"""The native half of the package."""

from os import PathLike
from typing import Any, Self, final

import numpy as np
from numpy.typing import NDArray

__all__ = ["Core", "__version__", "run_program"]
__version__: str

def run_program(line: list[str]) -> int: ...

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
        worlds: tuple[int, int],
        threads: int,
    ) -> Self: ...
    def interface(self) -> str: ...
    def reset(self, seeds: list[int | None], mask: NDArray[np.bool_]) -> None: ...
    def step(self, actions: NDArray[np.float32], mask: NDArray[np.bool_]) -> None: ...
    def observations(self) -> dict[str, NDArray[Any]]: ...
    def reports(self) -> dict[str, Any]: ...
    def snapshot(self) -> list[bytes]: ...
    def restore(self, states: list[bytes]) -> None: ...
