"""Many environments for rsl_rl (``pip install orchardbench[rl]``).

    from rsl_rl.runners import OnPolicyRunner
    from orchardbench.rsl_rl import OrchardRslRl
    runner = OnPolicyRunner(OrchardRslRl("Reach-v1", num_envs=8), config, log_dir=None, device="cpu")
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from rsl_rl.env import VecEnv
from tensordict import TensorDict

from orchardbench._settings import Settings
from orchardbench._vector import Observations, OrchardVectorEnv

if TYPE_CHECKING:
    from typing_extensions import Unpack


class OrchardRslRl(VecEnv):
    """A task in many worlds as the vector environment of rsl_rl. Group ``policy`` of an observation holds all numbers, one field after
    another in the order of ``envs.interface["observation"]``; each image is a group of its own, channels first, as float32 (depth in
    metres, colours and masks from 0 to 1). With ``backend="gpu"`` and a ``device`` of CUDA the observations stay on the card that draws them."""

    def __init__(
        self,
        task: str = "Harvest-v1",
        num_envs: int = 1,
        threads: int = 0,
        seed: int = 0,
        device: str | torch.device = "cpu",
        **settings: Unpack[Settings],
    ) -> None:
        stays = str(device).startswith("cuda") and settings.get("backend") == "gpu"
        # Copies (the default): rsl_rl stores an observation after the next step.
        self.envs = OrchardVectorEnv(
            task, num_envs, AutoresetMode.SAME_STEP, threads, tensors="torch", device=device if stays else "cpu", **settings
        )
        self.cfg: dict[str, Any] = {"task": task, "seed": seed, **settings}
        self.device = device
        self.num_envs = num_envs
        interface = self.envs.interface
        self.num_actions = len(interface["action"])
        self.max_episode_length = round(interface["horizon"] * interface["spaces"]["control_hz"])
        self.episode_length_buf = torch.zeros(num_envs, dtype=torch.long, device=device)
        self._observations = self.envs.reset(seed=seed)[0]

    def get_observations(self) -> TensorDict:
        return self._tensors(self._observations)

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict[str, Any]]:
        self._observations, reward, terminated, truncated, info = self.envs.step(actions.detach())
        dones = (terminated | truncated).to(self.device)
        self.episode_length_buf = torch.where(dones, 0, self.episode_length_buf + 1)
        extras: dict[str, Any] = {"time_outs": (truncated & ~terminated).to(self.device)}
        if "final_info" in info:
            final, ended = info["final_info"], info["_final_info"]
            statistics = {name: final["statistics"][name][ended] for name in ("cost", "completeness", "deposited")}
            log = {"success": final["is_success"][ended]} | statistics
            extras["log"] = {f"/episode/{name}": float(np.mean(values)) for name, values in log.items()}
        return self._tensors(self._observations), reward.to(self.device), dones.long(), extras

    def _tensors(self, observations: Observations) -> TensorDict:
        numbers, groups = [], {}
        for field in self.envs.interface["observation"]:
            key, values = field["key"], observations[field["key"]]
            if values.ndim == 2:
                numbers.append(values)
                continue
            image = values.to(self.device).float() / (255.0 if values.ndim == 4 else 1.0)
            groups[key] = (image.permute(0, 3, 1, 2) if values.ndim == 4 else image[:, None]).contiguous()
        if numbers:
            groups["policy"] = torch.cat(numbers, dim=1).to(self.device)
        return TensorDict(groups, batch_size=[self.num_envs], device=self.device)
