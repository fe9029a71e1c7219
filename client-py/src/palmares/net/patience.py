"""Waits after a fault of the server that lost nothing, before the same request is sent again."""

from __future__ import annotations

import logging
import time

from palmares.errors import InternalError, WorldFaultError

LOG = logging.getLogger("palmares")

# Waits between tries, in multiples of `InternalError.retry_after_s`: usually half a minute in all.
WAITS = (1.0, 1.0, 2.0, 4.0, 8.0, 16.0)


class Patience:
    """The tries of one request."""

    def __init__(self) -> None:
        self._tries = 0

    def wait(self, failed: InternalError) -> None:
        """Wait after a failed try.

        Raises:
            InternalError: The server does not say that another try may succeed, or there were enough.

        """
        self._tries += 1
        after_s = failed.retry_after_s
        if after_s is None or isinstance(failed, WorldFaultError):
            raise failed
        if self._tries > len(WAITS):
            raise InternalError(f"{failed}; tried {self._tries} times", retry_after_s=after_s) from failed
        wait_s = WAITS[self._tries - 1] * after_s
        LOG.warning("try %d failed, trying again in %g s: %s", self._tries, wait_s, failed)
        time.sleep(wait_s)
