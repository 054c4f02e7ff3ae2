"""The command ``orchard``."""

import signal
import sys

from orchardbench._native import run_program


def main() -> None:
    """Runs the program ``orchard`` on the command line of this process."""
    # The program handles Ctrl-C itself; Python's handler would wait for the end of a command.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(run_program(["orchard", *sys.argv[1:]]))
