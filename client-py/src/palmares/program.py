"""The ``palmares`` program, from the compiled part of the package."""

from __future__ import annotations

import signal
import sys


def main() -> int:
    """Run ``palmares`` with the arguments of this process; return its exit code."""
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
