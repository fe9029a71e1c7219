"""Learn by the cross-entropy method how to grasp, and test it on objects that were not learned with.

    python train_grasp_cem.py --seed 1 --curve curve.json --policy grasp.json

A grasp has eight numbers: how the hand is turned, where it is put relative to the object, how far the
fingers are open on the way and closed in the grasp. Each is linear in the object's width and height: 24
parameters in all. The cross-entropy method (Rubinstein 1999) draws sets of parameters from a normal
distribution, plays them all in the same few scenes, and moves the distribution to those that scored best.
Where the object is, and how large, is the simulator's truth. Needs numpy alone, and no server.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from palmares.arrays import Array, array
from palmares.examples._grasp_runs import (
    HAND,
    LEARNED_WITH,
    TASK,
    Hands,
    rot_zyz,
    rotated,
    test_scenes,
    training_scenes,
    yaw_across,
)
from palmares.examples._training import Learned, Point, Tell, main
from palmares.motion import UP
from palmares.sim import Batch

NAMES = ("pitch", "roll", "above", "aside", "along", "yaw", "open", "closed")
"""The numbers of a grasp, rad, m and σ: as in `palmares.motion.TopGrasp`, and a turn from the object's"""
START = array([1.6, 0.0, 0.03, 0.0, 0.16, 0.0, 0.0, 0.6])
"""What the search begins with: the palm level above the object, 3 cm over it, the fingers closed half way"""
SPREAD = array([0.15, 0.2, 0.01, 0.015, 0.025, 0.15, 0.05, 0.2])
"""Standard deviations with which it begins"""
SLOPE = 0.4
"""Those of what a feature of 1 changes, as a share of `SPREAD`"""
SINK_M, LIFT_M = 0.10, 0.16
"""How far above the grasp the hand halts, and how far it lifts"""


ELITE, RATE = 0.2, 0.9
"""Share of a generation to which the distribution moves, and how far it moves there"""


def features(sizes_m: Array) -> Array:
    """Return 1, width and height of objects (N, 3), both within ±1, (N, 3).

    The hyperbolic tangent has a taller object than any learned with grasped as the tallest of them.
    """
    width, height = sizes_m[:, :2].min(axis=1), sizes_m[:, 2]
    wide, tall = np.tanh((width - 0.07) / 0.02), np.tanh((height - 0.09) / 0.03)
    return np.stack([np.ones_like(wide), wide, tall], axis=1)


def play(batch: Batch, seeds: Sequence[int], parameters: Array) -> Array:
    """Play a run in every world with its parameters (N, 8, 3); return the scores (N,)."""
    hands = Hands(batch)
    seen = hands.reset(seeds)
    middle, quat = seen["objects"][:, 0, :3], seen["objects"][:, 0, 3:7]
    sizes = 2.0 * seen["object_half_extents"][:, 0]
    grasp = np.einsum("nij,nj->ni", parameters, features(sizes))
    pitch, roll, above, aside, along, yaw, sigma_open, sigma_closed = grasp.T
    # Objects stand upright: their pose is a turn about z.
    yaw = yaw + yaw_across(2.0 * np.arctan2(quat[:, 2], quat[:, 3]), sizes)
    rotation = rot_zyz(math.pi / 2 + yaw, pitch, roll)
    at = middle - rotated(rotation, np.stack([sizes[:, 2] / 2 + above, aside, along], axis=1))

    hands.to(2.0, at + SINK_M * UP, rotation, np.clip(sigma_open, 0.0, 1.0))
    hands.to(0.4, at)
    hands.to(0.6, sigma=np.clip(sigma_closed, 0.0, 1.0))
    hands.wait(0.2)
    lifted = hands.to(0.6, at + LIFT_M * UP)
    # What stays on the table gets no points any more.
    hands.active &= lifted["objects"][:, 0, 2] - middle[:, 2] > 0.5 * LIFT_M
    for _ in range(12):
        hands.wait(0.5)
    return batch.scores


def train(
    seed: int,
    *,
    updates: int = 6,
    population: int = 32,
    tests: int = 100,
    test_every: int = 3,
    threads: int | None = None,
    tell: Tell = lambda _: None,
    policy: Path | None = None,
) -> Learned:
    """Search. The same arguments give the same curve, for any number of threads.

    Args:
        seed: Of what is drawn: parameters and scenes.
        updates: How often the distribution is moved.
        population: Sets of parameters drawn for an update; each is played with every object once.
        tests: Test scenes, in which the distribution's mean is played after every `test_every` updates.
        test_every: See `tests`.
        threads: As for `palmares.sim.Batch`.
        tell: Called with every point of the curve.
        policy: File for the distribution's mean, JSON.

    """
    rng = np.random.default_rng(seed)
    drawn, tested = training_scenes(rng), test_scenes(tests)
    objects = len(LEARNED_WITH)
    batch = Batch(TASK, HAND, population * objects, threads=threads)
    test_batch = Batch(TASK, HAND, tests, threads=threads)
    mean, spread = np.outer(START, [1.0, 0.0, 0.0]), np.outer(SPREAD, [1.0, SLOPE, SLOPE])
    curve: list[Point] = []
    for update in range(updates + 1):
        explored = None
        if update > 0:
            sets = mean + spread * rng.standard_normal((population, *mean.shape))
            runs = play(batch, next(drawn) * population, np.repeat(sets, objects, axis=0))
            points = runs.reshape(population, objects).mean(axis=1)
            best = sets[np.argsort(-points, kind="stable")[: max(2, round(ELITE * population))]]
            mean = (1 - RATE) * mean + RATE * best.mean(axis=0)
            spread = (1 - RATE) * spread + RATE * best.std(axis=0)
            explored = float(points.mean())
        test = None
        if update % test_every == 0 or update == updates:
            test = float(play(test_batch, tested, np.broadcast_to(mean, (tests, *mean.shape))).mean())
        curve.append(Point(update, update * batch.count, explored, test))
        tell(curve[-1])
    if policy:
        numbers = dict(zip(NAMES, mean.round(5).tolist(), strict=True))
        policy.write_text(json.dumps(numbers, indent=1) + "\n")
    return Learned(seed, curve, test_batch.scores.tolist())


if __name__ == "__main__":
    main(train, __doc__, updates=6)
