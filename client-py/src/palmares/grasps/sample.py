"""Where to try a grasp: hands placed on points of an object's surface."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palmares.arrays import Array, array
from palmares.grasps.hand import Reach
from palmares.grasps.scene import Pose
from palmares.grasps.surface import across, chords, directions, points_on
from palmares.reproducible import cos, dots, matmul, mean, norms, sin
from palmares.rotation import matrix_of, quat_of
from palmares.scene import SceneBody

TILT_DEG = 30.0
"""Largest angle between the approach and the inward normal of the surface"""
DEEPEST_M = 0.07
"""Largest depth below the surface of the middle of the fingers; a hand that meets the object stops earlier"""
NEAR_M, NEAR_DEG = 0.012, 15.0
"""Distance and turn of a grasp near another one"""
BLOCK = 32
"""Grasps that are drawn at once in one of the two ways"""
FREE_M = 0.002
"""Least distance of the opened hand from the table"""
RAISED_M = 0.03
"""A hand that has to be raised by more to be free of the table is not tried"""
FROM_BELOW = 0.3
"""Largest vertical part of an approach upward"""


@dataclass(frozen=True)
class Candidates:
    """Grasps to try, in the world of the scene; every array has one entry for each."""

    position: Array
    """(n, 3), of the hand's base where it closes, m"""
    quat: Array
    """(n, 4), x y z w"""
    approach: Array
    """(n, 3), unit vector along which the hand comes"""

    def __len__(self) -> int:
        return len(self.position)

    def __getitem__(self, rows: slice) -> Candidates:
        return Candidates(self.position[rows], self.quat[rows], self.approach[rows])

    def at(self, rows: Sequence[int]) -> Candidates:
        """Return the grasps of some rows."""
        chosen = np.array(rows, dtype=np.int64)
        return Candidates(self.position[chosen], self.quat[chosen], self.approach[chosen])


def candidates(
    reach: Reach, body: SceneBody, pose: Pose, generator: np.random.Generator, count: int
) -> Candidates:
    """Return `count` grasps whose hand is free of the table.

    A point of the surface is drawn, then an approach within `TILT_DEG` of the inward normal, a direction of
    the hand between that of its fingers and that of its palm, a turn about the approach, and how deep the
    middle of the fingers is below the surface.
    """
    found: list[Candidates] = []
    total = 0
    ways = itertools.cycle((_from_surface, _across_chords))
    while total < count:
        some = next(ways)(reach, body, pose, generator, BLOCK)[: count - total]
        found.append(some)
        total += len(some)
    return joined(found)


def joined(parts: Sequence[Candidates]) -> Candidates:
    """Return all grasps of `parts`."""
    whole = (np.concatenate([getattr(it, name) for it in parts]) for name in ("position", "quat", "approach"))
    return Candidates(*whole)


def near(reach: Reach, tries: Candidates, rows: Sequence[int], generator: np.random.Generator) -> Candidates:
    """Return a grasp near each of some grasps, free of the table.

    The middle of its fingers is within `NEAR_M` along each axis, and it is turned by at most `NEAR_DEG`.
    """
    parts = tries.at(rows)
    count = len(parts)
    axes, angles = directions(generator, count), math.radians(NEAR_DEG) * generator.random(count)
    turned = array([_about(axis, angle) for axis, angle in zip(axes, angles.tolist(), strict=True)])
    before = array([matrix_of(quat) for quat in parts.quat]).reshape(-1, 3, 3)
    rotation = products(turned, before)
    approach = products(turned, parts.approach[:, :, None])[:, :, 0]
    centre = mean(reach.centres)
    moved = NEAR_M * (2.0 * generator.random((count, 3)) - 1.0)
    position = parts.position + matmul(before, centre) + moved - matmul(rotation, centre)
    position[:, 2] += np.maximum(0.0, FREE_M - (position[:, 2] + reach.lowest(rotation)))
    return Candidates(position, array([quat_of(it) for it in rotation]).reshape(-1, 4), approach)


def _about(axis: Array, angle: float) -> Array:
    """Return the rotation (3, 3) about a unit vector by an angle, rad (Rodrigues's formula)."""
    x, y, z = axis.tolist()
    cross = array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return array(np.eye(3) + sin(angle) * cross + (1.0 - cos(angle)) * matmul(cross, cross))


