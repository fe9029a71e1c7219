"""The whole installation: services, hosts and teams."""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from fleet.host import Host, make_keys
from fleet.network import Network
from fleet.services import (
    ADDRESSES,
    CLIENTS,
    PROXY,
    PROXY_PORT,
    STORE,
    ObjectStore,
    Postgres,
    Proxy,
    end,
    host_address,
)
from fleet.shell import Process, run, start, tail, until

MODES = ("lockstep", "realtime")


class Fleet:
    """Hosts with their services, and teams that play."""

    def __init__(self, folder: Path, program: Path, hosts: int, moto: Path | None, teams: int) -> None:
        self.folder, self.program = folder, program
        self.players: list[Process] = []
        self.stop = folder / "stop"
        self.record = folder / "record.jsonl"
        self.hosts: list[Host] = []
        self.postgres: Postgres | None = None
        self.store: ObjectStore | None = None
        self.proxy: Proxy | None = None
        self.network = Network()
        try:
            self._build(hosts, moto)
            self._add_teams(teams)
        except BaseException:
            self.close()
            raise

    def _build(self, hosts: int, moto: Path | None) -> None:
        for name, address in ADDRESSES.items():
            self.network.add(name, address)
        names = [f"h{number}" for number in range(1, hosts + 1)]
        for number, name in enumerate(names, start=1):
            self.network.add(name, host_address(number))
        self.postgres = Postgres(self.folder / "postgres", self.network)
        keys = self.folder / "keys"
        make_keys(self.program, keys)
        # One host needs no object store.
        if hosts > 1 and moto is not None:
            self.store = ObjectStore(self.folder, self.network, moto)
        for name in names:
            store = self.store.address if self.store else None
            place = self.folder / name
            place.mkdir()
            host = Host(name, place, self.network, self.program, self.postgres.url, keys, store, hosts > 1)
            self.hosts.append(host)
        # The first one migrates the database.
        for host in self.hosts:
            host.begin()
            host.wait_until_ready()
        self.proxy = Proxy(self.folder, self.network, names)
        self.url = f"http://{ADDRESSES[PROXY]}:{PROXY_PORT}"

    def admin(self, *words: str) -> str:
        """Run `palmares admin` as the first organizer."""
        tokens = [host.data / "organizer.token" for host in self.hosts]
        token = next(token for token in tokens if token.exists())
        url = f"http://{self.hosts[0].address}"
        return run(str(self.program), "admin", "--url", url, "--token-file", str(token), *words)

    def _add_teams(self, teams: int) -> None:
        self.teams: dict[str, dict[str, str]] = {mode: {} for mode in MODES}
        for number in range(teams):
            mode = MODES[number % 2]
            name = f"{mode}-{number // 2}"
            self.teams[mode][name] = json.loads(self.admin("team", "add", name))["token"]
        self.admin("open", "--reason", "chaos")

    def play(self) -> None:
        """Start the teams; each process has half of those of one mode."""
        harness = Path(__file__).parents[1]
        client = harness.parent / "client-py/src"
        for mode, tokens in self.teams.items():
            names = list(tokens)
            for part in (names[0::2], names[1::2]):
                file = self.folder / f"{mode}-{len(self.players)}.json"
                file.write_text(json.dumps({name: tokens[name] for name in part}))
                words = [
                    *self.network.inside(CLIENTS),
                    "env",
                    f"PYTHONPATH={client}:{harness}",
                    sys.executable,
                ]
                words += ["-m", "fleet.clients", "--url", self.url, "--tokens", str(file)]
                words += ["--record", str(self.record), "--stop", str(self.stop), "--mode", mode]
                self.players.append(start(words, self.folder / "clients.log"))

        def all_play() -> bool:
            return len({event["team"] for event in self.events() if event["event"] == "begun"}) == sum(
                len(tokens) for tokens in self.teams.values()
            )

        until(all_play, 60.0, f"every team plays\n{tail(self.folder / 'clients.log')}", 0.2)

    def stop_players(self, limit_s: float) -> int:
        """Let the teams finish their runs; return how many do not."""
        self.stop.touch()
        teams = sum(len(tokens) for tokens in self.teams.values())
        deadline = time.monotonic() + limit_s
        while time.monotonic() < deadline and any(player.poll() is None for player in self.players):
            time.sleep(0.1)
        return teams - len([event for event in self.events() if event["event"] == "over"])

    def events(self) -> list[dict[str, Any]]:
        """Return what the teams have reported until now."""
        if not self.record.exists():
            return []
        lines = self.record.read_text().splitlines()
        return [json.loads(line) for line in lines if line.endswith("}")]

    def heal(self) -> None:
        """End every cut."""
        for host in self.hosts:
            for other in self.network.addresses:
                self.network.heal(host.name, other)
        for other in self.network.addresses:
            self.network.heal(STORE, other)

    def close(self) -> None:
        """End everything."""
        for player in self.players:
            end(player)
        for part in (*self.hosts, self.proxy, self.store, self.postgres):
            if part is not None:
                part.close()
        self.network.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is not None:
            for log in (self.folder / "clients.log", *(host.log for host in self.hosts)):
                print(f"--- {log}\n{tail(log, 8)}", file=sys.stderr)
        self.close()


def check_machine() -> None:
    """Refuse a machine that cannot have namespaces."""
    if os.geteuid() != 0:
        raise SystemExit("this needs root, for network namespaces")
