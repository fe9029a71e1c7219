"""What lockstep costs beside the physics: the overhead of one call of `Client.step` for every tick.

Two runs of the same scene get the same actions, one tick by tick, the other 20 ticks per call. They compute
the same physics, bit for bit, so the difference in time is what 19 more calls in 20 cost: encoding, system
calls, the server's reading, observing and writing, decoding, and caches that are colder. Blocks of 200 ticks
of the two runs take turns, so that whatever else the machine does meets both. Start a server first, on an
idle machine.
"""

from __future__ import annotations

import argparse
import itertools
import statistics
import sys
import time
from dataclasses import dataclass
from typing import Literal

import palmares
from palmares.requests import Step
from palmares.targets import action_of

# Ticks with one target, and of one call of the run that is played whole.
MOVE = 20
# Ticks that one run plays before the other has its turn: few enough for the machine to be the same, enough
# for the first call, for which the server has to be woken, not to count.
BLOCK = 200
PALM_DOWN = (0.0, 1.0, 0.0, 0.0)
ABOVE, AMONG_BALLS = (0.0, 0.0, 0.75), (0.0, 0.0, 0.24)
# The hand comes down and closes before the clock is started, s.
LEAD_IN_TICKS = 300


@dataclass(frozen=True)
class Case:
    """A scene and what the hand does in it."""

    name: str
    base: tuple[float, float, float]
    sensing: Literal["sensors", "truth"]
    encoding: Literal["json", "msgpack"]


@dataclass(frozen=True)
class Measured:
    """Medians over blocks, µs per tick."""

    physics: float
    overhead: float

    @property
    def share(self) -> float:
        """The overhead as a part of the physics."""
        return self.overhead / self.physics


def open_run(client: palmares.Client, case: Case) -> None:
    """Bring the hand where the case wants it."""
    client.reset("balls", "softhand", seed=1, sensing=case.sensing)
    base = palmares.pose(case.base, PALM_DOWN)
    for tick in range(0, LEAD_IN_TICKS, MOVE):
        client.step(base=base, hand=[0.0 if tick < LEAD_IN_TICKS // 2 else 0.6], repeat=MOVE)


def target(tick: int) -> list[float]:
    """Where the hand is to be: it moves all the time."""
    return [0.5 + 0.2 * (tick // MOVE % 2)]


def measure(url: str, case: Case, blocks: int) -> Measured:
    """Play the same blocks tick by tick and whole."""
    with (
        palmares.Client(url, encoding=case.encoding) as single,
        palmares.Client(url, encoding=case.encoding) as whole,
    ):
        open_run(single, case)
        open_run(whole, case)
        physics, overhead = [], []
        for _ in range(blocks):
            start = time.perf_counter()
            for tick in range(BLOCK):
                single.step(hand=target(tick))
            between = time.perf_counter()
            for tick in range(0, BLOCK, MOVE):
                whole.step(hand=target(tick), repeat=MOVE)
            end = time.perf_counter()
            call = ((between - start) - (end - between)) / (BLOCK - BLOCK // MOVE)
            overhead.append(call)
            physics.append((end - between) / BLOCK - call / MOVE)
        if single.stop().state_hash != whole.stop().state_hash:
            sys.exit("the two runs differ: the measurement compares different physics")
    return Measured(1e6 * statistics.median(physics), 1e6 * statistics.median(overhead))


def parts(url: str, case: Case, ticks: int) -> dict[str, float]:
    """Where the time of a call goes on this side of the socket, medians in µs."""
    with palmares.Client(url, encoding=case.encoding) as client:
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
        action = action_of(palmares.pose(case.base, PALM_DOWN), target(count))
        request = codec.encode(Step(id=1_000_000 + count, tick=tick, action=action))
        marks.append(time.perf_counter())
        transport.send(request, binary=codec.binary)
        marks.append(time.perf_counter())
        raw = transport.recv()
        marks.append(time.perf_counter())
        obs = codec.decode(raw, None)
        marks.append(time.perf_counter())
        if not isinstance(obs, palmares.Observation):
            sys.exit(f"expected an observation, not {obs}")
        tick, size = obs.tick, len(raw)
        for name, (begun, done) in zip(times, itertools.pairwise(marks), strict=True):
            times[name].append(done - begun)
    return times, size


def asking(url: str, encoding: Literal["json", "msgpack"]) -> float:
    """Return the median time of a `time` request, which needs no physics: the floor, µs."""
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
    encodings: list[Literal["json", "msgpack"]] = ["json", "msgpack"]
    print("| scene | sensing | encoding | physics, µs/tick | overhead, µs/call | overhead/physics |")
    print("|---|---|---|---|---|---|")
    cases = [
        Case(name, base, sensing, encoding)
        for name, base in (("free", ABOVE), ("balls", AMONG_BALLS))
        for sensing in ("truth", "sensors")
        for encoding in encodings
    ]
    for case in cases:
        got = measure(args.url, case, args.blocks)
        print(
            f"| {case.name} | {case.sensing} | {case.encoding} | {got.physics:.0f} | {got.overhead:.1f} "
            f"| {got.share:.0%} |",
            flush=True,
        )
    print("\n| scene | sensing | encoding | encode | send | wait | decode | bytes of the reply |")
    print("|---|---|---|---|---|---|---|---|")
    for case in cases:
        part = parts(args.url, case, BLOCK * args.blocks)
        row = " | ".join(f"{part[name]:.1f}" for name in ("encode", "send", "wait", "decode"))
        print(f"| {case.name} | {case.sensing} | {case.encoding} | {row} | {part['bytes']} |", flush=True)
    print("\nA `time` request, which needs no physics, takes:")
    for encoding in encodings:
        print(f"{asking(args.url, encoding):.1f} µs ({encoding})")


if __name__ == "__main__":
    try:
        main()
    except palmares.PalmaresError as error:
        sys.exit(str(error))
