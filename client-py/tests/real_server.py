"""The real server as a child process, which can be killed and restarted."""

from __future__ import annotations

import os
from pathlib import Path
from types import TracebackType

import pytest

from palmares.server import Server

PROGRAM = os.environ.get("PALMARES_SERVER_BIN")

needs_server = pytest.mark.skipif(
    PROGRAM is None, reason="PALMARES_SERVER_BIN does not name a palmares program; `cargo xtask test` sets it"
)


class RealServer(Server):
    """A server that is told by the environment, and ends well after every test that does."""

    def __init__(self, data: Path, *args: str) -> None:
        super().__init__(data, args, program=PROGRAM)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        assert self.stop() == 0 or value is not None
