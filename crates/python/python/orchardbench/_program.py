"""The command ``orchard``."""

import os
import signal
import sys

from orchardbench._native import run_program


def main() -> None:
    """Runs the program ``orchard`` on the command line of this process."""
    # The program handles Ctrl-C itself; Python's handler would wait for the end of a command.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    # `orchard demos --format lerobot` runs LeRobot with this interpreter.
    os.environ.setdefault("ORCHARD_PYTHON", sys.executable)
    sys.exit(run_program(["orchard", *sys.argv[1:]]))
