"""A bar for calls that take long."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from tqdm import tqdm

DELAY_S = 2.0
"""A bar is shown once a call has taken so long"""


@contextmanager
def progress(total: int, unit: str, what: str) -> Iterator[Callable[[int], None]]:
    """Give what a long call tells how much it has done; after `DELAY_S` that is shown on stderr.

    Only where somebody looks: in a terminal or a notebook. Nothing is made before, so that short calls cost
    nothing.
    """
    begun = time.monotonic()
    bar: tqdm[Any] | None = None

    def tell(done: int) -> None:
        nonlocal bar
        if bar is None and time.monotonic() - begun > DELAY_S and _is_watched():
            bar = tqdm(total=total, unit=unit, desc=what, file=sys.stderr, leave=False, initial=done)
        if bar is not None:
            bar.update(done - bar.n)

    try:
        yield tell
    finally:
        if bar is not None:
            bar.close()


def _is_watched() -> bool:
    return sys.stderr.isatty() or "ipykernel" in sys.modules
