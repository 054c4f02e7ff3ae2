"""The tasks as a benchmark of vla-eval (``pip install vla-eval``), whose runner asks a model server for actions over a WebSocket.

    benchmarks:
      - benchmark: "orchardbench.vla_eval:OrchardBenchmark"
        episodes_per_task: 20
        params: {task: Harvest-v1, seeds: [1]}
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from vla_eval.benchmarks.base import StepBenchmark, StepResult
from vla_eval.specs import IMAGE_RGB, LANGUAGE, DimSpec

from orchardbench._settings import Settings, checked_actions
from orchardbench._single import Observation, OrchardEnv

if TYPE_CHECKING:
    from typing_extensions import Unpack


class OrchardBenchmark(StepBenchmark):
    """One task of OrchardBench, with one task of vla-eval for each seed. Episode ``k`` of a seed has world ``k``, whoever runs it and in whatever
    order. An episode ends by the rules of the benchmark, never by a number of steps of the runner: leave ``max_steps`` as it is.

    A model server gets ``images`` (``wrist``, ``base``; uint8), ``states`` (float32: ``agent_pos``, ``agent_vel``, ``forces`` and the task's ``target``, in this order),
    ``task_description``, and ``depth`` with ``depth_valid`` and ``depth_time`` if they are observed. It returns ``actions``: numbers in [-1, 1], in the order of
    ``get_metadata()["action"]``."""

    render_backends: ClassVar[frozenset[str]] = frozenset({"cpu", "gpu"})

    @classmethod
    def configure_render(cls, mode: str) -> dict[str, str]:
        """The cameras are drawn on the processor in either mode: nothing to set."""
        return {}

    def __init__(self, task: str = "Harvest-v1", seeds: Sequence[int] = (1,), **settings: Unpack[Settings]) -> None:
        super().__init__()
        self._name, self._seeds = task, list(seeds)
        self._settings: Settings = {"obs": ("state", "pixels"), **settings}
        self._env = OrchardEnv(task, **self._settings)
        self.interface = self._env.interface

    def get_tasks(self) -> list[dict[str, Any]]:
        sentence = self.interface["task_description"]
        return [{"name": f"{self._name} seed {seed}", "suite": "orchardbench", "language": sentence, "seed": seed} for seed in self._seeds]

    def reset(self, task: dict[str, Any]) -> Observation:
        self._env.close()
        settings: Settings = {**self._settings, "world": self._settings.get("world", 0) + task.get("episode_idx", 0)}
        self._env = OrchardEnv(self._name, **settings)
        return self._env.reset(seed=task["seed"])[0]

    def step(self, action: dict[str, Any]) -> StepResult:
        given = np.asarray(action.get("actions", action.get("action")), dtype=np.float32)
        array = checked_actions(given, (len(self.interface["action"]),))
        observation, reward, terminated, truncated, info = self._env.step(array)
        return StepResult(observation, reward, terminated or truncated, info)

    def make_obs(self, raw_obs: Observation, task: dict[str, Any]) -> dict[str, Any]:
        observation: dict[str, Any] = {"task_description": task["language"]}
        images = {key.removeprefix("pixels_"): raw_obs[key] for key in ("pixels_wrist", "pixels_base") if key in raw_obs}
        if images:
            observation["images"] = images
        states = [raw_obs[key] for key in ("agent_pos", "agent_vel", "forces", "target") if key in raw_obs]
        if states:
            observation["states"] = np.concatenate(states)
        return observation | {key: raw_obs[key] for key in ("depth", "depth_valid", "depth_time") if key in raw_obs}

    def get_step_result(self, step_result: StepResult) -> dict[str, Any]:
        info = step_result.info
        statistics = info.get("statistics", {})
        return {
            "success": bool(info.get("is_success", False)),
            "completeness": float(statistics.get("completeness", 0.0)),
            "deposited": float(statistics.get("deposited", 0.0)),
            "damage": float(statistics.get("cost", 0.0)),
        }

    def get_metric_keys(self) -> dict[str, str]:
        return {"success": "mean", "completeness": "mean", "deposited": "mean", "damage": "mean"}

    def get_metadata(self) -> dict[str, Any]:
        """Steps of the longest episode, and the meaning of every number."""
        hz = self.interface["spaces"]["control_hz"]
        steps = round(self.interface["horizon"] * hz)
        return {"max_steps": steps, "control_hz": hz, "action": self.interface["action"], "scenario": self.interface["scenario"]}

    def get_action_spec(self) -> dict[str, DimSpec]:
        names = ", ".join(channel["name"] for channel in self.interface["action"])
        control = self.interface["spaces"]["control"]
        size = len(self.interface["action"])
        return {"actions": DimSpec("actions", size, f"orchardbench_{control}", (-1, 1), description=names)}

    def get_observation_spec(self) -> dict[str, DimSpec]:
        keys = {field["key"]: field for field in self.interface["observation"]}
        spec = {"language": LANGUAGE}
        for key in ("pixels_wrist", "pixels_base"):
            if key in keys:
                spec[key.removeprefix("pixels_")] = IMAGE_RGB
        size = sum(keys[key]["shape"][0] for key in ("agent_pos", "agent_vel", "forces", "target") if key in keys)
        if size:
            spec["states"] = DimSpec("states", size, "orchardbench_state")
        return spec

    def get_hold_action(self, last_action: dict[str, Any] | None) -> dict[str, Any]:
        """Keeps still: moves and velocities of 0, the hand as it was; places of joints as they were last."""
        if last_action is not None and self.interface["spaces"]["control"] == "joint_absolute":
            return last_action
        if self.interface["spaces"]["control"] == "joint_absolute":
            raise ValueError("joint_absolute has no action that keeps still before the first one")
        hold = np.zeros(len(self.interface["action"]), dtype=np.float32)
        hold[-1] = 1.0 if last_action is None else np.asarray(last_action["actions"], dtype=np.float32)[-1]
        return {"actions": hold}

    def cleanup(self) -> None:
        self._env.close()
