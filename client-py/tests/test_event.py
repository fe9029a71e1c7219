"""A whole event: four teams, two tasks, the usual failures, and an audit at its end.

The leaderboard of the server must be the one that `palmares/examples/leaderboard_from_replays.py` computes
from the replays alone.
"""

from __future__ import annotations

import hashlib
import hmac
import json
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

import palmares
from palmares.net import http
from tests.real_server import PROGRAM, RealServer, needs_server
from tests.test_examples import EXAMPLES, load

pytestmark = needs_server

TEAMS = ("crabs", "geckos", "ibexes", "otters")
CONFIG = """\
name = "the scripted event"
mode = "official"
session_s = 900
tasks = ["balls", "shelf"]
"""
# Longest time in which the server simulates all runs again.
VERIFY_WITHIN_S = 240.0

balls = load("balls_softhand")
shelf = load("shelf_softhand")


class Organizer:
    """Runs `palmares admin` as an organizer does."""

    def __init__(self, server: RealServer, data: Path) -> None:
        self._server, self._token_file = server, data / "organizer.token"

    @property
    def token(self) -> str:
        """Token for the HTTP addresses without a command."""
        return self._token_file.read_text().strip()

    def __call__(self, *args: str) -> Any:
        """Run a command, return the JSON it prints."""
        assert PROGRAM is not None
        where = ["--url", self._server.url, "--token-file", str(self._token_file)]
        command = [PROGRAM, "admin", *where, "--json", *args]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"palmares admin {' '.join(args)}: {done.stderr}{done.stdout}"
        return json.loads(done.stdout)

    def get(self, path: str) -> Any:
        """GET an address."""
        return http.get_json(self._server.url, path, self.token)

    def runs(self) -> dict[str, dict[str, Any]]:
        """Return all runs by id."""
        return {run["run_id"]: run for run in self("export", "runs", "--format", "json")}

    def session(self, team: str) -> dict[str, Any]:
        """Return the team's session."""
        sessions = self("session", "list")["sessions"]
        (own,) = [session for session in sessions if session["team"] == team]
        assert isinstance(own, dict)
        return own


def all_at_once(*parts: Callable[[], Any]) -> list[Any]:
    """Run the parts of several teams at the same time; return their results."""
    with ThreadPoolExecutor(len(parts)) as pool:
        return [future.result() for future in [pool.submit(part) for part in parts]]


def blind_run(client: palmares.Client, ticks: int = 200) -> palmares.Result:
    """Swing the hand through box A with the sensors only; the controller does not react to anything."""
    client.reset("balls", "softhand", sensing="sensors")
    client.step(base=palmares.twist([0.0, 0.0, -0.5], [0.0, 0.0, 0.0]), hand=[0.2], repeat=100)
    for tick in range(0, ticks, 10):
        side = 0.6 if tick % 80 < 40 else -0.6
        client.step(base=palmares.twist([side, 0.3, 0.0], [0.0, 0.0, 1.0]), hand=[0.4], repeat=10)
    return client.stop()


def forge(replay: Path) -> None:
    """Raise the score in a replay."""
    data = bytearray(replay.read_bytes())
    at = data.rindex(b'"score":') + len(b'"score":')
    assert chr(data[at]) in "-0123456789"
    data[at] = ord("9")
    replay.write_bytes(data)


@pytest.fixture
def stage(tmp_path: Path) -> tuple[Path, tuple[str, ...]]:
    config = tmp_path / "competition.toml"
    config.write_text(CONFIG)
    data = tmp_path / "data"
    data.mkdir()
    return data, ("--config", str(config))


