"""The official benchmark under a policy."""

from __future__ import annotations

import json
import pathlib
import re
from collections.abc import Callable, Mapping, Sequence
from os import PathLike, fspath
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from orchardbench import _native
from orchardbench._settings import OPTIONS, checked_actions, checked_pixels, groups, path, whole

Observation = dict[str, NDArray[Any]]

COMMAND = ("arm_q", "arm_v", "base_velocity", "finger_q", "finger_force", "vacuum")
"""Keys of a command of control ``command``: set points of the arm's joints [rad] and their speeds [rad/s] at the end of the frame, velocity of
the base in its own frame [m/s, m/s, rad/s], opening of each finger [m], its largest force [N], valve of the suction cup [0 to 1]."""

SUMMARIES = {"harvest": "summary.json", "reach-and-grasp": "reach-and-grasp.json", "gentle": "gentle.json"}


class Policy(Protocol):
    """What :func:`run_benchmark` asks. A policy that also has a method ``log()`` is asked for the events that it declares after each action
    (``docs/python.md``)."""

    def reset(self, interface: dict[str, Any]) -> None:
        """An episode begins; ``interface`` holds the conventions."""

    def act(self, observation: Observation) -> Any:
        """The action for an observation; for control ``command`` a dictionary with the keys :data:`COMMAND`."""


def run_benchmark(
    policy: Policy | Callable[[], Policy],
    *,
    out: str | PathLike[str],
    name: str,
    version: str = "1",
    seeds: str | Sequence[int] = "tuning",
    tasks: Sequence[str] = ("harvest",),
    profile: str = "quick",
    conditions: Sequence[str] | None = None,
    trees: int | None = None,
    repeats: int | None = None,
    horizon: float | None = None,
    obs: str | Sequence[str] = ("state",),
    pixels_size: int | Sequence[int] = 128,
    pixels_hz: int | None = None,
    control: str = "joint_delta",
    control_hz: int = 10,
    threads: int = 1,
    configs: Mapping[str, str] | None = None,
    scenario: str | PathLike[str] | None = None,
    **options: str,
) -> dict[str, Any]:
    """Runs official episodes under a policy, as ``orchard bench-v1`` does: the same plan, files, command log and resuming, in the folder
    ``out``. Returns the summaries by task.

    ``policy`` is an object with ``reset`` and ``act``, or a class or function that makes one for each episode; only then more than one thread
    makes sense. ``name`` and ``version`` are hashed into the results: raise the version whenever the policy changes, so that a resumed run
    never mixes two. An exception of the policy ends the run; the same call continues it. ``configs`` are named texts to hash in place of the
    version.
    """
    if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.+-]{0,63}", name):
        raise ValueError(f"name {name!r}: letters, digits and any of _ . + - are allowed, at most 64")
    if unknown := [option for option in options if option not in OPTIONS]:
        raise TypeError(f"unknown option {', '.join(unknown)}; the options are {', '.join(OPTIONS)}")
    if unknown := [task for task in tasks if task not in SUMMARIES]:
        raise ValueError(f"tasks {', '.join(unknown)}: unknown; they are {', '.join(SUMMARIES)}")
    if control == "command" and control_hz != 10:
        raise ValueError(f"control_hz {control_hz}: commands are given in every frame; leave it out")
    made = isinstance(policy, type) or not hasattr(policy, "act")
    if made and not callable(policy):
        raise TypeError("policy must have the methods reset and act, or make an object that has")
    make = cast("Callable[[], Policy]", policy) if made else lambda: cast(Policy, policy)
    if not made and threads != 1:
        raise ValueError(f"threads {threads}: one policy object serves one episode at a time; give its class or a function that makes it")
    given = {key: str(value) for key, value in options.items() if value is not None}
    line = ["orchard", "bench-v1", f"--out={fspath(out)}", f"--controller={name}", f"--profile={profile}"]
    line += [f"--tasks={','.join(tasks)}", f"--threads={whole('threads', threads, 1025)}"]
    line.append(f"--seeds={seeds if isinstance(seeds, str) else ','.join(str(whole('seeds', seed, 2**64)) for seed in seeds)}")
    if scenario is not None:
        line.append(f"--scenario={fspath(scenario)}")
    line += [f"--{key}={value}" for key, value in given.items()]
    if conditions is not None:
        line.append(f"--conditions={','.join(conditions)}")
    for key, value in (("trees", trees), ("repeats", repeats), ("horizon", horizon)):
        if value is not None:
            line.append(f"--{key}={value}")

    def begin(interface: str) -> Callable[[Observation], tuple[Any, str | None]]:
        return _episode(make(), json.loads(interface), control == "command")

    _native.run_benchmark(
        begin,
        name,
        list((configs or {"version": version}).items()),
        path("scenario", scenario),
        list(given.items()),
        groups(obs),
        checked_pixels(pixels_size, control_hz if pixels_hz is None else pixels_hz),
        None if control == "command" else control,
        whole("control_hz", control_hz, 2**32),
        line,
    )
    return {task: json.loads(pathlib.Path(out, SUMMARIES[task]).read_text()) for task in tasks}


def _episode(
    policy: Policy, interface: dict[str, Any], commands: bool
) -> Callable[[Observation], tuple[Any, str | None]]:
    """What answers the observations of an episode."""
    policy.reset(interface)
    log: Callable[[], Sequence[Any]] | None = getattr(policy, "log", None)
    size = len(interface["action"])

    def answer(observation: Observation) -> tuple[Any, str | None]:
        action = policy.act(observation)
        checked = _command(action) if commands else checked_actions(action, (size,))
        return checked, None if log is None else json.dumps(list(log()), allow_nan=False)

    return answer


def _command(command: object) -> tuple[Any, ...]:
    if not isinstance(command, Mapping) or set(command) != set(COMMAND):
        raise TypeError(f"a command must be a dictionary with the keys {', '.join(COMMAND)}")
    parts: list[Any] = []
    for key in COMMAND:
        numbers = np.asarray(command[key])
        if numbers.dtype.kind not in "fiu":
            raise TypeError(f"command: {key} must be numbers, not {numbers.dtype}")
        shape = {"arm_q": 1, "arm_v": 1, "base_velocity": 1}.get(key, 0)
        if numbers.ndim != shape or (key == "base_velocity" and len(numbers) != 3):
            raise ValueError(f"command: {key} has the shape {numbers.shape}")
        parts.append(numbers.astype(np.float64).tolist())
    return tuple(parts)


def command_log(folder: str | PathLike[str], episode: str) -> dict[str, Any]:
    """The command log of an episode of a result folder; ``episode`` is the name of its record without ``.json``. Its ``commands``, one a frame,
    are dictionaries as control ``command`` takes them; its ``events`` are pairs of a frame and an event as ``log`` gives them."""
    log: dict[str, Any] = json.loads(_native.command_log(fspath(folder), episode))
    return {"commands": log["commands"], "events": [tuple(event) for event in log["events"]]}
