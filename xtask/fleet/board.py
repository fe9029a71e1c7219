"""The ranking of a large event: how long it takes, how often it is read, and its cost for a finished run."""

from __future__ import annotations

import json
import re
import sqlite3
import statistics
import threading
import time
from pathlib import Path
from typing import Any

from websockets.sync.client import connect

from fleet.server import Server
from fleet.services import Postgres
from fleet.shell import get, request, run, until

RULES = 'name = "Board Cup"\nmode = "official"\n'
TASKS = ("balls", "shelf")
VIEWERS = 100
# Readings that are timed without viewers.
READINGS = 15
JUST_S = 4.0
# How long the viewers watch while results come, s.
WATCH_S = 15.0
# Turns with and without the ranking, and the finished runs that are timed in each.
TURNS = 4
FINISHES = 100
# The goals, s: reading the ranking, and the further cost of a finished run.
RANKING_S = 0.050
FINISH_S = 0.005

COLUMNS = (
    "run_id, session_id, team, task, hand, mode, sensing, seed_hex, server_version, build_hash, "
    "started_at, ended_at, status, score, k"
)
# Run i: its team, task, number and score follow from i, so that both databases have the same runs.
ROW = (
    "'run_' || i, 's-' || (i % {teams}), 'team-' || (i % {teams}), "
    "CASE (i / {teams}) % 2 WHEN 0 THEN 'balls' ELSE 'shelf' END, "
    "'pinch', 'lockstep', 'sensors', '00', '0', '0', i, {ended}, {status}, {score}, i / {teams} + 1"
)
FINISHED = {"ended": "1000000 + i", "status": "'verified'", "score": "((i * 7919) % 1000) / 10.0"}
OPEN = {"ended": "NULL", "status": "'open'", "score": "NULL"}
SESSIONS = (
    "INSERT INTO sessions (session_id, team, mode, created_at, status, ended_at) "
    "SELECT 's-' || i, 'team-' || i, 'official', 0, 'ended', 1 FROM "
)


def numbers(postgres: bool, first: int, end: int) -> str:
    """Return a table of the numbers i."""
    if postgres:
        return f"generate_series({first}::bigint, {end - 1}) AS n(i)"
    series = f"SELECT {first} AS i UNION ALL SELECT i + 1 FROM n WHERE i < {end - 1}"
    return f"(WITH RECURSIVE n AS ({series}) SELECT i FROM n)"


def inserts(postgres: bool, teams: int, runs: int) -> list[str]:
    """Return the statements that fill the database."""
    finished, opened = ROW.format(teams=teams, **FINISHED), ROW.format(teams=teams, **OPEN)
    end = runs + 2 * TURNS * FINISHES
    return [
        SESSIONS + numbers(postgres, 0, teams),
        f"INSERT INTO runs ({COLUMNS}) SELECT {finished} FROM {numbers(postgres, 0, runs)}",
        f"INSERT INTO runs ({COLUMNS}) SELECT {opened} FROM {numbers(postgres, runs, end)}",
    ]


# As the server finishes a run.
FINISH = (
    "UPDATE runs SET status = 'provisional', score = {score}, ended_at = 2000000, ticks = 1 "
    "WHERE run_id = 'run_{i}'"
)


def readings(server: Server) -> tuple[float, float]:
    """Return how often the ranking was read, and how long that took in all, s."""
    text = get(server.address, "/metrics", 30.0)[1]
    count, total = (
        re.search(rf"^palmares_ranking_read_seconds_{kind} (\S+)$", text, re.MULTILINE)
        for kind in ("count", "sum")
    )
    assert count is not None
    assert total is not None
    return float(count[1]), float(total[1])


class Database:
    """Executes statements in either database, beside the server."""

    def __init__(self, postgres: Postgres | None, file: Path) -> None:
        self.postgres = postgres
        self.triggers: list[str] = []
        self.sqlite = None if postgres else sqlite3.connect(file, isolation_level=None, timeout=30.0)
        if self.sqlite:
            # As the server sets it.
            self.sqlite.executescript("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL")

    def fill(self, statements: list[str]) -> None:
        """Execute statements in one transaction."""
        if self.postgres:
            self.postgres.sql("; ".join(statements))
            # One transaction leaves a million dead rows, which the database removes meanwhile in an event.
            self.postgres.sql("VACUUM FULL best")
            self.postgres.sql("VACUUM ANALYZE")
        elif self.sqlite:
            for statement in ("BEGIN IMMEDIATE", *statements, "COMMIT", "ANALYZE"):
                self.sqlite.execute(statement)

    def times(self, statements: list[str]) -> list[float]:
        """Execute statements, each in a transaction of its own; return their times, s."""
        if self.postgres:
            text = "\\timing on\n" + ";\n".join(statements) + ";\n"
            words = ["-X", "-q", "-h", str(self.postgres.folder), "-U", "palmares", "-d", "cup"]
            output = run(str(self.postgres.programs / "psql"), *words, text=text, timeout_s=300.0)
            return [float(ms) / 1000 for ms in re.findall(r"Time: ([0-9.]+) ms", output)]
        assert self.sqlite
        took = []
        for statement in statements:
            began = time.perf_counter()
            self.sqlite.execute(statement)
            took.append(time.perf_counter() - began)
        return took

    def keep_ranking(self, kept: bool) -> None:
        """Switch the triggers that keep the ranking on or off."""
        if self.postgres:
            self.postgres.sql(f"ALTER TABLE runs {'ENABLE' if kept else 'DISABLE'} TRIGGER USER")
        elif self.sqlite and not kept:
            triggers = "SELECT name, sql FROM sqlite_master WHERE tbl_name = 'runs' AND type = 'trigger'"
            for name, sql in self.sqlite.execute(triggers).fetchall():
                self.triggers.append(sql)
                self.sqlite.execute(f"DROP TRIGGER {name}")
        elif self.sqlite:
            for sql in self.triggers:
                self.sqlite.execute(sql)
            self.triggers.clear()

    def finish_times(self, first: int) -> tuple[float, float]:
        """Finish runs from number `first` on; return the medians with and without the ranking, s."""
        took: dict[bool, list[float]] = {True: [], False: []}
        for turn in range(2 * TURNS):
            kept = turn % 2 == 0
            self.keep_ranking(kept)
            took[kept] += self.times(finishes(first + turn * FINISHES))
        self.keep_ranking(True)
        return statistics.median(took[True]), statistics.median(took[False])

    def close(self) -> None:
        """Close the file."""
        if self.sqlite:
            self.sqlite.close()


