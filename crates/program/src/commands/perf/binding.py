"""Prints how many control steps a second the Python environments take on this machine, and what Python adds to a native step.

python tests/python/speed.py [ENVS [STEPS [THREADS]]]
"""

import platform
import sys
import time

import gymnasium
import numpy as np

import orchardbench  # noqa: F401  registers the environments

SEED = 20250704


def measure(num_envs, steps, threads, **settings):
    """Control steps a second of all environments, the same a second of processor time, and what comes on top of the native step, as a share of it."""
    env = gymnasium.make_vec("orchardbench/Harvest-v1", num_envs=num_envs, threads=threads, **settings)
    env.reset(seed=SEED)
    native, inside = env._core, 0.0

    class Timed:
        def __getattr__(self, name):
            return getattr(native, name)

        def step(self, *args):
            nonlocal inside
            start = time.perf_counter()
            native.step(*args)
            inside += time.perf_counter() - start

    env._core = Timed()
    # The same slow wandering for every run: no robot stalls.
    actions = np.random.default_rng(SEED).uniform(-0.2, 0.2, (steps, *env.action_space.shape)).astype(np.float32)
    start, busy = time.perf_counter(), time.process_time()
    for action in actions:
        env.step(action)
    whole, busy = time.perf_counter() - start, time.process_time() - busy
    return num_envs * steps / whole, num_envs * steps / busy, (whole - inside) / inside


def main():
    num_envs, steps, threads = [int(word) for word in sys.argv[1:]] + [8, 100, 0][len(sys.argv) - 1 :]
    print(f"{platform.machine()}, {num_envs} environments, {steps} steps at 10 Hz, threads {threads or 'one a core'}")
    for name, settings in (("state", {}), ("state and depth (paper, 5 Hz)", {"obs": ("state", "depth")})):
        rate, a_core, overhead = measure(num_envs, steps, threads, **settings)
        print(f"{name}: {rate:.0f} control steps/s in all, {a_core:.0f} a core, {100 * overhead:.1f} % on top of the native step")


if __name__ == "__main__":
    main()