def _from_surface(
    reach: Reach, body: SceneBody, pose: Pose, generator: np.random.Generator, count: int
) -> Candidates:
    points, normals = points_on(body.parts, generator, count)
    points = matmul(points, pose.rotation.T) + pose.position
    inward = -matmul(normals, pose.rotation.T)
    tilt = cos(math.radians(TILT_DEG))
    aside = directions(generator, count)
    # A uniform direction within a cone about the normal: the height is uniform, the rest is across.
    height = tilt + (1.0 - tilt) * generator.random(count)
    aside = aside - dots(aside, inward)[:, None] * inward
    length = np.sqrt(dots(aside, aside))
    aside = aside / np.where(length > 0.0, length, 1.0)[:, None]
    approach = height[:, None] * inward + np.sqrt(1.0 - height * height)[:, None] * aside
    share = generator.random(count) * reach.one_sided * math.pi / 2
    turn = 2.0 * math.pi * generator.random(count)
    depth = DEEPEST_M * generator.random(count)
    hand_way = array([cos(s) * reach.fingers + sin(s) * reach.palm for s in share.tolist()])
    rotation = products(_frames(approach, turn), np.swapaxes(_frames(hand_way, np.zeros(count)), 1, 2))
    return _placed(reach, points + depth[:, None] * approach, rotation, approach, generator)


def _across_chords(
    reach: Reach, body: SceneBody, pose: Pose, generator: np.random.Generator, count: int
) -> Candidates:
    first, second = chords(body.parts, generator, count, reach.opening_m)
    middle = matmul(0.5 * (first + second), pose.rotation.T) + pose.position
    along = matmul(second - first, pose.rotation.T)
    along = along / norms(along)[:, None]
    n = len(middle)
    share = generator.random(n) * reach.one_sided * math.pi / 2
    hand_way = array([cos(s) * reach.fingers + sin(s) * reach.palm for s in share.tolist()])
    # The approach in the hand, made exact across its closing direction.
    hand_way = hand_way - dots(hand_way, reach.across[None])[:, None] * reach.across
    length = norms(hand_way)
    rows = np.flatnonzero(length > 0.3)
    along, middle, hand_way = along[rows], middle[rows], hand_way[rows] / length[rows, None]
    turn = 2.0 * math.pi * generator.random(n)[rows]
    back = (0.04 * generator.random(n) - 0.02)[rows]
    world = _frames(along, turn)
    approach = world[:, :, 1]
    hand = np.stack(
        [np.tile(reach.across, (len(rows), 1)), hand_way, np.cross(reach.across[None], hand_way)], axis=2
    )
    rotation = products(world, np.swapaxes(hand, 1, 2))
    return _placed(reach, middle + back[:, None] * approach, rotation, approach, generator)


def _placed(
    reach: Reach, middle: Array, rotation: Array, approach: Array, generator: np.random.Generator
) -> Candidates:
    """Return the grasps, free of the table, with `middle` (n, 3) between the fingertips of a posture."""
    centres = reach.centres[generator.integers(len(reach.centres), size=len(middle))]
    position = middle - products(rotation, centres[:, :, None])[:, :, 0]
    raised = np.maximum(0.0, FREE_M - (position[:, 2] + reach.lowest(rotation)))
    position[:, 2] += raised
    rows = np.flatnonzero((raised <= RAISED_M) & (approach[:, 2] <= FROM_BELOW))
    quats = array([quat_of(rotation[row]) for row in rows]).reshape(-1, 4)
    return Candidates(position[rows], quats, approach[rows])


def products(first: Array, second: Array) -> Array:
    """Return the products (n, 3, 3) of matrices (n, 3, 3), each summed from the first term to the last."""
    terms = [first[:, :, k, None] * second[:, k, None, :] for k in range(3)]
    return array(terms[0] + terms[1] + terms[2])


def _frames(ahead: Array, turn: Array) -> Array:
    """Return rotations (n, 3, 3) with the first column `ahead`, turned about it by `turn` (n,), rad."""
    first, second = across(ahead)
    c, s = (array([f(t) for t in turn.tolist()])[:, None] for f in (cos, sin))
    side = c * first + s * second
    return np.stack([ahead, side, np.cross(ahead, side)], axis=2)