def finishes(first: int) -> list[str]:
    """Return the statements that finish `FINISHES` runs from number `first` on."""
    return [FINISH.format(score=(i * 31 % 1000) / 10, i=i) for i in range(first, first + FINISHES)]


def watch(address: str, sockets: list[Any], rows: list[int]) -> None:
    """Subscribe to the ranking until the socket closes; count the rankings."""
    with connect(f"ws://{address}/v1/watch", subprotocols=["palmares.v1.json"], max_size=None) as socket:  # type: ignore[list-item]
        sockets.append(socket)
        socket.send(json.dumps({"op": "subscribe", "id": 1, "leaderboard": True}))
        for message in socket:
            if '"op":"leaderboard"' in str(message)[:40]:
                rows.append(len(message))


def measure(program: Path, folder: Path, postgres: Postgres | None, teams: int, runs: int) -> dict[str, Any]:
    """Fill a database and measure; return the figures."""
    # The server makes the tables.
    url = postgres.url if postgres else None
    Server(program, folder, RULES, url).close()
    database = Database(postgres, folder / "data-sqlite/palmares.sqlite")
    began = time.perf_counter()
    database.fill(inserts(postgres is not None, teams, runs))
    filled = time.perf_counter() - began
    server = Server(program, folder, RULES, url)
    try:
        status, body = get(server.address, "/v1/leaderboard", 120.0)
        rows = len(json.loads(body)["rows"])
        assert (status, rows) == (200, teams), (status, rows)
        first = readings(server)[1]
        token = server.token.read_text().strip()
        # Rows that have just changed are read again.
        time.sleep(JUST_S)
        # After one change each, and more than a second after the reading before.
        for number in range(READINGS):
            void(server.address, token, number)
            time.sleep(1.1)
            get(server.address, "/v1/leaderboard", 30.0)
        ranking = (readings(server)[1] - first) / READINGS
        sockets: list[Any] = []
        got: list[int] = []
        for _ in range(VIEWERS):
            threading.Thread(target=watch, args=(server.address, sockets, got), daemon=True).start()
        until(lambda: len(got) >= VIEWERS, 120.0, f"{VIEWERS} viewers have the ranking", 0.1)
        count, total = readings(server)
        began = time.perf_counter()
        judged = 0
        while time.perf_counter() - began < WATCH_S:
            # The server itself changes the ranking, many times a second.
            void(server.address, token, runs - 1 - judged)
            judged += 1
            time.sleep(0.02)
        lasted = time.perf_counter() - began
        count, total = (
            after - before for after, before in zip(readings(server), (count, total), strict=True)
        )
        for socket in list(sockets):
            socket.close()
    finally:
        server.close()
    with_ranking, without = database.finish_times(runs)
    database.close()
    return {
        "filled_s": round(filled, 1),
        "ranking_first_s": round(first, 4),
        "ranking_s": round(ranking, 4),
        "ranking_beside_viewers_s": round(total / count, 4),
        "changes": judged,
        "reads_per_s": round(count / lasted, 2),
        "finish_s": round(with_ranking, 5),
        "finish_without_ranking_s": round(without, 5),
    }


def void(address: str, token: str, number: int) -> None:
    """Void a run, as an organizer does."""
    status, answer = request(
        "POST",
        address,
        "/v1/admin/run/void",
        json.dumps({"run_id": f"run_{number}", "reason": "measured"}),
        30.0,
        **{"Authorization": f"Bearer {token}", "Content-Type": "application/json"},
    )
    assert status == 200, answer


def board(folder: Path, program: Path, teams: int, runs: int) -> tuple[dict[str, Any], bool]:
    """Measure both databases; return the report, and whether the goals are met."""
    report: dict[str, Any] = {"teams": teams, "runs": runs, "viewers": VIEWERS}
    holds = True
    postgres = Postgres(folder / "postgres", None)
    try:
        for name, server in (("sqlite", None), ("postgres", postgres)):
            figures = measure(program, folder, server, teams, runs)
            print(name, json.dumps(figures), flush=True)
            report[name] = figures
            further = figures["finish_s"] - figures["finish_without_ranking_s"]
            holds = holds and figures["ranking_s"] <= RANKING_S and figures["reads_per_s"] <= 1.0
            holds = holds and further <= FINISH_S
    finally:
        postgres.close()
    return report, holds
