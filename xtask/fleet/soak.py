"""A server under load for a long time: memory must stay, and nothing may be left when everybody has gone."""

from __future__ import annotations

import json
import random
import sys
import threading
import time
from pathlib import Path
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from fleet.server import Server
from fleet.services import end
from fleet.shell import Process, get, start, tail, until

# Sessions are short, so that many begin and end.
SESSION_S = 45
RULES = f"""name = "Soak Cup"
mode = "official"
session_s = {SESSION_S}
sessions_per_team = 1000
reset_cost_s = 0.1
tasks = ["balls"]
hands = ["pinch"]
max_connections_per_address = 4096
"""
MODES = ("lockstep", "realtime")
VIEWERS = 6
# A viewer stays this long at most, s; every other one leaves without a word.
VIEW_S = 20.0
# Memory is compared with that after this time, and may have grown by this share.
SETTLED_S = 300.0
GROWTH = 0.03
# Longest time until everything has ended after the last client, s: a session and its grace period.
EMPTY_S = 150.0
READ_S = 5.0
JSON = Subprotocol("palmares.v1.json")
GAUGES = {
    "worlds": "palmares_worlds_open",
    "sessions": "palmares_sessions_open",
    "viewers": "palmares_viewers",
    "memory": "process_resident_memory_bytes",
    "files": "process_open_fds",
    "threads": "process_threads",
    "tasks": "process_tasks",
}
# At most so many may be left beyond those before the first client. The database pool opens connections
# when it needs them, each with at most two files.
LEFT = {"worlds": 0, "sessions": 0, "viewers": 0, "tasks": 0, "files": 8}


def gauges(server: Server) -> dict[str, int]:
    """Return the gauges."""
    status, text = get(server.address, "/metrics", 10.0)
    if status != 200:
        raise RuntimeError(f"/metrics: {status}\n{tail(server.log)}")
    lines = [line for line in text.splitlines() if line[:1] not in ("#", "") and "{" not in line]
    values = dict(line.split(" ") for line in lines)
    return {name: int(float(values[gauge])) for name, gauge in GAUGES.items()}


def watch(address: str, stop: threading.Event, seed: int) -> None:
    """Watch one run after another."""
    draw = random.Random(seed)
    while not stop.wait(draw.uniform(0.1, 1.0)):
        try:
            socket = connect(
                f"ws://{address}/v1/watch",
                subprotocols=[JSON],
                max_size=None,
                open_timeout=10.0,
                close_timeout=2.0,
            )
            leave = time.monotonic() + draw.uniform(1.0, VIEW_S)
            what = draw.choice(["featured", "leaderboard"])
            socket.send(json.dumps({"op": "subscribe", "id": 1, what: True}))
            while time.monotonic() < leave and not stop.is_set():
                try:
                    socket.recv(0.5)
                except TimeoutError:
                    continue
            if draw.random() < 0.5:
                socket.socket.close()
            else:
                socket.close()
        except (ConnectionClosed, OSError, TimeoutError):
            continue


def play(server: Server, folder: Path, teams: int) -> list[Process]:
    """Start the teams."""
    tokens: dict[str, dict[str, str]] = {mode: {} for mode in MODES}
    for number in range(teams):
        mode = MODES[number % 2]
        name = f"{mode}-{number // 2}"
        tokens[mode][name] = json.loads(server.admin("team", "add", name))["token"]
    server.admin("open", "--reason", "soak")
    players = []
    for mode, names in tokens.items():
        file = folder / f"{mode}.json"
        file.write_text(json.dumps(names))
        words = [
            sys.executable,
            "-m",
            "fleet.clients",
            "--url",
            f"http://{server.address}",
            "--tokens",
            str(file),
        ]
        words += ["--record", str(folder / "record.jsonl"), "--stop", str(folder / "stop")]
        harness = Path(__file__).parents[1]
        path = f"PYTHONPATH={harness.parent / 'client-py/src'}:{harness}"
        players.append(start(["env", path, *words, "--mode", mode], folder / "clients.log"))
    return players


def soak(folder: Path, program: Path, minutes: float, teams: int) -> tuple[dict[str, Any], bool]:
    """Let teams play and viewers come and go; return the report, and whether it holds."""
    server = Server(program, folder, RULES)
    players: list[Process] = []
    stop = threading.Event()
    viewers = [
        threading.Thread(target=watch, args=(server.address, stop, seed), daemon=True)
        for seed in range(VIEWERS)
    ]
    try:
        before = gauges(server)
        began = time.monotonic()
        players = play(server, folder, teams)
        for viewer in viewers:
            viewer.start()
        memory: list[tuple[float, int]] = []
        most: dict[str, int] = {}
        printed = 0.0
        while time.monotonic() - began < minutes * 60.0:
            time.sleep(READ_S)
            now, at = gauges(server), time.monotonic() - began
            memory.append((at, now["memory"]))
            most = {name: max(value, most.get(name, 0)) for name, value in now.items()}
            if at - printed >= 60.0:
                printed = at
                print(f"{at / 60.0:5.1f} min  {now}", flush=True)
        (folder / "stop").touch()
        stop.set()
        for process in players:
            process.wait(SESSION_S + 60.0)
        for viewer in viewers:
            viewer.join(30.0)

        def is_empty() -> bool:
            now = gauges(server)
            return all(now[name] <= before[name] + more for name, more in LEFT.items())

        try:
            until(is_empty, EMPTY_S, "everything has ended", 1.0)
        except TimeoutError as late:
            print(late)
        after = gauges(server)
        events = (folder / "record.jsonl").read_text().splitlines()
        results = sum('"event": "result"' in event for event in events)
    finally:
        stop.set()
        for process in players:
            end(process)
        server.close()

    def mean(begin_s: float, end_s: float) -> float:
        values = [value for at, value in memory if begin_s <= at < end_s] or [memory[-1][1]]
        return sum(values) / len(values)

    # A minute's mean, since runs come and go.
    total = minutes * 60.0
    settled = min(SETTLED_S, total / 2.0)
    first, last = mean(settled, settled + 60.0), mean(total - 60.0, total + READ_S)
    report = {
        "minutes": minutes,
        "teams": teams,
        "results": results,
        "memory_settled_mb": round(first / 1e6, 2),
        "memory_end_mb": round(last / 1e6, 2),
        "growth": round(last / first - 1.0, 4),
        "most": most,
        "before": before,
        "after": after,
    }
    holds = last / first - 1.0 <= GROWTH and results > 0
    return report, holds and all(after[name] <= before[name] + more for name, more in LEFT.items())
