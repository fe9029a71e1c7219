"""Overhead of lockstep in whole runs of the example controllers.

    palmares serve                                # in another terminal, on an idle machine
    python whole_runs.py

The overhead is the time of all calls of `Client.step` minus the server's own time for the same ticks
(`palmares_tick_compute_seconds` at ``/metrics``). Unlike in `round_trip.py` the controller computes between
its calls, the hand touches and carries objects, and every call is one tick.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from pathlib import Path
from typing import Any

from round_trip import ticks_and_seconds

import palmares

CONTROLLERS = {"balls": "balls_softhand", "shelf": "shelf_softhand"}


class Timed(palmares.Client):
    """A client that measures the time of its steps."""

    seconds = 0.0
    calls = 0

    def step(self, *args: Any, **kwargs: Any) -> palmares.Observation:
        """Step and add up the time."""
        begun = time.perf_counter()
        obs = super().step(*args, **kwargs)
        self.seconds += time.perf_counter() - begun
        self.calls += 1
        return obs


def play(url: str, task: str, seed: int) -> str:
    """Play a run; return a row of the table."""
    controller = importlib.import_module(CONTROLLERS[task])
    before = ticks_and_seconds(url)
    with Timed(url) as client:
        summary = controller.run(client, seed)
        calls, wall = client.calls, client.seconds
    after = ticks_and_seconds(url)
    ticks, physics = after[0] - before[0], after[1] - before[1]
    if ticks != calls:
        sys.exit(f"{calls} calls and {ticks} ticks: another client plays on this server")
    over = wall - physics
    return (
        f"| {task} | {seed} | {summary.score:g} | {ticks} | {1e6 * physics / ticks:.0f} "
        f"| {1e6 * wall / ticks:.0f} | {1e6 * over / ticks:.0f} | {over / physics:.0%} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--url", default="http://127.0.0.1:8080")
    parser.add_argument("--only", choices=[*CONTROLLERS], action="append", help="tasks (default: all)")
    parser.add_argument("--seed", type=int, default=1, help="scene of the first run; later runs count up")
    parser.add_argument("--runs", type=int, default=3, help="runs of every task")
    args = parser.parse_args()
    sys.path.append(str(Path(__file__).parent.parent / "src/palmares/examples"))
    print("Physics, a call and its overhead in µs per tick\n")
    print("| task | seed | score | ticks | physics | call | overhead | overhead/physics |")
    print("|---|---|---|---|---|---|---|---|")
    for task in args.only or CONTROLLERS:
        for seed in range(args.seed, args.seed + args.runs):
            print(play(args.url, task, seed), flush=True)


if __name__ == "__main__":
    try:
        main()
    except palmares.PalmaresError as error:
        sys.exit(str(error))
