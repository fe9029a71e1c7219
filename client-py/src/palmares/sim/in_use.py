"""The error of a second thread."""

from __future__ import annotations

from palmares.errors import InUseError


def in_use(error: RuntimeError, what: str) -> RuntimeError:
    """Return the error of a call during a call of another thread; any other error stays.

    Args:
        error: Of the compiled part.
        what: The object that both threads use.

    """
    if "borrowed" not in str(error):
        return error
    return InUseError(
        f"another thread is in a call of this {what}: use it from one thread at a time, or make one for each "
        "thread"
    )
