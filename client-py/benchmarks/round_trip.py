"""What lockstep costs beside the physics: the overhead of one call of `Client.step` for every tick.

In every scene one run is played by each kind of client, tick by tick, and one in calls of 20 ticks. All
get the same actions and compute the same physics, bit for bit. The physics of a block of 200 calls is
what the server itself measured of their ticks, recording included (`palmares_tick_compute_seconds` at
``/metrics``); what the calls took longer is the overhead: encoding, system calls, the server's reading,
observing and writing, decoding. Blocks of all runs take turns, so that whatever else the machine does
meets all of them. Of their values the median counts; the quartiles beside it tell how much it is worth.
Start a server first, on an idle machine.
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
from typing import Literal, TypeAlias

import palmares
from palmares.requests import Step
from palmares.targets import action_of

Encoding: TypeAlias = Literal["json", "msgpack"]

# Ticks with one target, and of one call of the run that is played in long steps.
MOVE = 20
# Ticks that one run plays before the next has its turn: few enough for the machine to be the same, enough
# for the first call, for which the server has to be woken, not to count.
BLOCK = 200
PALM_DOWN = (0.0, 1.0, 0.0, 0.0)
SCENES = {"air": (0.0, 0.0, 0.75), "balls": (0.0, 0.0, 0.24)}
# The hand comes down and closes before the clock is started.
LEAD_IN_TICKS = 300


@dataclass(frozen=True)
class Case:
    """A scene and how it is seen."""

    scene: str
    sensing: Literal["sensors", "truth"]
    encoding: Encoding

    @property
    def base(self) -> tuple[float, float, float]:
        """Where the hand's base is, m."""
        return SCENES[self.scene]


@dataclass
class Played:
    """A run and what its blocks took, µs per tick."""

    client: palmares.Client
    repeat: int
    physics: list[float] = field(default_factory=list)
    wall: list[float] = field(default_factory=list)

    def block(self, url: str) -> None:
        """Play a block."""
        before = ticks_and_seconds(url)
        start = time.perf_counter()
        for tick in range(0, BLOCK, self.repeat):
            self.client.step(hand=target(tick), repeat=self.repeat)
        wall = time.perf_counter() - start
        after = ticks_and_seconds(url)
        if after[0] - before[0] != BLOCK:
            sys.exit("somebody else plays on this server: its clock of the physics counts both")
        self.wall.append(1e6 * wall / BLOCK)
        self.physics.append(1e6 * (after[1] - before[1]) / BLOCK)


def ticks_and_seconds(url: str) -> tuple[int, float]:
    """Return how many ticks the server has stepped, and what they took."""
    with urllib.request.urlopen(f"{url}/metrics") as answer:
        lines = answer.read().decode().splitlines()
    values = dict(line.rsplit(" ", 1) for line in lines if line.startswith("palmares_tick_compute_seconds_"))
    name = "palmares_tick_compute_seconds"
    return int(values.get(f"{name}_count", 0)), float(values.get(f"{name}_sum", 0.0))


def open_run(client: palmares.Client, case: Case) -> None:
    """Bring the hand where the case wants it."""
    client.reset("balls", "softhand", seed=1, sensing=case.sensing)
    base = palmares.pose(case.base, PALM_DOWN)
    for tick in range(0, LEAD_IN_TICKS, MOVE):
        client.step(base=base, hand=[0.0 if tick < LEAD_IN_TICKS // 2 else 0.6], repeat=MOVE)


def target(tick: int) -> list[float]:
    """Where the hand is to be: it moves all the time."""
    return [0.5 + 0.2 * (tick // MOVE % 2)]


def measure(url: str, cases: list[Case], blocks: int, local: bool) -> None:
    """Play all cases by turns and print what their calls cost."""
    with contextlib.ExitStack() as stack:

        def played(case: Case, repeat: int) -> Played:
            client = stack.enter_context(palmares.Client(url, encoding=case.encoding, local=local))
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
        overhead = [wall - physics for wall, physics in zip(run.wall, run.physics, strict=True)]
        shares = [more / physics for more, physics in zip(overhead, run.physics, strict=True)]
        low, _, high = statistics.quantiles(overhead, n=4)
        long = statistics.median(whole[case.scene].physics)
        physics, wall, over, share = map(statistics.median, (run.physics, run.wall, overhead, shares))
        print(
            f"| {case.scene} | {case.sensing} | {case.encoding} | {long:.0f} | {physics:.0f} | {wall:.0f} "
            f"| {over:.0f} ({low:.0f} to {high:.0f}) | {share:.0%} |"
        )


def parts(url: str, case: Case, ticks: int, local: bool) -> dict[str, float]:
    """Where the time of a call goes on this side of the socket, medians in µs."""
    with palmares.Client(url, encoding=case.encoding, local=local) as client:
        open_run(client, case)
        with client._link._lock:  # The heartbeat is not to read what is meant for this loop.
            times, size = timed(client, case, ticks)
        client.stop()
    return {name: 1e6 * statistics.median(values) for name, values in times.items()} | {"bytes": size}


def timed(client: palmares.Client, case: Case, ticks: int) -> tuple[dict[str, list[float]], int]:
    """Do by hand what `Client.step` does and look at the clock between; the size of a reply, too."""
    times: dict[str, list[float]] = {name: [] for name in ("encode", "send", "wait", "decode")}
    transport, codec = client._link._transport, client._link._codec
    tick, size = client.tick or 0, 0
    for count in range(ticks):
        marks = [time.perf_counter()]
        action = action_of(palmares.pose(case.base, PALM_DOWN), target(count), 1)
        request = codec.encode(Step(id=1_000_000 + count, tick=tick, action=action))
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


def asking(url: str, encoding: Encoding, local: bool) -> float:
    """Return the median time of a `time` request, which needs no physics: the floor, µs."""
    with palmares.Client(url, encoding=encoding, local=local) as client:
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
    parser.add_argument("--tcp", action="store_true", help="do not use the server's local socket")
    args = parser.parse_args()
    local = not args.tcp
    encodings: list[Encoding] = ["msgpack", "json"]
    sensings: list[Literal["sensors", "truth"]] = ["sensors", "truth"]
    cases = [Case(*case) for case in itertools.product(SCENES, sensings, encodings)]
    print("In µs per tick: physics in long steps and in single ones, a call, its overhead (quartiles)\n")
    print("| scene | sensing | encoding | long | physics | call | overhead | overhead/physics |")
    print("|---|---|---|---|---|---|---|---|")
    measure(args.url, cases, args.blocks, local)
    print("\nWhere the time of a call goes on this side of the socket, medians:\n")
    print("| scene | sensing | encoding | encode | send | wait | decode | bytes of the reply |")
    print("|---|---|---|---|---|---|---|---|")
    for case in cases:
        part = parts(args.url, case, BLOCK * args.blocks // 3, local)
        row = " | ".join(f"{part[name]:.1f}" for name in ("encode", "send", "wait", "decode"))
        print(f"| {case.scene} | {case.sensing} | {case.encoding} | {row} | {part['bytes']} |", flush=True)
    print("\nA `time` request, which needs no physics, takes:")
    for encoding in encodings:
        print(f"{asking(args.url, encoding, local):.1f} µs ({encoding})")


if __name__ == "__main__":
    try:
        main()
    except palmares.PalmaresError as error:
        sys.exit(str(error))
