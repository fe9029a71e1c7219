"""Postgres, the object store and the proxy."""

from __future__ import annotations

import json
import os
import shutil
import signal
import time
from pathlib import Path
from typing import Any

from fleet.network import Network
from fleet.shell import Process, attempt, get, request, run, start, tail, until

DATABASE, STORE, PROXY, CLIENTS = "db", "s3", "proxy", "clients"
ADDRESSES = {DATABASE: "10.77.0.2", STORE: "10.77.0.3", PROXY: "10.77.0.4", CLIENTS: "10.77.0.5"}
HOST_PORT = 8700
PROXY_PORT = 8080
STORE_PORT = 5000
BUCKET = "palmares"


def host_address(number: int) -> str:
    """Return the address of a host, from 1."""
    return f"10.77.0.{10 + number}"


def postgres_folder() -> Path:
    """Return the folder of Postgres's programs."""
    debian = sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    for folder in (*debian, Path("/usr/local/bin"), Path("/usr/bin")):
        if all((folder / name).exists() for name in ("initdb", "postgres", "pg_ctl", "psql")):
            return folder
    raise SystemExit("Postgres is not installed (Debian: apt-get install postgresql)")


class Postgres:
    """A database server of its own; `network` is None for one on a socket only."""

    def __init__(self, folder: Path, network: Network | None) -> None:
        self.folder = folder
        self.programs = postgres_folder()
        inside = network.inside(DATABASE) if network else []
        self._as_user = [*inside, "runuser", "-u", "postgres", "--"]
        folder.mkdir()
        shutil.chown(folder, "postgres")
        data = str(folder / "data")
        self._control = [*self._as_user, str(self.programs / "pg_ctl"), "-D", data, "-w", "-l", f"{data}.log"]
        words = ["--username=palmares", "--auth=trust", "--no-sync", "--encoding=UTF8", "--locale=C"]
        run(*self._as_user, str(self.programs / "initdb"), "--pgdata", data, *words)
        settings = [
            f"listen_addresses = '{'*' if network else ''}'",
            f"unix_socket_directories = '{folder}'",
            "max_connections = 200",
        ]
        with (folder / "data/postgresql.conf").open("a") as file:
            file.write("\n".join(settings) + "\n")
        with (folder / "data/pg_hba.conf").open("a") as file:
            file.write("host all all 10.77.0.0/24 trust\n")
        self.begin()
        self.sql("CREATE DATABASE cup", "postgres")
        socket = str(folder).replace("/", "%2F")
        place = f"{ADDRESSES[DATABASE]}:5432" if network else socket
        self.url = f"postgres://palmares@{place}/cup"

    def begin(self) -> None:
        """Start the server and wait until it answers."""
        run(*self._control, "start")

    def end(self, mode: str) -> None:
        """Stop the server: `fast` closes it in order, `immediate` is a crash."""
        run(*self._control, "-m", mode, "stop")

    def close(self) -> None:
        """Stop the server, if it runs."""
        attempt(*self._control, "-m", "immediate", "stop")

    def sql(self, statement: str, database: str = "cup", timeout_s: float = 900.0) -> str:
        """Execute a statement; return its rows as text."""
        program = str(self.programs / "psql")
        words = ["-X", "-q", "-A", "-t", "-v", "ON_ERROR_STOP=1", "-h", str(self.folder), "-U", "palmares"]
        return run(program, *words, "-d", database, "-c", statement, timeout_s=timeout_s).strip()

    def rows(self, query: str) -> list[dict[str, Any]]:
        """Return the rows of a query."""
        found = self.sql(f"SELECT COALESCE(json_agg(t), '[]'::json) FROM ({query}) AS t")
        rows: list[dict[str, Any]] = json.loads(found)
        return rows


class ObjectStore:
    """An S3 server (moto), with one bucket. It keeps objects in memory."""

    def __init__(self, folder: Path, network: Network, program: Path) -> None:
        self.address = f"{ADDRESSES[STORE]}:{STORE_PORT}"
        self.log = folder / "s3.log"
        words = [str(program), "-H", ADDRESSES[STORE], "-p", str(STORE_PORT)]
        self.process = start([*network.inside(STORE), *words], self.log)
        until(lambda: get(self.address, "/")[0] != 0, 30.0, f"the object store\n{tail(self.log)}", 0.1)
        status, answer = request("PUT", self.address, f"/{BUCKET}", timeout_s=10.0)
        if status != 200:
            raise RuntimeError(f"no bucket: {status} {answer}")

    def close(self) -> None:
        """Stop the server."""
        end(self.process)


class Proxy:
    """HAProxy in front of the hosts."""

    def __init__(self, folder: Path, network: Network, hosts: list[str]) -> None:
        self.file = folder / "haproxy.cfg"
        self.log = folder / "haproxy.log"
        # The file for an event, with other addresses and plain HTTP.
        lines = (Path(__file__).parents[2] / "deploy/haproxy/haproxy.cfg").read_text().splitlines()
        bind = f"    bind {ADDRESSES[PROXY]}:{PROXY_PORT}"
        kept = [bind if line.startswith("    bind ") else line for line in lines]
        kept = [line for line in kept if not line.startswith("    server ")]
        kept += [f"    server {host} {network.addresses[host]}:{HOST_PORT}" for host in hosts]
        self.file.write_text("\n".join([*kept, ""]))
        run("haproxy", "-c", "-f", str(self.file))
        self.address = f"{ADDRESSES[PROXY]}:{PROXY_PORT}"
        self._words = [*network.inside(PROXY), "haproxy", "-db", "-f", str(self.file)]
        self.begin()

    def begin(self) -> None:
        """Start it."""
        self.process = start(self._words, self.log)
        until(lambda: get(self.address, "/")[0] != 0, 10.0, f"HAProxy\n{tail(self.log)}")

    def kill(self) -> None:
        """Kill it; all connections through it break."""
        end(self.process)

    close = kill


def end(process: Process) -> None:
    """Kill a process and its group."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGCONT)
        os.killpg(process.pid, signal.SIGKILL)
    process.wait(10.0)


def freeze(process: Process, seconds: float) -> None:
    """Stop a process for some time, as a machine that swaps or migrates does."""
    os.killpg(process.pid, signal.SIGSTOP)
    time.sleep(seconds)
    os.killpg(process.pid, signal.SIGCONT)
