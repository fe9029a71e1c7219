"""Shared by the learners of the grasp task: objects, scenes, and motions of many hands at once."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from palmares.arrays import Array, array
from palmares.sim import Batch, World
from palmares.sim.batch import Arrays
from palmares.skills.motion import smoothstep

TASK, HAND = "grasp", "softhand"

LEARNED_WITH = (
    "002_master_chef_can",
    "006_mustard_bottle",
    "017_orange",
    "055_baseball",
    "061_foam_brick",
    "077_rubiks_cube",
)
"""Objects of the training: every second one in the list of `tasks/grasp/task.toml`, from the first on"""
HELD_OUT = ("005_tomato_soup_can", "013_apple", "054_softball", "056_tennis_ball", "065-e_cups")
"""Objects of the test: the others"""

FIRST_TEST_SEED = 5001
"""The test plays the first scenes from this seed on with a held-out object; the training those below"""

STEP_MS = 5.0
"""Longest step of the integration in training; the test has the task's own"""

CONTROL_TICKS = 4
"""Ticks between two velocities of a moving hand"""
FEEDBACK = 0.3
"""Share of the distance from the path that the hand corrects until the next velocity"""


def object_of(seed: int) -> str:
    """Return the name of the object in the scene with this seed."""
    (target,) = World(TASK, HAND, seed).scene.free
    return target.name


def test_scenes(count: int) -> list[int]:
    """Return the seeds of the first scenes of the test."""
    seeds = (seed for seed in itertools.count(FIRST_TEST_SEED) if object_of(seed) in HELD_OUT)
    return list(itertools.islice(seeds, count))


def training_scenes(rng: np.random.Generator) -> Iterator[list[int]]:
    """Yield lists of seeds without end; each list has one scene of every object of the training."""
    found: dict[str, list[int]] = {name: [] for name in LEARNED_WITH}
    while True:
        seed = int(rng.integers(FIRST_TEST_SEED))
        name = object_of(seed)
        if name in found:
            found[name].append(seed)
        if all(found.values()):
            yield [seeds.pop(0) for seeds in found.values()]


SQUARE = 1.15
"""Sides that differ by a smaller factor count as equal"""
LEAST_TURN_RAD = -math.pi / 2 + 0.3
"""Smallest turn. At −π/2 the fingers, which start downwards, come up along x. The offset keeps boxes along x,
such as a camera's view of a ball, away from the boundary between two directions"""


class Hands:
    """The hands of a `Batch`, moved together along smoothsteps.

    A motion has the same duration in all worlds, so that a run does not depend on the others of its batch.

    Attributes:
        batch: The worlds.
        active: (N,), True for worlds that move; runs that are over do not, and a user may stop others.
        obs: The last observations.

    """

    def __init__(self, batch: Batch) -> None:
        self.batch = batch
        self._dt_s = CONTROL_TICKS * batch.tick_s

    def reset(self, seeds: Sequence[int]) -> Arrays:
        """Open a run in every world."""
        self.obs = self.batch.reset(seeds)
        self.active = np.ones(self.batch.count, dtype=bool)
        self.position = self.obs["base"][:, :3].copy()
        self.quat_xyzw = self.obs["base"][:, 3:7].copy()
        self.sigma = self.obs["motors"][:, 0, 1].copy()
        return self.obs

    def to(
        self,
        duration_s: float,
        position: Array | None = None,
        quat_xyzw: Array | None = None,
        sigma: Array | None = None,
    ) -> Arrays:
        """Move to positions (N, 3), m, orientations (N, 4) and commands σ (N,); omitted targets stay."""
        p0, q0, s0 = self.position, self.quat_xyzw, self.sigma
        path = np.zeros_like(p0) if position is None else position - p0
        turn = np.zeros_like(p0) if quat_xyzw is None else rotation_between(q0, quat_xyzw)
        close = np.zeros_like(s0) if sigma is None else sigma - s0
        steps = max(1, round(duration_s / self._dt_s))
        action = np.empty((self.batch.count, 7))
        for k in range(steps):
            now, then = smoothstep(k / steps), smoothstep((k + 1) / steps)
            base = self.obs["base"]
            off = p0 + now * path - base[:, :3]
            off_turn = rotation_between(base[:, 3:7], turned(q0, now * turn))
            action[:, :3] = ((then - now) * path + FEEDBACK * off) / self._dt_s
            action[:, 3:6] = ((then - now) * turn + FEEDBACK * off_turn) / self._dt_s
            action[:, 6] = np.clip(s0 + then * close, 0.0, 1.0)
            self._step(action, CONTROL_TICKS)
        self.position, self.quat_xyzw, self.sigma = p0 + path, turned(q0, turn), s0 + close
        return self.obs

    def wait(self, duration_s: float) -> Arrays:
        """Hold still."""
        action = np.zeros((self.batch.count, 7))
        action[:, 6] = self.sigma
        self._step(action, round(duration_s / self.batch.tick_s))
        return self.obs

    def _step(self, action: Array, ticks: int) -> None:
        self.obs = self.batch.step(action, ticks, self.active).observations
        self.active &= ~self.batch.done


