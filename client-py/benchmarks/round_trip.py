"""Overhead of lockstep: time of a call of `Client.step` without the physics of its tick.

    palmares serve                                # in another terminal, on an idle machine
    python round_trip.py

In every scene each kind of client plays one run tick by tick, and one client plays a run in calls of 20
ticks. All send the same actions and so compute the same physics, bit for bit. The physics of a block of 200
ticks is the server's own time for them, recording included (`palmares_tick_compute_seconds` at ``/metrics``).
The rest of the calls' time is the overhead: encoding, system calls, reading, observing and writing in the
server, decoding. Blocks of all runs alternate, so that other load on the machine affects all of them equally.
The tables have the medians over the blocks and, in brackets, their quartiles.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import statistics
import sys
import time
import urllib.request
from dataclasses import dataclass, field
from typing import Literal

import palmares
from palmares.net.codec import Encoding
from palmares.targets import action_of
from palmares.wire import StepRequest

TASK, HAND = "balls", "softhand"
# Ticks with one target, and ticks of one call in the run with long calls.
MOVE = 20
# Ticks of a block: few, so that the load of the machine is the same for all runs, but enough to make the
# first call, which wakes the server's thread, negligible.
BLOCK = 200
PALM_DOWN = (0.0, 1.0, 0.0, 0.0)
# Position of the hand's base, m.
SCENES = {"air": (0.0, 0.0, 0.75), "balls": (0.0, 0.0, 0.24)}
# The hand comes down and closes before the measurement begins.
LEAD_IN_TICKS = 300


@dataclass(frozen=True)
class Case:
    """A scene, its sensing and the encoding of its messages."""

    scene: str
    sensing: Literal["sensors", "truth"]
    encoding: Encoding

    @property
    def base(self) -> tuple[float, float, float]:
        """Position of the hand's base, m."""
        return SCENES[self.scene]


@dataclass
class Played:
    """A run and the times of its blocks, µs per tick."""

    client: palmares.Client
    repeat: int
    physics_us: list[float] = field(default_factory=list)
    wall_us: list[float] = field(default_factory=list)

    def block(self, url: str) -> None:
        """Play a block."""
        before = ticks_and_seconds(url)
        begin_s = time.perf_counter()
        for tick in range(0, BLOCK, self.repeat):
            self.client.step(hand=target(tick), repeat=self.repeat)
        wall_s = time.perf_counter() - begin_s
        after = ticks_and_seconds(url)
        if after[0] - before[0] != BLOCK:
            sys.exit("another client plays on this server, whose time for the physics counts both")
        self.wall_us.append(1e6 * wall_s / BLOCK)
        self.physics_us.append(1e6 * (after[1] - before[1]) / BLOCK)


def ticks_and_seconds(url: str) -> tuple[int, float]:
    """Return the number of ticks that the server has stepped, and their time, s."""
    with urllib.request.urlopen(f"{url}/metrics") as answer:
        lines = answer.read().decode().splitlines()
    values = dict(line.rsplit(" ", 1) for line in lines if line.startswith("palmares_tick_compute_seconds_"))
    name = "palmares_tick_compute_seconds"
    return int(values.get(f"{name}_count", 0)), float(values.get(f"{name}_sum", 0.0))


