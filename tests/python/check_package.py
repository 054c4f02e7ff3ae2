"""Bad input, forks, the program, the notebook, types."""

import multiprocessing
import pathlib
import subprocess
import sys
import warnings

import numpy as np
from gymnasium.error import ClosedEnvironmentError, ResetNeeded

from checks import raises, same
from environments import SEED, orchard, single, vector

import orchardbench

NOTEBOOK = pathlib.Path(__file__).parents[2] / "docs" / "notebooks" / "first-steps.ipynb"


def test_bad_input_is_refused():
    env = vector(2)
    size = len(env.interface["action"])
    good = np.zeros((2, size), dtype=np.float32)
    raises(ResetNeeded, "call reset first", lambda: env.step(good))
    raises(ResetNeeded, "call reset first", env.snapshot)
    env.reset(seed=SEED)
    nan = good.copy()
    nan[1, 0] = np.nan
    raises(ValueError, "action of environment 1", lambda: env.step(nan))
    raises(ValueError, "have the shape (1, ", lambda: env.step(good[:1]))
    raises(ValueError, "have the shape", lambda: env.step(good[:, :-1]))
    raises(TypeError, "not int64", lambda: env.step(good.astype(np.int64)))
    raises(TypeError, "not object", lambda: env.step([[None] * size] * 2))
    raises(ValueError, "3 seeds for 2", lambda: env.reset(seed=[1, 2, 3]))
    raises(ValueError, "at least 0", lambda: env.reset(seed=-1))
    raises(TypeError, "whole number", lambda: env.reset(seed=[1.5, 2]))
    raises(TypeError, "numpy array of bool", lambda: env.reset(options={"reset_mask": [True, False]}))
    raises(ValueError, "has the shape", lambda: env.reset(options={"reset_mask": np.ones(3, dtype=bool)}))
    raises(ValueError, "names no environment", lambda: env.reset(options={"reset_mask": np.zeros(2, dtype=bool)}))
    raises(ValueError, "unknown option", lambda: env.reset(options={"mask": 1}))
    raises(TypeError, "options must be a dictionary", lambda: env.reset(options=[1]))
    raises(TypeError, "seed must be a whole number or a list of them, not 1.0", lambda: env.reset(seed=1.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        raises(ValueError, "is inf, which", lambda: env.step(np.full((2, size), 1e300)))
    env.close()
    raises(ClosedEnvironmentError, "closed", lambda: env.step(good))
    raises(ClosedEnvironmentError, "closed", lambda: env.reset())
    raises(ClosedEnvironmentError, "closed", lambda: env.step_into(good, {}))
    raises(ClosedEnvironmentError, "closed", lambda: env.write_spec("spec.json"))
    one = single().unwrapped
    one.close()
    raises(ClosedEnvironmentError, "closed", lambda: one.reset())
    raises(ClosedEnvironmentError, "closed", lambda: one.step(good[0]))
    raises(ClosedEnvironmentError, "closed", lambda: one.snapshot())
    raises(ValueError, "--preset: no preset 'nowhere'", lambda: single(preset="nowhere"))
    raises(ValueError, "/no/such.toml", lambda: single(scenario="/no/such.toml"))
    raises(ValueError, "--camera", lambda: single(camera="eye"))
    raises(ValueError, "obs smell: unknown; it is one of state, depth, pixels, task_description", lambda: single(obs=("smell",)))
    raises(ValueError, "control_hz 7: it must divide the frame rate, 60 Hz", lambda: single(control_hz=7))
    raises(ValueError, "control torque: unknown", lambda: single(control="torque"))
    raises(ValueError, "worlds 0..0", lambda: vector(0))
    raises(TypeError, "obs must be a list of names, not 3", lambda: single(obs=3))
    raises(TypeError, "control must be text, not None", lambda: single(control=None))
    raises(TypeError, "scenario must be the path of a file, not 3", lambda: single(scenario=3))
    raises(ValueError, "autoreset_mode 'Sometimes': unknown; it is one of NextStep, SameStep, Disabled", lambda: vector(1, autoreset_mode="Sometimes"))
    raises(ValueError, "trees 0: there are from 1 to 65536 trees in a pool", lambda: single(trees=0))
    raises(TypeError, "trees must be a whole number, not 1.5", lambda: single(trees=1.5))
    raises(ValueError, "trees is not given", lambda: single(trees_seed=1))
    raises(TypeError, "unknown setting colour", lambda: orchardbench.OrchardEnv(colour=1))
    raises(ValueError, "task Sleep-v1: unknown", lambda: orchardbench.OrchardEnv("Sleep-v1"))
    raises(ValueError, "render_mode human", lambda: orchardbench.OrchardEnv(render_mode="human"))


def in_fork(env, queue):
    try:
        env.reset(seed=SEED)
        queue.put("no error")
    except RuntimeError as e:
        queue.put(str(e))
    # One that is made after the fork works.
    queue.put(vector(1).reset(seed=SEED)[0])


def test_a_forked_process_is_told_so():
    if "fork" not in multiprocessing.get_all_start_methods():
        return
    env = vector(1)
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        process = context.Process(target=in_fork, args=(env, queue))
        process.start()
    said, seen = queue.get(timeout=60), queue.get(timeout=60)
    process.join()
    assert "cannot be used in its fork" in said, said
    same(seen, env.reset(seed=SEED)[0])


def test_the_program_runs():
    presets = orchard("presets")
    assert presets.returncode == 0 and "paper" in presets.stdout.split()
    bad = orchard("scenario", "show", "--preset", "nowhere")
    assert bad.returncode == 2 and "nowhere" in bad.stderr, (bad.returncode, bad.stderr)


def test_the_notebook_runs():
    import nbclient
    import nbformat

    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
    outputs = [cell["outputs"] for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert all(outputs[:4]) and "'depth': (4, 144, 192)" in str(outputs[0]), outputs[0]


def test_types():
    package = pathlib.Path(orchardbench.__file__).parent
    # The adapters need packages that are not installed here; tests/learning checks them.
    own = ["mypy", "--strict", "--exclude", "/(lerobot|pufferlib|rsl_rl|sb3|vla_eval)[.]py$", str(package)]
    for command in (own, ["mypy.stubtest", "orchardbench._native"]):
        done = subprocess.run([sys.executable, "-m", *command], capture_output=True, text=True, cwd=package.parent)
        assert done.returncode == 0, done.stdout + done.stderr
