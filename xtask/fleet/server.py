"""One server on loopback, without a fleet."""

from __future__ import annotations

import os
import re
import signal
from pathlib import Path

from fleet.services import end
from fleet.shell import Process, run, start, tail, until


class Server:
    """A `palmares serve` with these rules and a data directory of its own; `url` is a Postgres database."""

    def __init__(self, program: Path, folder: Path, rules: str, url: str | None = None) -> None:
        self.program = program
        self.log = folder / f"server-{'postgres' if url else 'sqlite'}.log"
        self.data = folder / ("data-postgres" if url else "data-sqlite")
        config = folder / "competition.toml"
        config.write_text(rules)
        words = [str(program), "serve", "--listen", "127.0.0.1:0", "--data-dir", str(self.data)]
        words += ["--config", str(config), *(["--database-url", url] if url else [])]
        self.log.unlink(missing_ok=True)
        self.process: Process = start(words, self.log)
        found = re.compile(r"listening on http://(\S+)")

        def listens() -> bool:
            if self.process.poll() is not None:
                raise RuntimeError(f"the server ended:\n{tail(self.log)}")
            return found.search(self.log.read_text()) is not None

        until(listens, 60.0, "a server")
        match = found.search(self.log.read_text())
        assert match
        self.address = match[1]

    @property
    def token(self) -> Path:
        """The file of the first organizer's token."""
        return self.data / "organizer.token"

    def admin(self, *words: str) -> str:
        """Run `palmares admin`."""
        url = f"http://{self.address}"
        return run(str(self.program), "admin", "--url", url, "--token-file", str(self.token), *words)

    def close(self) -> None:
        """End it in order."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGTERM)
        try:
            self.process.wait(15.0)
        finally:
            end(self.process)
