"""Helpers of the checks of the Python package: comparisons, and a run of all tests of some modules."""

import sys
import time
import traceback

import numpy as np


def same(a, b, where=""):
    assert type(a) is type(b), (where, a, b)
    if isinstance(a, dict):
        assert a.keys() == b.keys(), (where, a.keys(), b.keys())
        for key in a:
            same(a[key], b[key], f"{where}.{key}")
    elif isinstance(a, np.ndarray) and a.dtype != object:
        assert a.dtype == b.dtype and a.tobytes() == b.tobytes(), (where, a, b)
    elif isinstance(a, np.ndarray):
        assert len(a) == len(b)
        for i in range(len(a)):
            same(a[i], b[i], f"{where}[{i}]")
    else:
        assert a == b, (where, a, b)


def row(values, k):
    """Environment k of the results of many: as its own results."""
    if isinstance(values, dict):
        return {key: row(value, k) for key, value in values.items() if not key.startswith("_")}
    value = values[k]
    return value.item() if isinstance(value, np.generic) else value


def raises(kind, text, call):
    try:
        call()
    except kind as e:
        assert text in str(e), f"{text!r} is not in {e}"
        return
    raise AssertionError(f"nothing was raised; expected {kind.__name__}: {text}")


def main(modules, skipped=lambda name: None):
    """Runs every function named test_* of the modules, or those whose names are given; ``skipped`` gives the reason why one is left out."""
    tests = {name: f for module in modules for name, f in vars(module).items() if name.startswith("test_")}
    unknown = [name for name in sys.argv[1:] if name not in tests]
    if unknown:
        sys.exit(f"no test {', '.join(unknown)}; the tests are {', '.join(tests)}")
    failed, chosen = 0, sys.argv[1:] or list(tests)
    for name in chosen:
        start = time.monotonic()
        if reason := skipped(name):
            print(f"{name}: SKIPPED, {reason}", flush=True)
            continue
        try:
            tests[name]()
            said = "ok"
        except Exception:
            failed += 1
            said = f"FAILED\n{traceback.format_exc()}"
        print(f"{name} ({time.monotonic() - start:.1f} s): {said}", flush=True)
    sys.exit(f"{failed} of {len(chosen)} tests failed" if failed else 0)
