"""Checks the Python package `orchardbench` with Gymnasium's own checkers, against itself, and with bad input.

Runs every test of the modules check_*, or those whose names are given.
"""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parents[1]))

import check_benchmark
import check_episodes
import check_package
import check_spaces
import check_tensors
from checks import main

if __name__ == "__main__":
    main([check_spaces, check_episodes, check_benchmark, check_package, check_tensors])
