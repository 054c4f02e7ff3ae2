"""Keyword arguments of the environments, their spaces, and checks of what callers give."""

from __future__ import annotations

import json
import string
from collections.abc import Sequence
from os import PathLike, fspath
from typing import Any, TypedDict, cast

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from orchardbench._native import Core


class Settings(TypedDict, total=False):
    """Keyword arguments that the environments share."""

    scenario: str | PathLike[str]
    """A scenario file: everything at once. The options below change it."""
    preset: str
    """The world: a preset (``orchard presets``)."""
    config: str
    """The world: a config file of your own."""
    tree: str
    """A digitised tree."""
    randomisation: str
    """Strength of the randomisation, or its file."""
    robot: str
    """The robot (``orchard robots``), its folder or URDF file."""
    camera: str
    """The depth camera (``orchard cameras``)."""
    obs: Sequence[str]
    """Groups of observations: ``state``, ``depth``, ``pixels``, ``task_description``. Default: ``("state",)``."""
    pixels_size: int | Sequence[int]
    """Rows and columns of the pictures, or one number for both. Default: 128."""
    pixels_hz: int
    """Pictures a second, a divisor of 60. Default: as many as actions."""
    control: str
    """``joint_delta`` (default), ``joint_absolute`` or ``ee_delta``."""
    control_hz: int
    """Actions a second, a divisor of 60. Default: 10."""
    reward: str
    """``shaped`` (default) or ``sparse``."""
    privileged: bool
    """Observe truth, under the key ``privileged``: for critics and teachers. A policy that reads it cannot be ranked. Default: False."""
    backend: str
    """Where the worlds move: ``cpu`` (default, in float64) or ``gpu`` (any graphics device, in float32; preset ``paper``)."""
    trees: int
    """Let all episodes begin in so many worlds, each of which is grown once and kept, so that a reset costs little. Default: every episode has a new one."""
    trees_seed: int
    """Seed of these worlds. Default: 0."""
    world: int
    """Index of the first environment's world under its seed. Default: 0."""


CHARACTERS = string.ascii_letters + string.digits + " ,.-"
"""Characters of a task's description."""

OPTIONS = ("preset", "config", "tree", "randomisation", "robot", "camera")


FLOAT32 = np.dtype(np.float32)


def make_core(task: str, num_envs: int, threads: int, copy: bool, settings: Settings, card: int | None = None) -> Core:
    """Makes the environments of a task, whose observations stay on a card if it is given; raises ``ValueError`` for settings that do not fit and ``TypeError`` for unknown ones."""
    unknown = set(settings) - set(Settings.__annotations__)
    if unknown:
        known = ", ".join(Settings.__annotations__)
        raise TypeError(f"unknown setting {', '.join(sorted(unknown))}; the settings are {known}")
    control_hz = whole("control_hz", settings.get("control_hz", 10), 2**32)
    pixels = checked_pixels(settings.get("pixels_size", 128), settings.get("pixels_hz", control_hz))
    options = [(name, str(value)) for name in OPTIONS if (value := settings.get(name)) is not None]
    return Core(
        task,
        path("scenario", settings.get("scenario")),
        options,
        groups(settings.get("obs", ("state",))),
        pixels,
        text("control", settings.get("control", "joint_delta")),
        control_hz,
        text("reward", settings.get("reward", "shaped")),
        bool(settings.get("privileged", False)),
        text("backend", settings.get("backend", "cpu")),
        pool_of(settings),
        (whole("world", settings.get("world", 0), 2**32), whole("num_envs", num_envs, 2**32)),
        whole("threads", threads, 2**16),
        bool(copy),
        card,
    )


def pool_of(settings: Settings) -> tuple[int, int] | None:
    """Number and seed of the worlds that are kept, if there are any."""
    if "trees" not in settings:
        if "trees_seed" in settings:
            raise ValueError("trees_seed is the seed of the worlds that trees keeps, and trees is not given")
        return None
    return whole("trees", settings["trees"], 2**32), whole("trees_seed", settings.get("trees_seed", 0), 2**64)


def text(name: str, value: object) -> str:
    """The value, if it is text."""
    if not isinstance(value, str):
        raise TypeError(f"{name} must be text, not {value!r}")
    return value


def path(name: str, value: object) -> str | None:
    """The value, if it is the path of a file or none."""
    if value is not None and not isinstance(value, (str, PathLike)):
        raise TypeError(f"{name} must be the path of a file, not {value!r}")
    return None if value is None else fspath(value)


def groups(obs: object) -> list[str]:
    """The groups of observations of a list of names, or of one name."""
    if isinstance(obs, str):
        return [obs]
    if not isinstance(obs, Sequence):
        raise TypeError(f"obs must be a list of names, not {obs!r}")
    return [text("obs", name) for name in obs]


def checked_pixels(size: object, hz: object) -> tuple[int, int, int]:
    """Rows, columns and rate of pictures."""
    height, width = size if isinstance(size, (tuple, list)) and len(size) == 2 else (size, size)
    return whole("pixels_size", height, 2**32), whole("pixels_size", width, 2**32), whole("pixels_hz", hz, 2**32)


def whole(name: str, value: object, end: int) -> int:
    """The value, if it is a whole number from 0 and below ``end``."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise TypeError(f"{name} must be a whole number, not {value!r}")
    if not 0 <= value < end:
        raise ValueError(f"{name} {value}: it must be at least 0 and less than {end}")
    return int(value)


def spaces_of(
    interface: dict[str, Any],
) -> tuple[spaces.Space[dict[str, NDArray[Any]]], spaces.Space[NDArray[np.float32]]]:
    """Observation and action space of one environment."""
    fields: dict[str, spaces.Space[Any]] = {}
    for field in interface["observation"]:
        if field["dtype"] == "str":
            fields[field["key"]] = spaces.Text(int(field["high"]), min_length=0, charset=CHARACTERS)
            continue
        low = -np.inf if field["low"] is None else field["low"]
        high = np.inf if field["high"] is None else field["high"]
        fields[field["key"]] = spaces.Box(low, high, tuple(field["shape"]), np.dtype(field["dtype"]).type)
    size = len(interface["action"])
    observation, action = spaces.Dict(fields), spaces.Box(-1.0, 1.0, (size,), np.float32)
    # Gymnasium's types of these spaces leave open what they hold.
    return cast("spaces.Space[dict[str, NDArray[Any]]]", observation), cast("spaces.Space[NDArray[np.float32]]", action)


def interface_of(core: Core) -> dict[str, Any]:
    """The conventions of the environments."""
    interface: dict[str, Any] = json.loads(core.interface())
    return interface


def checked_actions(actions: object, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """The actions as an array that the native half takes."""
    if isinstance(actions, np.ndarray) and actions.dtype == FLOAT32 and actions.shape == shape and actions.flags.c_contiguous:
        return actions
    array = np.asarray(actions)
    if array.dtype.kind != "f":
        raise TypeError(f"actions must be floating-point numbers, not {array.dtype}")
    if array.shape != shape:
        raise ValueError(f"actions have the shape {array.shape}, but {shape} is needed")
    # A number beyond 32 bits becomes infinite, and the environment refuses it.
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(array, dtype=np.float32)
