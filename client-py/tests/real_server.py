"""The real server as a child process, which can be killed and restarted."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from types import TracebackType
from typing import Self

import pytest

PROGRAM = os.environ.get("PALMARES_SERVER_BIN")

needs_server = pytest.mark.skipif(
    PROGRAM is None, reason="PALMARES_SERVER_BIN does not name a palmares program; `cargo xtask test` sets it"
)


class RealServer:
    """A server with a data directory of its own.

    Attributes:
        url: Where it listens; a restart listens there again.

    """

    def __init__(self, data: Path, *args: str) -> None:
        self._data, self._args = data, args
        self.url = ""
        self._child: subprocess.Popen[str] | None = None
        self.start()

    def start(self) -> None:
        """Start it, or start it again."""
        assert PROGRAM is not None
        listen = self.url.removeprefix("http://") or "127.0.0.1:0"
        command = [PROGRAM, "serve", "--listen", listen, "--data-dir", str(self._data), *self._args]
        log_path = self._data / "server.log"
        with log_path.open("a") as log:
            self._child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
        assert self._child.stdout is not None
        line = self._child.stdout.readline()  # "listening on http://127.0.0.1:40123"
        if not line.startswith("listening on "):
            self._child.kill()
            pytest.fail(log_path.read_text())
        self.url = line.removeprefix("listening on ").strip()

    def kill(self) -> None:
        """Kill it, which leaves it no time to save anything."""
        assert self._child is not None
        self._child.kill()
        self._child.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        assert self._child is not None
        assert self._child.stdout is not None
        self._child.terminate()
        status = self._child.wait(timeout=30)
        self._child.stdout.close()
        assert status == 0 or value is not None
