"""The real server as a child process that tests can kill and restart."""

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
    """The server of `PALMARES_SERVER_BIN`; after a passed test it must end with exit code 0."""

    def __init__(self, data: Path, *args: str) -> None:
        super().__init__(data, args, program=PROGRAM)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        assert self.stop() == 0 or value is not None
