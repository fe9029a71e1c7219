"""What a wrist camera at 30 Hz costs beside lockstep.

Two runs of the same scene and actions take turns in blocks of 200 calls of one tick: one reads the wrist's
depth picture as often as the camera takes one, the other reads none. For both: the server's own time for a
tick (`palmares_tick_compute_seconds` at ``/metrics``: physics, referee, recorder), and what a call of
`Client.step` takes on average, with drawing, sending and decoding of the pictures. Medians over the blocks,
quartiles in brackets. Start a server first, on an idle machine.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from dataclasses import dataclass, field
from typing import Literal

from round_trip import BLOCK, LEAD_IN_TICKS, MOVE, PALM_DOWN, SCENES, target, ticks_and_seconds

import palmares

HAND, CAMERA, RATE_HZ, TICK_S = "softhand", "wrist", 30.0, 0.01


@dataclass
class Played:
    """A run and the times of its blocks, µs per tick."""

    client: palmares.Client
    cameras: list[str]
    tick_us: list[float] = field(default_factory=list)
    call_us: list[float] = field(default_factory=list)
    pictures: int = 0

    def block(self, url: str) -> None:
        """Play a block."""
        before = ticks_and_seconds(url)
        begun_s = time.perf_counter()
        due = 0.0
        for tick in range(BLOCK):
            wanted = self.cameras if tick >= due else []
            due += 1.0 / (RATE_HZ * TICK_S) if tick >= due else 0.0
            obs = self.client.step(hand=target(tick), cameras=wanted)
            self.pictures += len(obs.cameras)
        wall_s = time.perf_counter() - begun_s
        after = ticks_and_seconds(url)
        if after[0] - before[0] != BLOCK:
            sys.exit("another client plays on this server, whose time for the ticks counts both")
        self.call_us.append(1e6 * wall_s / BLOCK)
        self.tick_us.append(1e6 * (after[1] - before[1]) / BLOCK)


def quartiles(values: list[float], form: str) -> str:
    """Return the median and, in brackets, the quartiles."""
    low, median, high = statistics.quantiles(values, n=4)
    return f"{median:{form}} ({low:{form}} to {high:{form}})"


def measure(url: str, scene: str, noise: Literal["none", "real"], blocks: int) -> None:
    """Play a run with pictures and one without by turns; print their row."""
    with palmares.Client(url) as seeing, palmares.Client(url) as blind:
        runs = [Played(seeing, [CAMERA]), Played(blind, [])]
        for run in runs:
            run.client.reset("balls", HAND, seed=1, noise=noise)
            base = palmares.pose(SCENES[scene], PALM_DOWN)
            for tick in range(0, LEAD_IN_TICKS, MOVE):
                run.client.step(base=base, hand=[0.0 if tick < LEAD_IN_TICKS // 2 else 0.6], repeat=MOVE)
        for count in range(blocks):
            for run in runs if count % 2 else runs[::-1]:
                run.block(url)
        if len({run.client.stop().state_hash for run in runs}) != 1:
            sys.exit("the runs differ: looking has changed the physics")
    with_pictures, without = runs
    ticks = [a / b - 1.0 for a, b in zip(with_pictures.tick_us, without.tick_us, strict=True)]
    calls = [a / b - 1.0 for a, b in zip(with_pictures.call_us, without.call_us, strict=True)]
    columns = [
        statistics.median(times) for run in (without, with_pictures) for times in (run.tick_us, run.call_us)
    ]
    row = " | ".join(f"{column:.0f}" for column in columns)
    rate = with_pictures.pictures / (blocks * BLOCK * TICK_S)
    added = f"{quartiles(ticks, '+.0%')} | {quartiles(calls, '+.0%')}"
    print(f"| {scene} | {noise} | {rate:.1f} | {row} | {added} |", flush=True)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--url", default="http://127.0.0.1:8080")
    parser.add_argument("--blocks", type=int, default=15, help=f"blocks of {BLOCK} ticks per run")
    args = parser.parse_args()
    print("In µs: a tick and a call without pictures, the same with them, what they add\n")
    print("| scene | noise | pictures/s | tick | call | tick, seeing | call, seeing | tick + | call + |")
    print("|---|---|---|---|---|---|---|---|---|")
    for scene in SCENES:
        for noise in ("none", "real"):
            measure(args.url, scene, noise, args.blocks)


if __name__ == "__main__":
    try:
        main()
    except palmares.PalmaresError as error:
        sys.exit(str(error))