def test_a_scripted_event(stage: tuple[Path, tuple[str, ...]]) -> None:
    data, options = stage
    with RealServer(data, *options) as server:
        organizer = Organizer(server, data)
        tokens = {team: organizer("team", "add", team)["token"] for team in TEAMS}
        commitment = organizer.get("/v1/competition")["seed_secret_sha256"]

        # Without a token no client is admitted, and before the opening no team can play.
        with pytest.raises(palmares.NotAuthorizedError):
            palmares.Client(server.url, token="")
        with (
            pytest.raises(palmares.PalmaresError, match="open"),
            palmares.Client(server.url, token=tokens["crabs"]) as early,
        ):
            early.reset("balls", "softhand")
        organizer("open")

        crabs, geckos, ibexes, otters = [
            palmares.Client(server.url, token=tokens[team], reconnect_s=60.0) for team in TEAMS
        ]

        # All teams play at the same time.
        first = all_at_once(
            lambda: balls.run(crabs, None, 3),
            lambda: blind_run(geckos),
            lambda: balls.run(ibexes, None, 1),
            lambda: balls.run(otters, None, 2),
        )
        assert max(first[0].score, first[2].score, first[3].score) >= 1.0, "no ball at all was moved"

        # Two disconnects in one run.
        obs = ibexes.reset("balls", "softhand")
        for cut in (1, 2):
            ibexes._link.abort()
            assert ibexes.step(hand=[0.1 * cut]).run_id == obs.run_id
        assert ibexes.stop().ticks == 2

        # A pause stops the session's clock and the run.
        otters.reset("balls", "softhand")
        otters.step(repeat=5)
        own = organizer.session("otters")["session_id"]
        organizer("session", "pause", own, "--reason", "the projector fell")
        left = otters.time().session_left_s
        time.sleep(1.5)
        assert otters.time().session_left_s == left
        organizer("session", "resume", own, "--reason", "it hangs again")
        assert otters.step().tick == 6
        assert otters.stop().ticks == 6

        # The server is killed during two runs. They are void, and their time is given back.
        before = {}
        for client in (crabs, otters):
            before[client] = client.time().session_left_s
            client.reset("balls", "softhand")
            client.step(hand=[0.3], repeat=80)
        server.kill()
        server.start()
        for client in (crabs, otters):
            with pytest.raises(palmares.RunLostError):
                client.step()
            left, left_before = client.time().session_left_s, before[client]
            assert left is not None
            assert left_before is not None
            # At most the time before the run, and a little less: time passes between the two requests.
            assert left_before - 20.0 < left <= left_before

        # The other task; a leaked token is rotated: its connections close, and it opens no new one.
        leaked = tokens["geckos"]
        second = all_at_once(
            lambda: shelf.run(crabs, None, 1),
            lambda: balls.run(otters, None, 2),
            lambda: shelf.run(ibexes, None, 1),
        )
        assert all(summary.run_id for summary in second)
        tokens["geckos"] = organizer("team", "rotate", "geckos")["token"]
        with pytest.raises(palmares.PalmaresError):
            geckos.reset("balls", "softhand")
        with pytest.raises(palmares.NotAuthorizedError):
            palmares.Client(server.url, token=leaked)

        for client in (crabs, ibexes, otters):
            client.close()
        organizer("close")
        verified(organizer)

        # An intruder with access to the disk changes a score.
        best = max(organizer.runs().values(), key=lambda run: (run["task"] == "balls", run["score"] or 0.0))
        replays = data / "replays"
        forge(replays / f"{best['run_id']}.mcap")
        organizer("run", "reverify", best["run_id"], "--reason", "an anonymous letter")
        runs = verified(organizer)
        assert runs[best["run_id"]]["status"] == "rejected"

        # The audit compares the server's results with those of the replays.
        states = [run["status"] for run in runs.values()]
        aborted = [run_id for run_id, run in runs.items() if run["status"] == "aborted"]
        recorded = [
            entry["subject"] for entry in organizer("audit")["records"] if entry["action"] == "run.abort"
        ]
        assert len(aborted) == 2
        assert sorted(recorded) == sorted(aborted)
        assert states.count("rejected") == 1
        assert set(states) == {"verified", "aborted", "rejected"}
        ours = organizer.get("/v1/leaderboard")["rows"]
        theirs = from_replays(replays, organizer.get("/v1/competition")["replay_key"], runs, best["run_id"])
        assert [without_times(row) for row in ours] == [without_times(row) for row in theirs]
        assert {row["team"] for row in ours} == set(TEAMS)
        assert [row["team"] for row in ours if row["sensors_only"]] == ["geckos"]

        # The seeds were fixed before the first run.
        for team in TEAMS:
            organizer(
                "session", "end", organizer.session(team)["session_id"], "--reason", "the event is over"
            )
        organizer("reveal", "--yes")
        secret = bytes.fromhex(organizer.get("/v1/competition")["seed_secret"])
        assert hashlib.sha256(secret).hexdigest() == commitment
        for run in organizer.runs().values():
            counted = run["task"].encode() + b"\0" + int(run["k"]).to_bytes(8, "little")
            assert run["seed_hex"] == hmac.digest(secret, counted, "sha256").hex()


def verified(organizer: Organizer) -> dict[str, dict[str, Any]]:
    """Wait until the server has simulated every run again."""
    deadline = time.monotonic() + VERIFY_WITHIN_S
    while True:
        runs = organizer.runs()
        waiting = [
            run["run_id"]
            for run in runs.values()
            if run["status"] in ("open", "provisional") or "verify_state" in run
        ]
        if not waiting:
            return runs
        assert time.monotonic() < deadline, f"still not verified: {waiting}"
        time.sleep(0.5)


def from_replays(
    folder: Path, key: str, runs: dict[str, dict[str, Any]], forged: str
) -> list[dict[str, Any]]:
    """Compute the leaderboard without the server; this must refuse the forged replay, too."""
    void = [run_id for run_id, run in runs.items() if run["status"] == "aborted"]
    script = [sys.executable, str(EXAMPLES / "leaderboard_from_replays.py"), str(folder), "--key", key]
    done = subprocess.run([*script, "--void", *void], capture_output=True, text=True, check=False)
    books = json.loads(done.stdout)
    assert list(books["refused"]) == [f"{forged}.mcap"], done.stderr
    rows = books["rows"]
    assert isinstance(rows, list)
    return rows


def without_times(row: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of both leaderboards."""
    best = {task: (run["score"], run["run_id"]) for task, run in row["tasks"].items()}
    return {key: row[key] for key in ("rank", "team", "total", "runs", "sensors_only")} | {"tasks": best}
