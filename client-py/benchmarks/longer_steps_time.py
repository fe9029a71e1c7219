"""Measure how much CPU time longer steps of the physics save: the same ticks, by the time of the process.

OPENBLAS_NUM_THREADS=1 python longer_steps_time.py --worlds 8 --ticks 300

Each step is played in turns; the least of its times counts.
"""

from __future__ import annotations

import argparse
import time
import warnings

import numpy as np

from palmares import Training
from palmares.arrays import Array
from palmares.sim import Batch

STEPS_MS = (None, 2.0, 4.0, 5.0, 10.0)
"""Steps; the first is the task's own"""
HOLD_TICKS = 10
"""Ticks of an action"""


def action(motion: str, k: int, worlds: int, rng: np.random.Generator) -> Array:
    """Return the k-th action of a motion, (worlds, 7)."""
    made = np.zeros((worlds, 7))
    if motion == "random":
        made[:, :3] = rng.uniform(-0.3, 0.3, (worlds, 3)) - [0.0, 0.0, 0.15]
        made[:, 6] = rng.uniform(0.0, 1.0, worlds)
    else:  # Down into the objects, then closing.
        made[:, 2] = -0.25 if k < 18 else 0.0
        made[:, 6] = min(1.0, max(0.0, (k - 14) / 8))
    return made


def spent_s(task: str, motion: str, step_ms: float | None, worlds: int, ticks: int) -> float:
    """Return the CPU time of a motion of all worlds on one thread, s."""
    batch = Batch(task, "softhand", worlds, threads=1, training=Training(step_ms=step_ms))
    batch.clipping.mute()
    batch.reset(range(1, worlds + 1))
    rng, begun = np.random.default_rng(0), time.process_time()
    for k in range(ticks // HOLD_TICKS):
        batch.step(action(motion, k, worlds, rng), HOLD_TICKS)
    return time.process_time() - begun


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--worlds", type=int, default=8)
    parser.add_argument("--ticks", type=int, default=300)
    parser.add_argument("--turns", type=int, default=6)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    print("motion, task: times as fast at " + ", ".join(f"{step:g} ms" for step in STEPS_MS[1:] if step))
    for motion in ("random", "dig"):
        for task in ("balls", "grasp"):
            turns = [
                [spent_s(task, motion, step, options.worlds, options.ticks) for step in STEPS_MS]
                for _ in range(options.turns)
            ]
            own, *longer = (min(times) for times in zip(*turns, strict=True))
            print(f"{motion}, {task}: " + ", ".join(f"{own / time_s:.2f}" for time_s in longer), flush=True)


if __name__ == "__main__":
    main()
