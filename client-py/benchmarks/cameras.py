"""Cost of a wrist camera at 30 Hz in lockstep.

    palmares serve                                # in another terminal, on an idle machine
    python cameras.py

Two runs of the same scene and actions alternate in blocks of 200 calls of one tick: one reads every depth
image of the wrist, the other none. The table has the server's own time for a tick
(`palmares_tick_compute_seconds` at ``/metrics``: physics, referee, recorder), and the mean time of a call of
`Client.step`, with drawing, sending and decoding of the images. Medians over the blocks, quartiles in
brackets.
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
    """Alternate a run with images and one without; print their row."""
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
    print("In µs: a tick and a call without images, the same with images, the difference\n")
    print("| scene | noise | images/s | tick | call | tick with | call with | tick + | call + |")
    print("|---|---|---|---|---|---|---|---|---|")
    for scene in SCENES:
        for noise in ("none", "real"):
            measure(args.url, scene, noise, args.blocks)


if __name__ == "__main__":
    try:
        main()
    except palmares.PalmaresError as error:
        sys.exit(str(error))
