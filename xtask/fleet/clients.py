"""The teams: half of them play in lockstep, half by the clock. Each line of their file is one event, in JSON.

Events: `begun` (a run), `result` (acknowledged by the server), `lost` (a run without a result), `rewound` (an
observation steps back), `gap` (a pause from `from_s` to `to_s`, on the monotonic clock), `error`, `over`.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import random
import threading
import time
from pathlib import Path
from typing import Any, Literal

import palmares
from palmares.errors import PalmaresError, RunLostError
from palmares.messages import Result
from palmares.wire import BaseTarget

# A shorter wait for an answer is no pause.
GAP_S = 0.3
# Pause between two steps in lockstep: a controller that computes.
THINK_S = 0.02
# Longest wait for one reply, and for a server.
TIMEOUT_S = 20.0
RECONNECT_S = 90.0


class Record:
    """The file, shared by all teams. An event is on the disk before the team goes on."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("a", buffering=1)
        self._lock = threading.Lock()

    def write(self, team: str, event: str, **fields: Any) -> None:
        """Append an event."""
        line = json.dumps({"event": event, "team": team, "at_s": time.monotonic(), **fields})
        with self._lock:
            self._file.write(line + "\n")


class Team:
    """One team: plays runs until `stop` exists, and reports every acknowledged result."""

    def __init__(self, url: str, name: str, token: str, mode: str, record: Record, stop: Path) -> None:
        self.url, self.name, self.token, self.mode = url, name, token, mode
        self.record, self.stop = record, stop
        self.random = random.Random(name)
        self.heard_s = 0.0
        self.tick = -1
        self.run_id = ""

    def play(self) -> None:
        """Play until the stop file is there."""
        client: palmares.Client | None = None
        while not self.stop.exists():
            try:
                if client is None:
                    client = palmares.Client(
                        self.url, token=self.token, timeout_s=TIMEOUT_S, reconnect_s=RECONNECT_S
                    )
                self._play_run(client)
            except RunLostError as lost:
                self._lost(lost.result)
            except PalmaresError as error:
                self.record.write(self.name, "error", code=error.code, message=str(error)[:300])
                if error.fatal or error.code in ("connection_lost", "no_server", "session_over"):
                    if client is not None:
                        # Otherwise its connection holds the session until Python collects the garbage.
                        with contextlib.suppress(PalmaresError):
                            client.close()
                    client = None
                elif error.code == "wrong_state" and client is not None:
                    # A run that was open before the connection broke.
                    self._finish(client)
                time.sleep(0.3)
        self.record.write(self.name, "over")

    def _finish(self, client: palmares.Client) -> None:
        """Close a run of which the client has lost track."""
        try:
            self._result(client.stop(), by_client=True)
        except RunLostError as lost:
            self._lost(lost.result)
        except PalmaresError as error:
            self.record.write(self.name, "error", code=error.code, message=str(error)[:300])

    def _play_run(self, client: palmares.Client) -> None:
        # From the end of the run before: a reset that waits is a pause, too.
        mode: Literal["lockstep", "realtime"] = "realtime" if self.mode == "realtime" else "lockstep"
        self.heard_s = time.monotonic()
        obs = client.reset("balls", "pinch", mode=mode, sensing="sensors")
        self.run_id, self.tick = obs.run_id, obs.tick
        self._heard(obs.tick)
        self.record.write(self.name, "begun", run_id=obs.run_id)
        ticks, motors = self.random.randrange(150, 500), len(obs.hand.actuators)
        if mode == "realtime":
            for newest in client.observations():
                obs = newest
                self._heard(newest.tick)
                if newest.done or newest.tick >= ticks or self.stop.exists():
                    break
                client.act(*self._target(newest.tick, motors))
        else:
            while obs.tick < ticks and not obs.done and not self.stop.exists():
                time.sleep(THINK_S)
                began = time.monotonic()
                self.heard_s = began
                obs = client.step(*self._target(obs.tick, motors))
                self._heard(obs.tick)
        self.heard_s = time.monotonic()
        result = client.stop()
        self._heard(None)
        self._result(result, by_client=obs.tick >= ticks or self.stop.exists())

    @staticmethod
    def _target(tick: int, motors: int) -> tuple[BaseTarget, list[float]]:
        wave = [0.1 * math.sin(tick * 0.06 + phase) for phase in (0.0, 2.0, 4.0)]
        return palmares.twist(wave, [0.0, 0.0, 0.0]), [0.5 + 0.5 * math.sin(tick / 40.0)] * motors

    def _heard(self, tick: int | None) -> None:
        now = time.monotonic()
        if now - self.heard_s > GAP_S:
            self.record.write(self.name, "gap", from_s=self.heard_s, to_s=now, run_id=self.run_id)
        if tick is not None:
            if tick < self.tick:
                self.record.write(self.name, "rewound", ticks=self.tick - tick, run_id=self.run_id)
            self.tick = tick
        self.heard_s = now

    def _result(self, result: Result, by_client: bool) -> None:
        """Report a result; `by_client` is false if the server has ended the run by itself."""
        self.record.write(
            self.name, "result", run_id=result.run_id, score=result.score, status=result.status,
            ticks=result.ticks, state_hash=result.state_hash, reason=result.reason, by_client=by_client,
        )  # fmt: skip

    def _lost(self, result: Result | None) -> None:
        self._heard(None)
        if result is not None:
            self._result(result, by_client=False)
        status = None if result is None else result.status
        self.record.write(self.name, "lost", run_id=self.run_id, status=status)


def main() -> None:
    """Let all teams play."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--url", required=True)
    parser.add_argument("--tokens", type=Path, required=True, help="JSON: name to token")
    parser.add_argument("--record", type=Path, required=True)
    parser.add_argument("--stop", type=Path, required=True, help="the teams stop when this file exists")
    parser.add_argument("--mode", choices=["lockstep", "realtime"], required=True)
    options = parser.parse_args()
    record = Record(options.record)
    tokens: dict[str, str] = json.loads(options.tokens.read_text())
    threads = []
    for name, token in tokens.items():
        team = Team(options.url, name, token, options.mode, record, options.stop)
        threads.append(threading.Thread(target=team.play, name=name, daemon=True))
        threads[-1].start()
        # Not all resets at once.
        time.sleep(0.1)
    for thread in threads:
        thread.join()


if __name__ == "__main__":
    main()
