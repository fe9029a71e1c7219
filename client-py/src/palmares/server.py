"""A practice server as a child process."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from palmares.errors import NoServerError

STOP_WITHIN_S = 40.0


class Server:
    """``palmares serve`` as a child process.

    >>> with palmares.server.Server(Path("data")) as server:        # doctest: +SKIP
    ...     client = palmares.Client(server.url)

    Args:
        data: Folder of its database, replays and log (``server.log``); made if missing.
        args: Further arguments of ``palmares serve``.
        program: The ``palmares`` program; left out, the one of this package.
        listen: Address and port; any free port when left out.

    Attributes:
        url: Its address; `start` after `kill` uses the same one.

    Raises:
        NoServerError: It does not start; the message has its output.

    """

    def __init__(
        self,
        data: Path,
        args: Sequence[str] = (),
        *,
        program: str | None = None,
        listen: str = "127.0.0.1:0",
    ) -> None:
        self._data, self._args = data, args
        self._program = [sys.executable, "-m", "palmares"] if program is None else [program]
        self._listen = listen
        self.url = ""
        self.start()

    def start(self) -> None:
        """Start the server, also after `kill`."""
        listen = self.url.removeprefix("http://") or self._listen
        self._data.mkdir(parents=True, exist_ok=True)
        command = [*self._program, "serve", "--listen", listen, "--data-dir", str(self._data), *self._args]
        log_path = self._data / "server.log"
        with log_path.open("a") as log:
            self._child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
        assert self._child.stdout is not None
        line = self._child.stdout.readline()  # "listening on http://127.0.0.1:40123"
        if not line.startswith("listening on "):
            self._child.kill()
            self._child.wait()
            said = log_path.read_text().strip()
            raise NoServerError(f"`{' '.join(command)}` does not start:\n{line}{said}")
        self.url = line.removeprefix("listening on ").strip()

    def kill(self) -> None:
        """Kill the server; it saves nothing."""
        self._child.kill()
        self._child.wait()

    def stop(self) -> int:
        """End the server, which first stops and scores open runs; return its exit code."""
        self._child.send_signal(signal.SIGTERM)
        try:
            return self._child.wait(timeout=STOP_WITHIN_S)
        finally:
            self._child.kill()
            if self._child.stdout is not None:
                self._child.stdout.close()

    def wait(self) -> int:
        """Wait until the server ends, for example by Ctrl-C; return its exit code."""
        return self._child.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()
