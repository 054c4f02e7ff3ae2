"""The form of results: tensors, arrays by DLPack, and what is refused. PyTorch is not among the requirements; tests/learning checks tensors of it."""

import importlib.util
import os
import sys

import numpy as np
from checks import raises, same
from environments import REACH, SEED, actions, vector

CARD = {"task": REACH, "backend": "gpu", "device": "cuda", "tensors": "dlpack", "copy": False, "autoreset_mode": "Disabled"}


def test_arrays_in_the_processors_memory_are_those_of_numpy():
    given, expected = vector(2, tensors="dlpack", obs=("state", "depth"), device="cpu"), vector(2, obs=("state", "depth"))
    for results in zip(given.reset(seed=SEED), expected.reset(seed=SEED)):
        same(*results)
    results = [env.step(actions(expected, 0)) for env in (given, expected)]
    for pair in zip(*results):
        same(*pair)
    seen = results[0][0]
    assert np.shares_memory(np.from_dlpack(seen["depth"]), seen["depth"])


def test_forms_that_do_not_fit_are_refused():
    for problem, kind, settings in (
        ("tensors 'tf': unknown; it is one of numpy, torch, dlpack", ValueError, {"tensors": "tf"}),
        ("device tpu: unknown; it is cpu, cuda or cuda:N", ValueError, {"device": "tpu"}),
        ("device cuda:x: unknown", ValueError, {"device": "cuda:x"}),
        ("device cpu:0: unknown", ValueError, {"device": "cpu:0"}),
        ('give tensors="torch" or "dlpack"', ValueError, {"tensors": "numpy"}),
        ('give backend="gpu", or device="cpu" and move the tensors yourself', ValueError, {"backend": "cpu"}),
        ("give copy=False, and copy it with the library that reads it", ValueError, {"copy": True}),
        ("give NextStep or Disabled", ValueError, {"autoreset_mode": "SameStep"}),
    ):
        raises(kind, problem, lambda: vector(1, **CARD | settings))
    if importlib.util.find_spec("torch") is None:
        raises(ImportError, "pip install 'orchardbench[torch]'", lambda: vector(1, tensors="torch"))


def test_a_card_that_shares_no_memory_with_cuda_is_refused():
    try:
        envs = vector(1, **CARD)
    except RuntimeError as problem:
        if "no graphics adapter" in str(problem).lower():
            assert not os.environ.get("CI"), problem
            print(f"SKIPPED: memory that is shared with CUDA: {problem}", file=sys.stderr)
            return
        assert str(problem).startswith("device cuda: ") and str(problem).endswith('device="cpu" works everywhere'), problem
        return
    # A machine with a card: the memory is the same at every step, and never written as arrays of numpy.
    before, after = envs.reset(seed=SEED)[0], envs.step(actions(envs, 0))[0]
    assert all(after[key] is before[key] for key in before)
    assert {array.__dlpack_device__()[0] for array in after.values()} == {2}
    raises(ValueError, "the observations stay on the device", lambda: envs.step_into(actions(envs, 1), {}))
