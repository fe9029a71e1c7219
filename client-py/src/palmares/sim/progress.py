"""A progress bar for long calls."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from tqdm import tqdm

DELAY_S = 2.0
"""A bar appears after this duration of a call"""


@contextmanager
def progress(total: int, unit: str, what: str) -> Iterator[Callable[[int], None]]:
    """Give a callback for the progress of a long call; after `DELAY_S` a bar on stderr shows it.

    The bar appears only in a terminal or a notebook. It is made after `DELAY_S`, so that short calls cost
    nothing.
    """
    begun = time.monotonic()
    bar: tqdm[Any] | None = None

    def report(done: int) -> None:
        nonlocal bar
        if bar is None and time.monotonic() - begun > DELAY_S and _is_watched():
            bar = tqdm(total=total, unit=unit, desc=what, file=sys.stderr, leave=False, initial=done)
        if bar is not None:
            bar.update(done - bar.n)

    try:
        yield report
    finally:
        if bar is not None:
            bar.close()


def _is_watched() -> bool:
    return sys.stderr.isatty() or "ipykernel" in sys.modules
