"""Points on the surface of an object that consists of convex parts."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palmares.arrays import Array, array
from palmares.reproducible import cos, dots, matmul, norms, sin
from palmares.scene import ScenePart
from palmares.wire import Shape

FLAT = 1e-6
"""Points within this part of a hull's size from a plane are on it"""


@dataclass(frozen=True)
class Hits:
    """Where lines enter and leave a convex part; each has one entry for each line."""

    enter: Array
    """(n,), distance along the line, m; infinite where it misses the part"""
    leave: Array
    """(n,), m; −infinite where it misses"""
    normal_in: Array
    """(n, 3), outward normal where it enters"""
    normal_out: Array
    """(n, 3), outward normal where it leaves"""


def points_on(parts: Sequence[ScenePart], generator: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Return points evenly spread over the surface (count, 3), m, and its outward normals (count, 3).

    Random lines meet a surface evenly (Crofton's formula). Points inside another part are no surface.
    """
    low, high = bounds(parts)
    middle, radius = 0.5 * (low + high), 0.5 * float(norms(high - low)) + 1e-3
    points: list[Array] = []
    normals: list[Array] = []
    found = 0
    while found < count:
        origin, direction = _lines(generator, max(count, 64), middle, radius)
        hits = [_hits(part, origin, direction) for part in parts]
        for part, mine in enumerate(hits):
            for distance, normal in ((mine.enter, mine.normal_in), (mine.leave, mine.normal_out)):
                seen = np.isfinite(distance)
                for other, theirs in enumerate(hits):
                    if other != part:
                        # A point on two parts belongs to the first.
                        slack = 1e-9 if other < part else -1e-9
                        seen &= (distance < theirs.enter - slack) | (distance > theirs.leave + slack)
                rows = np.flatnonzero(seen)
                points.append(origin[rows] + distance[rows, None] * direction[rows])
                normals.append(normal[rows])
                found += len(rows)
    order = np.argsort(generator.random(found), kind="stable")[:count]
    return np.concatenate(points)[order], np.concatenate(normals)[order]


def chords(
    parts: Sequence[ScenePart], generator: np.random.Generator, count: int, longest: float
) -> tuple[Array, Array]:
    """Return the ends (n, 3) of random lines' ways through the object that are at most `longest`, m.

    A line's way is from where it first enters a part to where it last leaves one.
    """
    low, high = bounds(parts)
    middle, radius = 0.5 * (low + high), 0.5 * float(norms(high - low)) + 1e-3
    origin, direction = _lines(generator, 4 * count, middle, radius)
    hits = [_hits(part, origin, direction) for part in parts]
    enter = np.stack([hit.enter for hit in hits]).min(axis=0)
    leave = np.stack([hit.leave for hit in hits]).max(axis=0)
    rows = np.flatnonzero((enter < leave) & (leave - enter <= longest))[:count]
    return origin[rows] + enter[rows, None] * direction[rows], origin[rows] + leave[rows, None] * direction[
        rows
    ]


def bounds(parts: Sequence[ScenePart]) -> tuple[Array, Array]:
    """Return the corners of the box around all parts, in the frame of the body, each (3,), m."""
    ends = [support(part, axis) for part in parts for axis in np.concatenate([np.eye(3), -np.eye(3)])]
    reach = array(ends).reshape(len(parts), 6)
    return -reach[:, 3:].max(axis=0), reach[:, :3].max(axis=0)


def support(part: ScenePart, direction: Array) -> float:
    """Return how far a part reaches along a unit vector (3,) from the origin of its body, m."""
    turn, shape = part.rotation, part.shape
    local = matmul(turn.T, direction)
    reach = float(dots(part.xyz, direction))
    if shape.points is not None:
        return reach + float(dots(array(shape.points), local).max()) + shape.rounding
    if shape.half_extents is not None:
        return reach + float(dots(np.abs(local), array(shape.half_extents)))
    radius, half = shape.radius or 0.0, shape.half_length or 0.0
    along = abs(float(local[2])) * half
    if shape.type == "cylinder":
        return reach + along + radius * math.sqrt(max(0.0, 1.0 - float(local[2] * local[2])))
    return reach + along + radius


def directions(generator: np.random.Generator, count: int) -> Array:
    """Return unit vectors (count, 3), evenly spread."""
    height, turn = 2.0 * generator.random(count) - 1.0, 2.0 * math.pi * generator.random(count)
    flat = np.sqrt(1.0 - height * height)
    rows = [(f * cos(t), f * sin(t), h) for f, t, h in zip(flat.tolist(), turn.tolist(), height, strict=True)]
    return array(rows)


def across(direction: Array) -> tuple[Array, Array]:
    """Return two unit vectors (…, 3) across unit vectors (…, 3) and each other."""
    least = np.eye(3)[np.argmin(np.abs(direction), axis=-1)]
    first = np.cross(direction, least)
    first = first / norms(first)[..., None]
    return first, np.cross(direction, first)


def _lines(generator: np.random.Generator, count: int, middle: Array, radius: float) -> tuple[Array, Array]:
    """Return lines through a ball, evenly spread: points before it (count, 3) and directions (count, 3)."""
    direction = directions(generator, count)
    first, second = across(direction)
    away, turn = radius * np.sqrt(generator.random(count)), 2.0 * math.pi * generator.random(count)
    aside = array([(a * cos(t), a * sin(t)) for a, t in zip(away.tolist(), turn.tolist(), strict=True)])
    origin = middle + aside[:, :1] * first + aside[:, 1:] * second - radius * direction
    return origin, direction


def _hits(part: ScenePart, origin: Array, direction: Array) -> Hits:
    """Return where lines meet a part placed in its body."""
    turn = part.rotation
    start, along = matmul(origin - part.xyz, turn), matmul(direction, turn)
    shape = part.shape
    if shape.type in ("sphere", "capsule"):
        local = _capsule(shape.radius or 0.0, shape.half_length or 0.0, start, along)
    elif shape.type == "cylinder":
        local = _both(
            _round(shape.radius or 0.0, start, along), _slabs(*_ends(shape.half_length or 0.0), start, along)
        )
    else:
        local = _slabs(*_planes(shape), start, along)
    back = turn.T
    return Hits(local.enter, local.leave, matmul(local.normal_in, back), matmul(local.normal_out, back))


def _ends(half_length: float) -> tuple[Array, Array]:
    return array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]), array([half_length, half_length])


def _planes(shape: Shape) -> tuple[Array, Array]:
    """Return the outward normals (k, 3) and distances (k,) of the faces of a box or hull."""
    if shape.half_extents is not None:
        half = array(shape.half_extents)
        return np.concatenate([np.eye(3), -np.eye(3)]), np.concatenate([half, half])
    normals, distances = _faces(array(shape.points or []))
    return normals, distances + shape.rounding


def _faces(points: Array) -> tuple[Array, Array]:
    """Return the planes of the faces of the hull of points (n, 3): normals (k, 3), distances (k,)."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    size = float(norms(points.max(axis=0) - points.min(axis=0)))
    three = np.array(list(itertools.combinations(range(len(points)), 3)))
    first, second, third = (points[three[:, k]] - middle for k in range(3))
    normal = np.cross(second - first, third - first)
    area = norms(normal)
    kept = area > FLAT * size * size
    normal, first = normal[kept] / area[kept, None], first[kept]
    distance = dots(normal, first)
    outward = np.where(distance < 0.0, -1.0, 1.0)
    normal, distance = normal * outward[:, None], distance * outward
    reach = np.full(len(distance), -np.inf)
    for point in points - middle:
        reach = np.maximum(reach, dots(normal, point[None]))
    face = reach <= distance + FLAT * size
    rounded = np.round(np.column_stack([normal[face], distance[face] / size]), 4)
    _, rows = np.unique(rounded, axis=0, return_index=True)
    normal, distance = normal[face][rows], distance[face][rows]
    return normal, distance + dots(normal, middle[None])


def _slabs(normals: Array, distances: Array, start: Array, along: Array) -> Hits:
    """Return where lines are inside all half-spaces ``normal · x ≤ distance``."""
    count = len(start)
    enter, leave = np.full(count, -np.inf), np.full(count, np.inf)
    normal_in, normal_out = np.zeros((count, 3)), np.zeros((count, 3))
    for normal, distance in zip(normals, distances.tolist(), strict=True):
        speed, ahead = dots(along, normal[None]), distance - dots(start, normal[None])
        with np.errstate(divide="ignore", invalid="ignore"):
            at = ahead / speed
        later = (speed < 0.0) & (at > enter)
        enter, normal_in = np.where(later, at, enter), np.where(later[:, None], normal, normal_in)
        sooner = (speed > 0.0) & (at < leave)
        leave, normal_out = np.where(sooner, at, leave), np.where(sooner[:, None], normal, normal_out)
        leave = np.where((speed == 0.0) & (ahead < 0.0), -np.inf, leave)
    return _whole(enter, leave, normal_in, normal_out)


def _round(radius: float, start: Array, along: Array) -> Hits:
    """Return where lines are inside an endless cylinder about z."""
    flat = np.array([1.0, 1.0, 0.0])
    return _quadratic(start * flat, along * flat, start, along, radius, flat)


def _ball(radius: float, height: float, start: Array, along: Array) -> Hits:
    moved = start - array([0.0, 0.0, height])
    return _quadratic(moved, along, moved, along, radius, np.ones(3))


def _quadratic(p: Array, v: Array, start: Array, along: Array, radius: float, kept: Array) -> Hits:
    a, b, c = dots(v, v), dots(p, v), dots(p, p) - radius * radius
    root = b * b - a * c
    meets = (root > 0.0) & (a > 0.0)
    safe, half = np.where(meets, a, 1.0), np.sqrt(np.where(meets, root, 0.0))
    # A line along the axis of a cylinder is inside it or beside it.
    inside = (a <= 0.0) & (c < 0.0)
    enter = np.where(meets, (-b - half) / safe, np.where(inside, -np.inf, np.inf))
    leave = np.where(meets, (-b + half) / safe, np.where(inside, np.inf, -np.inf))
    ends = [start + np.where(meets, at, 0.0)[:, None] * along for at in (enter, leave)]
    normals = [at * kept / max(radius, 1e-12) for at in ends]
    return Hits(enter, leave, normals[0], normals[1])


def _capsule(radius: float, half: float, start: Array, along: Array) -> Hits:
    """Return where lines are inside a capsule about z, or a sphere: the union of a cylinder and two balls."""
    if half == 0.0:
        return _ball(radius, 0.0, start, along)
    pieces = [
        _both(_round(radius, start, along), _slabs(*_ends(half), start, along)),
        _ball(radius, half, start, along),
        _ball(radius, -half, start, along),
    ]
    enters, leaves = np.stack([p.enter for p in pieces]), np.stack([p.leave for p in pieces])
    first, last = np.argmin(enters, axis=0), np.argmax(leaves, axis=0)
    rows = np.arange(len(start))
    return Hits(
        enters[first, rows],
        leaves[last, rows],
        np.stack([p.normal_in for p in pieces])[first, rows],
        np.stack([p.normal_out for p in pieces])[last, rows],
    )


def _both(one: Hits, other: Hits) -> Hits:
    """Return where lines are inside two convex shapes."""
    later, sooner = other.enter > one.enter, other.leave < one.leave
    return _whole(
        np.where(later, other.enter, one.enter),
        np.where(sooner, other.leave, one.leave),
        np.where(later[:, None], other.normal_in, one.normal_in),
        np.where(sooner[:, None], other.normal_out, one.normal_out),
    )


def _whole(enter: Array, leave: Array, normal_in: Array, normal_out: Array) -> Hits:
    missed = ~(enter < leave)
    return Hits(np.where(missed, np.inf, enter), np.where(missed, -np.inf, leave), normal_in, normal_out)