def open_run(client: palmares.Client, case: Case) -> None:
    """Open a run and move the hand to its place."""
    client.reset(TASK, HAND, seed=1, sensing=case.sensing)
    base = palmares.pose(case.base, PALM_DOWN)
    for tick in range(0, LEAD_IN_TICKS, MOVE):
        client.step(base=base, hand=[0.0 if tick < LEAD_IN_TICKS // 2 else 0.6], repeat=MOVE)


def target(tick: int) -> list[float]:
    """Return σ of the motor at a tick; it always moves."""
    return [0.5 + 0.2 * (tick // MOVE % 2)]


def measure(url: str, cases: list[Case], blocks: int) -> None:
    """Play all cases alternately and print the table of their overhead."""
    with contextlib.ExitStack() as stack:

        def played(case: Case, repeat: int) -> Played:
            client = stack.enter_context(palmares.Client(url, encoding=case.encoding))
            open_run(client, case)
            return Played(client, repeat)

        whole = {name: played(Case(name, "sensors", "msgpack"), MOVE) for name in SCENES}
        single = {case: played(case, 1) for case in cases}
        runs = [*whole.values(), *single.values()]
        for count in range(blocks):
            first = count % len(runs)
            for run in runs[first:] + runs[:first]:
                run.block(url)
        for scene in SCENES:
            of_scene = [run for case, run in single.items() if case.scene == scene]
            if len({run.client.stop().state_hash for run in [whole[scene], *of_scene]}) != 1:
                sys.exit("the runs differ: the measurement compares different physics")
    for case, run in single.items():
        overhead = [wall - physics for wall, physics in zip(run.wall_us, run.physics_us, strict=True)]
        shares = [more / physics for more, physics in zip(overhead, run.physics_us, strict=True)]
        low, _, high = statistics.quantiles(overhead, n=4)
        long = statistics.median(whole[case.scene].physics_us)
        physics, wall, over, share = map(statistics.median, (run.physics_us, run.wall_us, overhead, shares))
        print(
            f"| {case.scene} | {case.sensing} | {case.encoding} | {long:.0f} | {physics:.0f} | {wall:.0f} "
            f"| {over:.0f} ({low:.0f} to {high:.0f}) | {share:.0%} |"
        )


def parts(url: str, case: Case, ticks: int) -> dict[str, float]:
    """Return the medians, µs, of the parts of a call in the client, and the size of a reply."""
    with palmares.Client(url, encoding=case.encoding) as client:
        open_run(client, case)
        with client._link._lock:  # Keeps the heartbeat from reading replies to this loop.
            times, size = timed(client, case, ticks)
        client.stop()
    return {name: 1e6 * statistics.median(values) for name, values in times.items()} | {"bytes": size}


def timed(client: palmares.Client, case: Case, ticks: int) -> tuple[dict[str, list[float]], int]:
    """Do the parts of `Client.step` one by one; return the time of each, s, and the size of a reply."""
    times: dict[str, list[float]] = {name: [] for name in ("encode", "send", "wait", "decode")}
    transport, codec = client._link._transport, client._link._codec
    tick, size, motors = client.tick or 0, 0, len(client.welcome.hand(HAND).motors)
    for count in range(ticks):
        marks = [time.perf_counter()]
        action = action_of(palmares.pose(case.base, PALM_DOWN), target(count), motors)
        request = codec.encode(StepRequest(id=1_000_000 + count, tick=tick, action=action))
        marks.append(time.perf_counter())
        transport.send(request, binary=codec.binary)
        marks.append(time.perf_counter())
        raw = transport.recv()
        marks.append(time.perf_counter())
        obs = codec.message(raw)
        marks.append(time.perf_counter())
        if not isinstance(obs, palmares.Observation):
            sys.exit(f"expected an observation, not {obs}")
        tick, size = obs.tick, len(raw)
        for name, (begun, done) in zip(times, itertools.pairwise(marks), strict=True):
            times[name].append(done - begun)
    return times, size


def asking(url: str, encoding: Encoding) -> float:
    """Return the median time, µs, of a `time` request, which needs no physics: the smallest overhead."""
    with palmares.Client(url, encoding=encoding) as client:
        times = []
        for _ in range(2000):
            start = time.perf_counter()
            client.time()
            times.append(time.perf_counter() - start)
    return 1e6 * statistics.median(times)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--url", default="http://127.0.0.1:8080")
    parser.add_argument("--blocks", type=int, default=15, help=f"blocks of {BLOCK} ticks per case")
    args = parser.parse_args()
    encodings: list[Encoding] = ["msgpack", "json"]
    sensings: list[Literal["sensors", "truth"]] = ["sensors", "truth"]
    cases = [Case(*case) for case in itertools.product(SCENES, sensings, encodings)]
    print("In µs per tick: physics in long steps and in single ones, a call, its overhead (quartiles)\n")
    print("| scene | sensing | encoding | long | physics | call | overhead | overhead/physics |")
    print("|---|---|---|---|---|---|---|---|")
    measure(args.url, cases, args.blocks)
    print("\nParts of a call in the client, medians in µs:\n")
    print("| scene | sensing | encoding | encode | send | wait | decode | bytes of the reply |")
    print("|---|---|---|---|---|---|---|---|")
    for case in cases:
        part = parts(args.url, case, BLOCK * args.blocks // 3)
        row = " | ".join(f"{part[name]:.1f}" for name in ("encode", "send", "wait", "decode"))
        print(f"| {case.scene} | {case.sensing} | {case.encoding} | {row} | {part['bytes']} |", flush=True)
    print("\nA `time` request, which needs no physics, takes:")
    for encoding in encodings:
        print(f"{asking(args.url, encoding):.1f} µs ({encoding})")


if __name__ == "__main__":
    try:
        main()
    except palmares.PalmaresError as error:
        sys.exit(str(error))
