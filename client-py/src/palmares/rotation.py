"""Rotations for controllers. Angles are in rad, quaternions are x, y, z, w."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from palmares.arrays import Array, array
from palmares.reproducible import acos, cos, dot, matmul, norm, sin


def rot_y(angle_rad: float) -> Array:
    """Return the rotation matrix (3, 3) about y."""
    c, s = cos(angle_rad), sin(angle_rad)
    return array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rot_z(angle_rad: float) -> Array:
    """Return the rotation matrix (3, 3) about z."""
    c, s = cos(angle_rad), sin(angle_rad)
    return array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rot_zyz(yaw_rad: float, pitch_rad: float, roll_rad: float = 0.0) -> Array:
    """Return the rotation matrix (3, 3) ``rot_z(yaw_rad) @ rot_y(pitch_rad) @ rot_z(roll_rad)``."""
    return matmul(rot_z(yaw_rad), rot_y(pitch_rad), rot_z(roll_rad))


def matrix_of(quat_xyzw: ArrayLike) -> Array:
    """Return the rotation matrix (3, 3) of a quaternion (4,) of any length but zero."""
    q = array(quat_xyzw, 4)
    x, y, z, w = q / norm(q)
    return array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def quat_of(matrix: Array) -> Array:
    """Return the unit quaternion (4,) of a rotation matrix (3, 3).

    Divides by the largest of the four components, so that no rotation is badly conditioned.
    """
    m = matrix
    squares = array(
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
    q = array(rows[largest])
    return array(q / norm(q))


def angle_between(a_xyzw: ArrayLike, b_xyzw: ArrayLike) -> float:
    """Return the angle (rad, 0 to π) of the shortest rotation from one unit quaternion (4,) to another."""
    return 2.0 * acos(min(1.0, abs(dot(a_xyzw, b_xyzw))))


def slerp(a_xyzw: ArrayLike, b_xyzw: ArrayLike, fraction: float) -> Array:
    """Return the unit quaternion (4,) at `fraction` (0 to 1) of the shortest rotation from `a` to `b`."""
    a, b = array(a_xyzw, 4), array(b_xyzw, 4)
    cosine = dot(a, b)
    if cosine < 0.0:
        b, cosine = -b, -cosine
    half_rad = acos(min(1.0, cosine))
    if half_rad < 1e-6:
        return b if fraction > 0.5 else a
    turned = sin((1 - fraction) * half_rad) * a + sin(fraction * half_rad) * b
    return array(turned / sin(half_rad))
