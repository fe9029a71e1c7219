"""The ``palmares`` program: that of the compiled part, and what needs Python."""

from __future__ import annotations

import importlib
import os
import signal
import sys
from collections.abc import Callable

# Commands that are written in Python, by the module whose `main` takes their arguments.
COMMANDS = {"demo": "palmares.program.demo", "evaluate": "palmares.program.evaluate"}


def main() -> int:
    """Run ``palmares`` with the arguments of this process; return its exit code."""
    if len(sys.argv) > 1 and sys.argv[1] in COMMANDS:
        return _until_nobody_reads(importlib.import_module(COMMANDS[sys.argv[1]]).main)
    try:
        from palmares._native import main as native_main
    except ImportError:
        print(
            "palmares: this package was installed without its compiled part, which has the program; "
            "install a wheel (`cargo xtask wheel` makes one)",
            file=sys.stderr,
        )
        return 1
    # The program has its own way to end.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return native_main(["palmares", *sys.argv[1:]])


def _until_nobody_reads(command: Callable[[list[str]], int]) -> int:
    """Run a command; where who reads its output has left, as in ``palmares … | head``, end quietly."""
    try:
        code = command(sys.argv[2:])
        sys.stdout.flush()
    except BrokenPipeError:
        # What is still to be written, when Python ends, goes nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 128 + 13  # what a shell reports of SIGPIPE, which Windows does not have
    return code
