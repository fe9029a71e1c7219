"""Rotations against their definitions."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palmares.rotation import angle_between, matrix_of, quat_of, rot_y, rot_z, rot_zyz, slerp


def test_known_rotations() -> None:
    assert rot_z(math.pi / 2) @ [1, 0, 0] == pytest.approx([0, 1, 0])
    assert rot_y(math.pi / 2) @ [1, 0, 0] == pytest.approx([0, 0, -1])
    assert rot_zyz(0.3, 0.5, -0.7) == pytest.approx(rot_z(0.3) @ rot_y(0.5) @ rot_z(-0.7))
    assert matrix_of((0, 0, math.sin(0.3), math.cos(0.3))) == pytest.approx(rot_z(0.6))


def test_quaternion_and_matrix_agree_everywhere() -> None:
    rng = np.random.default_rng(1)
    quats = [*rng.normal(size=(200, 4)), *np.eye(4)]
    for quat in quats:
        unit = quat / np.linalg.norm(quat)
        back = quat_of(matrix_of(quat))
        assert abs(float(back @ unit)) == pytest.approx(1.0, abs=1e-12)


def test_slerp_takes_the_shortest_rotation_at_constant_speed() -> None:
    a, b = quat_of(rot_z(0.1)), -quat_of(rot_z(2.1))
    for fraction in (0.0, 0.25, 0.5, 1.0):
        assert matrix_of(slerp(a, b, fraction)) == pytest.approx(rot_z(0.1 + 2.0 * fraction))
    assert angle_between(a, b) == pytest.approx(2.0)
    assert slerp(a, a, 0.5) == pytest.approx(a)
