"""Apple orchards in which robots learn to pick: Gymnasium environments of the OrchardBench tasks.

Importing the package registers ``orchardbench/Harvest-v1``, ``orchardbench/Reach-v1`` and ``orchardbench/Gentle-v1``:

    import gymnasium, orchardbench
    env = gymnasium.make("orchardbench/Harvest-v1")
    envs = gymnasium.make_vec("orchardbench/Harvest-v1", num_envs=4)

``orchardbench.run_benchmark`` runs official episodes of the benchmark under a policy.
"""

from gymnasium.envs.registration import register, registry

from orchardbench._benchmark import Policy, command_log, run_benchmark
from orchardbench._native import __version__
from orchardbench._settings import Settings
from orchardbench._single import OrchardEnv
from orchardbench._vector import OrchardVectorEnv

TASKS = ("Harvest-v1", "Reach-v1", "Gentle-v1")
"""The tasks; each is registered under ``orchardbench/NAME``."""

for _task in TASKS:
    if f"orchardbench/{_task}" not in registry:
        register(
            id=f"orchardbench/{_task}",
            entry_point="orchardbench:OrchardEnv",
            vector_entry_point="orchardbench:OrchardVectorEnv",
            kwargs={"task": _task},
        )

__all__ = [
    "TASKS",
    "OrchardEnv",
    "OrchardVectorEnv",
    "Policy",
    "Settings",
    "__version__",
    "command_log",
    "run_benchmark",
]
