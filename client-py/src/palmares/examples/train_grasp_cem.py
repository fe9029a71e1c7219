"""Learn a grasp by the cross-entropy method, and test it on other objects.

    python train_grasp_cem.py --seed 1 --curve curve.json --policy grasp.json

A grasp has eight numbers: orientation of the hand, its position relative to the object, opening of the
fingers on the way and in the grasp. The search finds one grasp for all objects. The cross-entropy method
(Rubinstein 1999) draws grasps from a normal distribution, plays all of them in the same few scenes, and moves
the distribution to those with the best scores. Position and size of the object are the simulator's truth.
With ``--randomise`` each run has a hand of its own, drawn from the ranges of its ``hand.toml``. Training has
long steps of the integration, the test the task's own. It needs only NumPy, and no server.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from palmares import Training
from palmares.arrays import Array, array
from palmares.examples._grasp_runs import (
    HAND,
    LEARNED_WITH,
    STEP_MS,
    TASK,
    Hands,
    rot_zyz,
    rotated,
    test_scenes,
    training_scenes,
    yaw_across,
)
from palmares.examples._training import Learned, OnPoint, learn, main
from palmares.sim import Batch
from palmares.skills.motion import UP

NAMES = ("pitch", "roll", "above", "aside", "along", "yaw", "open", "closed")
"""Numbers of a grasp, rad, m and σ, as in `TopGrasp`; `yaw` is relative to the object"""
START = array([1.77, 0.09, 0.0, 0.025, 0.22, 0.0, 0.05, 0.9])
"""First mean of the search, a guess: between the grips of a ball and of a can in docs/cookbook.md"""
SPREAD = array([0.2, 0.2, 0.02, 0.02, 0.02, 0.15, 0.05, 0.1])
"""First standard deviations of the search"""
SINK_M, LIFT_M = 0.10, 0.16
"""Height above the grasp at which the hand stops, and height of the lift"""
CLOSE_S, GRIP_S, LIFT_S = 1.2, 0.6, 1.2
"""Durations of the closing, of the wait until the fingers hold, and of the lift; without load the hand closes
in 1.1 s, and a quick lift loses heavy objects"""
ELITE, RATE = 0.25, 0.8
"""Share of the drawn grasps to which the distribution moves, and step of this motion from 0 to 1"""


def play(batch: Batch, seeds: Sequence[int], grasps: Array) -> Array:
    """Play a run in every world with its grasp (N, 8); return the scores (N,)."""
    hands = Hands(batch)
    start = hands.reset(seeds)
    middle, quat = start["objects"][:, 0, :3], start["objects"][:, 0, 3:7]
    sizes = 2.0 * start["object_half_extents"][:, 0]
    pitch, roll, above, aside, along, yaw, sigma_open, sigma_closed = grasps.T
    # Objects stand upright: their pose is a turn about z.
    yaw = yaw + yaw_across(2.0 * np.arctan2(quat[:, 2], quat[:, 3]), sizes)
    rotation = rot_zyz(math.pi / 2 + yaw, pitch, roll)
    at = middle - rotated(rotation, np.stack([sizes[:, 2] / 2 + above, aside, along], axis=1))

    hands.to(2.0, at + SINK_M * UP, rotation, np.clip(sigma_open, 0.0, 1.0))
    hands.to(0.4, at)
    hands.to(CLOSE_S, sigma=np.clip(sigma_closed, 0.0, 1.0))
    hands.wait(GRIP_S)
    lifted = hands.to(LIFT_S, at + LIFT_M * UP)
    # An object that stays on the table gets no further points.
    hands.active &= lifted["objects"][:, 0, 2] - middle[:, 2] > 0.5 * LIFT_M
    for _ in range(12):
        hands.wait(0.5)
    return batch.scores


def train(
    seed: int,
    *,
    updates: int = 7,
    population: int = 16,
    tests: int = 100,
    test_every: int | None = None,
    randomise: bool = False,
    threads: int | None = None,
    on_point: OnPoint = lambda _: None,
    policy: Path | None = None,
) -> Learned:
    """Search. The same arguments give the same curve, for any number of threads.

    Args:
        seed: Seed of the drawn grasps and scenes.
        updates: Number of moves of the distribution.
        population: Grasps of an update; each is played with every object once.
        tests: Test scenes, in which the distribution's mean is played after every `test_every` updates.
        test_every: See `tests`; without it the mean is tested after the last update alone.
        randomise: Each run of the training has a drawn hand.
        threads: As for `palmares.sim.Batch`.
        on_point: Called with every point of the curve.
        policy: File for the distribution's mean, JSON.

    """
    rng = np.random.default_rng(seed)
    drawn, tested = training_scenes(rng), test_scenes(tests)
    objects = len(LEARNED_WITH)
    training = Training(randomise=["hand"] if randomise else (), step_ms=STEP_MS)
    batch = Batch(TASK, HAND, population * objects, threads=threads, training=training)
    test_batch = Batch(TASK, HAND, tests, threads=threads)
    mean, spread = START, SPREAD

    def improve() -> float:
        nonlocal mean, spread
        grasps = mean + spread * rng.standard_normal((population, len(mean)))
        runs = play(batch, next(drawn) * population, np.repeat(grasps, objects, axis=0))
        points = runs.reshape(population, objects).mean(axis=1)
        best = grasps[np.argsort(-points, kind="stable")[: max(2, round(ELITE * population))]]
        mean = (1 - RATE) * mean + RATE * best.mean(axis=0)
        spread = (1 - RATE) * spread + RATE * best.std(axis=0)
        return float(points.mean())

    def test() -> float:
        return float(play(test_batch, tested, np.tile(mean, (tests, 1))).mean())

    curve = learn(
        improve, test, updates=updates, episodes=batch.count, test_every=test_every, on_point=on_point
    )
    if policy:
        policy.write_text(json.dumps(dict(zip(NAMES, mean.tolist(), strict=True)), indent=1) + "\n")
    return Learned(seed, curve, test_batch.scores.tolist())


def options(parser: argparse.ArgumentParser) -> None:
    """Add the option of this example."""
    parser.add_argument("--randomise", action="store_true", help="each run has a drawn hand")


if __name__ == "__main__":
    main(train, __doc__, updates=7, options=options)
