"""The few rotations a controller needs. Quaternions are x, y, z, w as on the wire."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]


def rot_y(angle: float) -> Array:
    """Return the 3 × 3 rotation by `angle` (rad) about y."""
    c, s = float(np.cos(angle)), float(np.sin(angle))
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rot_z(angle: float) -> Array:
    """Return the 3 × 3 rotation by `angle` (rad) about z."""
    c, s = float(np.cos(angle)), float(np.sin(angle))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def matrix_of(quat_xyzw: Sequence[float] | Array) -> Array:
    """Return the 3 × 3 rotation matrix of a quaternion of any length but zero."""
    q = np.asarray(quat_xyzw, dtype=np.float64)
    x, y, z, w = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def quat_of(matrix: Array) -> Array:
    """Return the unit quaternion x, y, z, w of a rotation matrix.

    Divides by the largest of the four components, so that no rotation is badly conditioned.
    """
    m = matrix
    squares = np.array(
        [
            1 + m[0, 0] - m[1, 1] - m[2, 2],
            1 - m[0, 0] + m[1, 1] - m[2, 2],
            1 - m[0, 0] - m[1, 1] + m[2, 2],
            1 + m[0, 0] + m[1, 1] + m[2, 2],
        ]
    )
    largest = int(np.argmax(squares))
    rows = [
        [squares[0], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[2, 1] - m[1, 2]],
        [m[0, 1] + m[1, 0], squares[1], m[1, 2] + m[2, 1], m[0, 2] - m[2, 0]],
        [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], squares[2], m[1, 0] - m[0, 1]],
        [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], squares[3]],
    ]
    q = np.array(rows[largest], dtype=np.float64)
    unit: Array = q / np.linalg.norm(q)
    return unit


def angle_between(a: Sequence[float] | Array, b: Sequence[float] | Array) -> float:
    """Return the angle (rad, 0 to π) of the shortest turn from quaternion `a` to `b`."""
    return 2.0 * float(np.arccos(min(1.0, abs(float(np.dot(a, b))))))


def slerp(a: Sequence[float] | Array, b: Sequence[float] | Array, fraction: float) -> Array:
    """Return the quaternion `fraction` of the shortest way from `a` (0) to `b` (1)."""
    qa, qb = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    cosine = float(qa @ qb)
    if cosine < 0.0:
        qb, cosine = -qb, -cosine
    half = float(np.arccos(min(1.0, cosine)))
    if half < 1e-6:
        return qb if fraction > 0.5 else qa
    turned: Array = (np.sin((1 - fraction) * half) * qa + np.sin(fraction * half) * qb) / np.sin(half)
    return turned
