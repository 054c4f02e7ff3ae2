"""Environments, actions and the program, as the checks use them."""

import subprocess
import sys

import gymnasium
import numpy as np

import orchardbench  # noqa: F401, registers the environments

SEED = 20250704
HARVEST, REACH, GENTLE = "orchardbench/Harvest-v1", "orchardbench/Reach-v1", "orchardbench/Gentle-v1"


def vector(num_envs, task=HARVEST, **settings):
    return gymnasium.make_vec(task, num_envs=num_envs, vectorization_mode="vector_entry_point", **settings)


def single(task=HARVEST, **settings):
    return gymnasium.make(task, disable_env_checker=True, **settings)


def actions(env, step, first=0):
    """Actions that differ by environment and step, and depend on nothing else."""
    size = len(env.interface["action"])
    rows = [np.random.default_rng([step, first + k]).uniform(-1, 1, size) for k in range(getattr(env, "num_envs", 1))]
    return np.array(rows, dtype=np.float32)


def orchard(*line):
    code = "import sys; from orchardbench._program import main; sys.argv = ['orchard', *sys.argv[1:]]; main()"
    return subprocess.run([sys.executable, "-c", code, *line], capture_output=True, text=True)
