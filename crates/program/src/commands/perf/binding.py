"""Prints what a step of the Python environments takes on top of the native step, as a share of it: the median of rounds."""

import statistics
import sys
import time

import gymnasium
import numpy as np

import orchardbench  # noqa: F401  registers the environments

SEED = 20250704


class Timed:
    """The native environments, with the time spent in their steps."""

    def __init__(self, native):
        self.native, self.inside = native, 0.0
        self.observations, self.reports = native.observations, native.reports

    def step(self, *args):
        start = time.perf_counter()
        self.native.step(*args)
        self.inside += time.perf_counter() - start


def main(num_envs, rounds, steps):
    env = gymnasium.make_vec("orchardbench/Harvest-v1", num_envs=num_envs, threads=1)
    draws, shares = np.random.default_rng(SEED), []
    env.reset(seed=SEED)
    for _ in range(rounds):
        timed = env._core = Timed(env._core)
        actions = draws.uniform(-0.2, 0.2, (steps, *env.action_space.shape)).astype(np.float32)
        start = time.perf_counter()
        for action in actions:
            env.step(action)
        shares.append((time.perf_counter() - start - timed.inside) / timed.inside)
        env._core = timed.native
    print(statistics.median(shares))


main(*[int(word) for word in sys.argv[1:]])
