"""Ends calls at chosen and at random moments, as Ctrl-C does."""

from __future__ import annotations

import linecache
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import palmares

FOLDER = str(Path(palmares.__file__).parent)


def at_line(number: int, call: Callable[[], object]) -> bool:
    """Make a call, and raise `KeyboardInterrupt` before its `number`-th line in this package.

    Return whether it was interrupted: it may have fewer lines.
    """
    lines = 0

    def line(frame: FrameType, event: str, _what: Any) -> Any:
        nonlocal lines
        # Python calls `__exit__` in the line of the `with`, and no signal comes before it.
        source = linecache.getline(frame.f_code.co_filename, frame.f_lineno)
        if event == "line" and not source.lstrip().startswith("with "):
            lines += 1
            if lines == number:
                raise KeyboardInterrupt
        return line

    def entered(frame: FrameType, _event: str, _what: Any) -> Any:
        return line if frame.f_code.co_filename.startswith(FOLDER) else None

    before = sys.gettrace()
    sys.settrace(entered)
    try:
        call()
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(before)
    return False


@contextmanager
def alarms() -> Iterator[Callable[[float, Callable[[], object]], bool]]:
    """Return a function that makes a call, with `KeyboardInterrupt` if it takes longer than a time, s."""
    armed = False

    def ring(_number: int, _frame: FrameType | None) -> None:
        if armed:
            raise KeyboardInterrupt

    def after(wait_s: float, call: Callable[[], object]) -> bool:
        nonlocal armed
        try:
            armed = True
            signal.setitimer(signal.ITIMER_REAL, max(wait_s, 1e-6))
            call()
            armed = False
        except KeyboardInterrupt:
            return True
        finally:
            armed = False
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        return False

    old = signal.signal(signal.SIGALRM, ring)
    try:
        yield after
    finally:
        signal.signal(signal.SIGALRM, old)
