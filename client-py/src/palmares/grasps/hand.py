"""Where a hand takes hold: its ways of approach and the middle of its closing fingers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palmares.analysis import Hand
from palmares.arrays import Array, array
from palmares.reproducible import cos, dot, dots, matmul, mean, norm, norms, sin
from palmares.rotation import matrix_of
from palmares.sim import describe_hand
from palmares.skills.recipes import RECIPES

POSTURES = 9
"""Postures of the hand from opened to closed"""
LAST = 6
"""The first of them whose fingers are too closed to begin to hold an object"""
POWERS = 64
"""Multiplications that find the principal direction"""
RIM = 8
"""Points on each rim of a cylinder"""


@dataclass(frozen=True)
class Reach:
    """What a sampler needs to know of a hand. Vectors are in the frame of the hand's base."""

    name: str
    opened: Array
    """(motors,), σ on the way to the object"""
    closed: Array
    """(motors,), σ in the grasp"""
    fingers: Array
    """(3,), unit vector along the opened fingers: the approach of a grasp with the fingertips"""
    palm: Array
    """(3,), unit vector across `fingers` that the palm faces: the approach of a grasp with the palm"""
    one_sided: float
    """How much of the fingertips' first motion is along `palm`: 0 for opposed fingers, at most 1"""
    across: Array
    """(3,), unit vector along which fingertips close against each other"""
    opening_m: float
    """Largest distance of two opened fingertips along `across`, m"""
    centres: Array
    """(k, 3), middle of the fingertips in postures from slightly to more than half closed, m"""
    points: Array
    """(n, 3), points whose balls of radius `radii` contain the opened hand's lowest parts, m"""
    radii: Array
    """(n,), m"""

    def lowest(self, rotation: Array) -> Array:
        """Return the height of the opened hand's lowest point over its base, (…,), m.

        Args:
            rotation: (…, 3, 3), world from hand.

        """
        heights = matmul(rotation[..., 2, :], self.points.T) - self.radii
        return array(heights.min(axis=-1))

    @property
    def size_m(self) -> float:
        """Largest distance of a point of the opened hand from its base, m."""
        return float((norms(self.points) + self.radii).max())


def reach_of(
    hand: str, opened: Sequence[float] | None = None, closed: Sequence[float] | None = None
) -> Reach:
    """Return how a hand takes hold.

    Args:
        hand: Name of the hand, or the path of your own.
        opened: σ of every motor on the way to the object; left out, that of the hand's recipe, or else 0.
        closed: σ of every motor in the grasp; left out, that of the recipe, or else 1.

    Raises:
        ValueError: The hand cannot be read, has no fingers, or σ is out of range.

    """
    model, described = Hand(hand), describe_hand(hand)
    recipe = RECIPES.get(model.name) if hand == model.name else None
    motors = len(model.motors)
    start = _sigma("opened", opened, recipe.opened if recipe else [0.0] * motors, motors)
    end = _sigma("closed", closed, recipe.closed if recipe else [1.0] * motors, motors)
    share = np.linspace(0.0, 1.0, POSTURES)[:, None]
    rests = model.rests(start + share * (end - start))
    poses = [model.poses(q) for q in rests["q"]]
    tips, roots = _fingers(described)
    if not tips:
        raise ValueError(f"hand: {hand} has no link that moves, so it cannot grasp")
    names = {name: row for row, name in enumerate(model.links)}
    com = {link["name"]: array(link["com"]) for link in described["links"]}
    ways = [array([_placed(pose[names[tip]], com[tip]) for tip in tips]) for pose in poses]
    bases = mean([poses[0][names[root]][:3] for root in roots])
    along = mean(ways[0]) - bases
    fingers = along / norm(along) if norm(along) > 0.0 else array([0.0, 0.0, 1.0])
    moved = ways[1] - ways[0]
    aside = mean(moved) - dot(mean(moved), fingers) * fingers
    most = float(mean(norms(moved)))
    one_sided = min(1.0, norm(aside) / most) if most > 0.0 else 0.0
    palm = aside / norm(aside) if norm(aside) > 0.0 else array([0.0, 0.0, 0.0])
    across = _principal(ways[-1] - ways[0], fingers)
    spread = dots(ways[0], across[None])
    points, radii = _outline(described, poses[0], names)
    return Reach(
        model.name,
        start,
        end,
        fingers,
        palm,
        one_sided,
        across,
        float(spread.max() - spread.min()),
        array([mean(way) for way in ways[1:LAST]]),
        points,
        radii,
    )


def _principal(motion: Array, fingers: Array) -> Array:
    """Return the direction (3,) in which motions (k, 3) differ most, by powers of their covariance."""
    apart = motion - mean(motion)
    covariance = mean([row[:, None] * row[None] for row in apart])
    axis = array([0.6, 0.64, 0.48])
    for _ in range(POWERS):
        turned = matmul(covariance, axis)
        if norm(turned) < 1e-12:
            # One fingertip, or all move alike: any direction across the fingers.
            least = np.eye(3)[int(np.argmin(np.abs(fingers)))]
            turned = np.cross(fingers, least)
        axis = turned / norm(turned)
    return array(axis)


def _sigma(name: str, given: Sequence[float] | None, default: Sequence[float], motors: int) -> Array:
    values = list(default if given is None else given)
    if len(values) != motors or not all(0.0 <= value <= 1.0 for value in values):
        raise ValueError(f"{name}: found {values}; wanted {motors} numbers from 0 to 1, one for each motor")
    return array(values)


def _fingers(described: dict[str, Any]) -> tuple[list[str], list[str]]:
    """Return the last link of every finger, and the first one after the base."""
    parent = {link["name"]: link["parent"] for link in described["links"]}
    tips = [name for name in parent if name not in parent.values() and parent[name] is not None]
    roots = []
    for tip in tips:
        root = tip
        while parent[parent[root]] is not None:
            root = parent[root]
        roots.append(root)
    return tips, roots


def _placed(pose: Array, point: Array) -> Array:
    return array(pose[:3] + matmul(matrix_of(pose[3:]), point))


def _outline(described: dict[str, Any], poses: Array, rows: dict[str, int]) -> tuple[Array, Array]:
    """Return balls (n, 3), (n,) on the corners of all shapes of a hand."""
    points: list[Array] = []
    radii: list[Array] = []
    for link in described["links"]:
        pose = poses[rows[link["name"]]]
        turn = matrix_of(pose[3:])
        for part in link["shapes"]:
            corners, radius = _corners(part["shape"])
            local = matmul(corners, matrix_of(part["quat_xyzw"]).T) + array(part["position"])
            points.append(matmul(local, turn.T) + pose[:3])
            radii.append(np.full(len(corners), radius))
    return np.concatenate(points), np.concatenate(radii)


def _corners(shape: dict[str, Any]) -> tuple[Array, float]:
    """Return points (n, 3) and the radius of a ball about each that together span a shape."""
    kind, rounding = shape["type"], shape.get("rounding") or 0.0
    if kind == "box":
        half = array(shape["half_extents"]) - rounding
        signs = array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        return signs * half, rounding
    if kind == "hull":
        return array(shape["points"], -1, 3), rounding
    radius, half_length = shape.get("radius") or 0.0, shape.get("half_length") or 0.0
    if kind == "cylinder":
        turns = [2.0 * math.pi * k / RIM for k in range(RIM)]
        rim = [(radius * cos(t), radius * sin(t), end) for t in turns for end in (-half_length, half_length)]
        return array(rim), 0.0
    return array([[0.0, 0.0, -half_length], [0.0, 0.0, half_length]]), radius
