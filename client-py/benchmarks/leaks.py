"""Growth of memory over many resets, in one process.

    python client-py/benchmarks/leaks.py --resets 100000

Each reset opens a run and steps it, alternately as a `World` (with a snapshot, a restored and a forked world,
and a result), through a `Client`, in a `Batch`, and as an environment of gymnasium. The resident memory (RSS)
is read after every tenth of the resets. The first tenth does not count: caches and pools grow in it.
"""

from __future__ import annotations

import argparse
import gc
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import palmares
from palmares import sim

PAGE = os.sysconf("SC_PAGE_SIZE")
PARTS = 10


def resident() -> int:
    """Return the resident memory of this process, bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE


def world(seed: int) -> sim.World:
    """Open a `World`, use it and return it."""
    made = sim.World("grasp", "pinch", seed, noise="real")
    made.step(hand=[0.5, 0.5], repeat=2)
    kept = made.snapshot()
    fork = made.fork()
    fork.step()
    fork.restore(bytes(kept))
    made.restore(kept)
    made.result()
    return made


def client(seed: int) -> None:
    """Open a run through a `Client` without a server."""
    with palmares.Client("local") as made:
        made.reset("grasp", "pinch", seed=seed, cameras=["table"] if seed % 100 == 0 else [])
        made.step(hand=[0.5, 0.5])
        made.stop()


def batch() -> Callable[[int], object]:
    """Return a function that resets a world of one `Batch`."""
    made = sim.Batch("grasp", "pinch", 4, threads=1)
    made.reset(range(4))
    actions = np.zeros((4, 8))

    def reset(seed: int) -> None:
        mask = np.arange(4) == seed % 4
        made.reset([seed] * 4, mask)
        made.step(actions, 1, mask)
        made.restore(seed % 4, bytes(made.snapshot(seed % 4)))

    return reset


def environment() -> Callable[[int], object]:
    """Return a function that resets one environment of gymnasium."""
    import gymnasium

    import palmares.gym

    env: Any = gymnasium.make("palmares/Grasp-Pinch-v1", ticks=1)
    assert isinstance(env.unwrapped, palmares.gym.FlatEnv)

    def reset(seed: int) -> None:
        env.reset(seed=seed)
        env.step(env.action_space.sample())

    return reset


def measured(resets: int, hold: bool) -> list[int]:
    """Do the resets; return the resident memory after each tenth of them, bytes."""
    ways: list[Callable[[int], object]] = [world, client, batch(), environment()]
    found, held = [], []
    begun, done = time.perf_counter(), 0
    for part in range(PARTS):
        for _ in range(resets // PARTS):
            left = ways[done % len(ways)](done)
            if hold:
                held.append(left)
            done += 1
        gc.collect()
        found.append(resident())
        rate = done / (time.perf_counter() - begun)
        print(f"{done:7} resets: {found[part] / 2**20:8.2f} MiB   {rate:6.0f} resets/s", flush=True)
    return found


def main() -> int:
    """Measure and print the growth."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--resets", type=int, default=100_000, help="number of resets (default 100000)")
    parser.add_argument("--hold", action="store_true", help="keep every `World`, as a leak would")
    options = parser.parse_args()
    found = measured(options.resets, options.hold)
    grown = found[-1] - found[0]
    each = grown / (options.resets * (PARTS - 1) / PARTS)
    print(f"after the first part it has grown by {grown / 2**20:.2f} MiB: {each:.1f} bytes a reset")
    return 0


if __name__ == "__main__":
    sys.exit(main())
