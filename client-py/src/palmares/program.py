"""The ``palmares`` program: that of the compiled part, and what needs Python."""

from __future__ import annotations

import importlib
import signal
import sys

# Commands that are written in Python, by the module whose `main` takes their arguments.
COMMANDS = {"demo": "palmares.demo", "evaluate": "palmares.evaluate.command"}


def main() -> int:
    """Run ``palmares`` with the arguments of this process; return its exit code."""
    if len(sys.argv) > 1 and sys.argv[1] in COMMANDS:
        code: int = importlib.import_module(COMMANDS[sys.argv[1]]).main(sys.argv[2:])
        return code
    try:
        from palmares import _native
    except ImportError:
        print(
            "palmares: this package was installed without its compiled part, which has the program; "
            "install a wheel (`cargo xtask wheel` makes one)",
            file=sys.stderr,
        )
        return 1
    # The program has its own way to end.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.main(["palmares", *sys.argv[1:]])
