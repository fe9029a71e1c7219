"""The ``palmares`` program: the compiled program, and the commands in Python."""

from __future__ import annotations

import importlib
import os
import signal
import sys
from collections.abc import Callable

from palmares.outputs import show_everything

# Commands in Python, with the module whose `main` takes their arguments.
COMMANDS = {
    "dataset": "palmares.program.dataset",
    "demo": "palmares.program.demo",
    "evaluate": "palmares.program.evaluate",
    "foxglove": "palmares.program.foxglove",
    "grasps": "palmares.program.grasps",
    "new": "palmares.program.new",
    "ros2": "palmares.program.ros2",
}
# Commands in Python below one of the compiled program.
BELOW = {("hand", "design"): "palmares.program.hand_design"}


def main() -> int:
    """Run ``palmares`` with the arguments of this process; return its exit code."""
    if len(sys.argv) > 1 and sys.argv[1] in COMMANDS:
        return _ending_with_its_reader(importlib.import_module(COMMANDS[sys.argv[1]]).main, sys.argv[2:])
    below = BELOW.get((sys.argv[1], sys.argv[2])) if len(sys.argv) > 2 else None
    if below is not None:
        return _ending_with_its_reader(importlib.import_module(below).main, sys.argv[3:])
    try:
        from palmares._native import main as native_main
    except ImportError:
        print(
            "palmares: this package lacks its compiled part, which contains the program; "
            "install a wheel (`cargo xtask wheel` makes one)",
            file=sys.stderr,
        )
        return 1
    # Some commands start Python: `verify --ray`, `render`.
    if not os.environ.get("PALMARES_PYTHON"):
        os.environ["PALMARES_PYTHON"] = sys.executable
    # The program handles Ctrl-C itself.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return native_main(["palmares", *sys.argv[1:]])


def _ending_with_its_reader(command: Callable[[list[str]], int], arguments: list[str]) -> int:
    """Run a command; end quietly when the reader of its output has ended, as in ``palmares … | head``."""
    try:
        show_everything()
        code = command(arguments)
        sys.stdout.flush()
    except BrokenPipeError:
        # Python flushes its buffer at the end; discard that.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 128 + 13  # what a shell reports of SIGPIPE, which Windows does not have
    return code