def yaw_across(yaw_rad: Array, sizes_m: Array) -> Array:
    """Return the yaw of the hand with the fingers across the longer side of boxes, (N,), rad.

    The grasp is possible from two sides, and over any side of boxes with about equal sides. The result is the
    one of these directions that turns the hand least from its start.

    Args:
        yaw_rad: (N,), direction of the first side of each box, from x.
        sizes_m: (N, 3), sides of each box; the third is upright.

    """
    first, second = sizes_m[:, 0], sizes_m[:, 1]
    alike = np.maximum(first, second) < SQUARE * np.minimum(first, second)
    across = np.where(second > first, yaw_rad + math.pi / 2, yaw_rad)
    period = np.where(alike, math.pi / 2, math.pi)
    least = LEAST_TURN_RAD - period / 2
    return array((across - least) % period + least)


def rot_zyz(yaw_rad: Array, pitch_rad: Array, roll_rad: Array) -> Array:
    """Return the quaternions (N, 4) of rotations about z, then the new y, then the new z."""
    half = [0.5 * angle for angle in (yaw_rad, pitch_rad, roll_rad)]
    zero = np.zeros_like(half[0])
    yaw = np.stack([zero, zero, np.sin(half[0]), np.cos(half[0])], axis=1)
    pitch = np.stack([zero, np.sin(half[1]), zero, np.cos(half[1])], axis=1)
    roll = np.stack([zero, zero, np.sin(half[2]), np.cos(half[2])], axis=1)
    return _product(_product(yaw, pitch), roll)


def rotated(quat_xyzw: Array, vectors: Array) -> Array:
    """Return the vectors (N, 3) rotated by the quaternions (N, 4)."""
    axis, w = quat_xyzw[:, :3], quat_xyzw[:, 3:]
    twice = 2.0 * np.cross(axis, vectors)
    return array(vectors + w * twice + np.cross(axis, twice))


def rotation_between(start_xyzw: Array, end_xyzw: Array) -> Array:
    """Return the shortest rotations between quaternions (N, 4) as vectors (N, 3), rad, world frame."""
    turn = _product(end_xyzw, start_xyzw * [-1.0, -1.0, -1.0, 1.0])
    turn = np.where(turn[:, 3:] < 0.0, -turn, turn)
    sine = np.linalg.norm(turn[:, :3], axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, turn[:, 3:])
    return array(turn[:, :3] * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 2.0))


def turned(quat_xyzw: Array, turn: Array) -> Array:
    """Return quaternions (N, 4) rotated by rotation vectors (N, 3), rad, world frame."""
    half = 0.5 * np.linalg.norm(turn, axis=1, keepdims=True)
    return _product(np.hstack([0.5 * turn * np.sinc(half / math.pi), np.cos(half)]), quat_xyzw)


def _product(a: Array, b: Array) -> Array:
    """Return the products (N, 4) of quaternions."""
    vector = a[:, 3:] * b[:, :3] + b[:, 3:] * a[:, :3] + np.cross(a[:, :3], b[:, :3])
    return np.hstack([vector, a[:, 3:] * b[:, 3:] - np.sum(a[:, :3] * b[:, :3], axis=1, keepdims=True)])
