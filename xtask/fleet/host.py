"""One host: a `palmares serve` in its namespace."""

from __future__ import annotations

import os
import re
import signal
import time
from pathlib import Path

from fleet.network import Network
from fleet.services import BUCKET, HOST_PORT, end, freeze
from fleet.shell import Process, attempt, get, run, start, tail, until

KEYS = ("seed.secret", "signing.key")
# Size of a host's data directory, MB. A disk of its own, so that it can be full.
DISK_MB = 192
CACHE_MB = 4


class Host:
    """A host. Its data directory is a file system of its own."""

    def __init__(
        self,
        name: str,
        folder: Path,
        network: Network,
        program: Path,
        database_url: str,
        keys: Path,
        store: str | None,
        in_fleet: bool,
    ) -> None:
        self.name, self.folder, self.network, self.program = name, folder, network, program
        self.address = f"{network.addresses[name]}:{HOST_PORT}"
        self.data = folder / "data"
        self.log = folder / "log"
        self.data.mkdir(parents=True)
        run("mount", "-t", "tmpfs", "-o", f"size={DISK_MB}m,mode=0700", "palmares-fleet", str(self.data))
        settings = f"""name = "Chaos Cup"
mode = "official"
session_s = 86400
reset_cost_s = 0.1
noise = "real"
tasks = ["balls"]
hands = ["pinch"]
listen = "{self.address}"
data_dir = "data"
database_url = "{database_url}"
seed_secret = "{keys / "seed.secret"}"
signing_key = "{keys / "signing.key"}"
max_connections_per_address = 4096
shutdown_grace_s = 20
"""
        if store is not None:
            settings += f'storage = "s3://{BUCKET}"\n'
        if in_fleet:
            settings += f"""[fleet]
host = "{name}"
internal_url = "http://{self.address}"
"""
        (folder / "competition.toml").write_text(settings)
        self.environment = {
            "AWS_ENDPOINT_URL": f"http://{store}",
            "AWS_ACCESS_KEY_ID": "test",
            "AWS_SECRET_ACCESS_KEY": "test",
            "AWS_REGION": "us-east-1",
        }
        self.process: Process | None = None
        # Sums over all incarnations.
        self._counted: dict[str, float] = {}
        self._current: dict[str, float] = {}

    def begin(self) -> None:
        """Start the server; it may not be ready yet."""
        variables = [f"{name}={value}" for name, value in self.environment.items()]
        words = [*self.network.inside(self.name), "env", *variables, str(self.program), "serve"]
        # The disk is a small cache of the replays in the bucket, so that most are only there.
        words += ["--config", "competition.toml", "--practice-replays-mb", str(CACHE_MB)]
        self.process = start(words, self.log, self.folder)

    def is_ready(self) -> bool:
        """Return whether it takes clients."""
        return get(self.address, "/readyz")[0] == 200

    def wait_until_ready(self, limit_s: float = 30.0) -> None:
        """Wait until it takes clients."""

        def ready() -> bool:
            if self.process is not None and self.process.poll() is not None:
                status = self.process.returncode
                raise RuntimeError(f"{self.name} ended with status {status}:\n{tail(self.log)}")
            return self.is_ready()

        until(ready, limit_s, f"{self.name} is ready\n{tail(self.log)}", 0.05)

    def kill(self) -> None:
        """Kill it with SIGKILL."""
        self.count()
        self._counted = self.total()
        self._current = {}
        if self.process is not None:
            end(self.process)

    def freeze(self, seconds: float) -> None:
        """Stop it for some time with SIGSTOP."""
        if self.process is not None:
            freeze(self.process, seconds)

    def terminate(self, limit_s: float = 60.0) -> int:
        """End it with SIGTERM, in order; return its exit status."""
        self.count()
        self._counted = self.total()
        self._current = {}
        assert self.process is not None
        os.killpg(self.process.pid, signal.SIGTERM)
        return self.process.wait(limit_s)

    def fill_disk(self, seconds: float) -> None:
        """Fill the disk of the data directory for some time."""
        filler = self.data / "filler"
        try:
            with filler.open("wb", buffering=0) as file:
                while True:
                    file.write(b"\0" * (1 << 20))
        except OSError:
            pass
        time.sleep(seconds)
        filler.unlink(missing_ok=True)

    def count(self) -> None:
        """Read the counters of this incarnation."""
        status, text = get(self.address, "/metrics")
        if status == 200:
            found = re.findall(r"^(palmares_\w+_total)(?:\{[^}]*\})? ([0-9.e+]+)$", text, re.MULTILINE)
            self._current = {}
            for name, value in found:
                self._current[name] = self._current.get(name, 0.0) + float(value)

    def total(self) -> dict[str, float]:
        """Return the counters, summed over all incarnations as far as they were read."""
        names = {*self._counted, *self._current}
        return {name: self._counted.get(name, 0.0) + self._current.get(name, 0.0) for name in names}

    def close(self) -> None:
        """Kill it, and remove its disk."""
        if self.process is not None:
            end(self.process)
        attempt("umount", "-l", str(self.data))


def make_keys(program: Path, folder: Path) -> None:
    """Let a throwaway server make the secrets that all hosts share."""
    folder.mkdir()
    log = folder / "log"
    words = [str(program), "serve", "--listen", "127.0.0.1:0", "--data-dir", str(folder)]
    (folder / "competition.toml").write_text('name = "Chaos Cup"\nmode = "official"\n')
    server = start([*words, "--config", str(folder / "competition.toml")], log, folder)
    try:
        until(lambda: "listening on" in log.read_text(), 30.0, f"a server that makes the keys\n{tail(log)}")
    finally:
        end(server)
    for name in KEYS:
        (folder / name).chmod(0o600)
