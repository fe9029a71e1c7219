"""Grasps from above with the SoftHand, and the hand's shape as capsules."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palmares.arrays import Array, array
from palmares.reproducible import dots, matmul, norms
from palmares.rotation import rot_z, rot_zyz
from palmares.skills.motion import UP
from palmares.skills.objects import ObjectBounds

__all__ = [
    "SOFTHAND_PRESHAPED",
    "Capsules",
    "SideGrasp",
    "TopGrasp",
]


@dataclass(frozen=True)
class Capsules:
    """A body as `n` capsules: the points within `radius` of the segments from `start` to `end`, m."""

    start: Array
    """(n, 3)"""
    end: Array
    """(n, 3)"""
    radius: Array
    """(n,)"""

    def at(self, rotation: Array, position: Array) -> Capsules:
        """Return the capsules of the body placed with `rotation` (3, 3) at `position` (3,), m."""
        turn = rotation.T
        return Capsules(matmul(self.start, turn) + position, matmul(self.end, turn) + position, self.radius)

    def distances(self, points: Array) -> Array:
        """Return the distances of points (m, 3) from the surfaces of all capsules, (n, m), m; inside, < 0."""
        axis = self.end - self.start
        offset = points[None, :, :] - self.start[:, None, :]
        along = dots(offset, axis[:, None, :]) / dots(axis, axis)[:, None]
        nearest = self.start[:, None, :] + np.clip(along, 0.0, 1.0)[:, :, None] * axis[:, None, :]
        return array(norms(points[None, :, :] - nearest) - self.radius[:, None])

    def bounds(self) -> tuple[Array, Array]:
        """Return the smallest and the largest coordinates of every capsule, each (n, 3), m."""
        radius = self.radius[:, None]
        return np.minimum(self.start, self.end) - radius, np.maximum(self.start, self.end) + radius

    def spheres(self, count: int) -> tuple[Array, Array]:
        """Return `count` spheres along every capsule: centres (count·n, 3) and radii (count·n,), m."""
        share = np.linspace(0.0, 1.0, count)[:, None, None]
        centres = self.start[None] * (1 - share) + self.end[None] * share
        return centres.reshape(-1, 3), np.tile(self.radius, count)


def _capsules(*rows: tuple[tuple[float, ...], tuple[float, ...], float]) -> Capsules:
    start, end, radius = zip(*rows, strict=True)
    return Capsules(array(start), array(end), array(radius))


SOFTHAND_PRESHAPED = _capsules(
    ((0.000, 0.000, 0.045), (0.000, 0.000, 0.080), 0.042),  # wrist
    ((-0.006, 0.027, 0.100), (-0.006, 0.027, 0.170), 0.019),  # palm, thumb side
    ((-0.006, 0.005, 0.100), (-0.006, 0.005, 0.185), 0.019),  # palm, middle
    ((-0.006, -0.020, 0.100), (-0.006, -0.022, 0.170), 0.019),  # palm, little finger's side
    ((0.008, 0.037, 0.146), (0.014, 0.069, 0.160), 0.011),  # thumb
    ((0.014, 0.069, 0.160), (0.021, 0.102, 0.181), 0.009),
    ((-0.001, 0.026, 0.184), (0.006, 0.031, 0.227), 0.009),  # index
    ((0.006, 0.031, 0.227), (0.022, 0.034, 0.263), 0.009),
    ((-0.001, 0.007, 0.191), (0.006, 0.007, 0.234), 0.009),  # middle
    ((0.006, 0.007, 0.234), (0.022, 0.007, 0.270), 0.009),
    ((-0.001, -0.013, 0.184), (0.006, -0.015, 0.227), 0.009),  # ring
    ((0.006, -0.015, 0.227), (0.022, -0.018, 0.263), 0.009),
    ((-0.001, -0.032, 0.174), (0.006, -0.037, 0.217), 0.009),  # little
    ((0.006, -0.037, 0.217), (0.022, -0.041, 0.253), 0.009),
)
"""The SoftHand on its way to an object, fingers slightly curled (σ ≈ 0.1), in the hand frame"""


@dataclass(frozen=True)
class TopGrasp:
    """A grasp of the SoftHand from above. Hand frame: fingers +z, palm normal +x, thumb +y."""

    name: str
    pitch_rad: float
    """π/2 holds the fingers horizontal, more points them down"""
    roll_rad: float
    """Turns the palm about the fingers' axis"""
    above_m: float
    """Height of the hand's origin over the object's top, along the palm normal"""
    aside_m: float
    """y of the object's middle in the hand frame"""
    along_m: float
    """z of the object's middle in the hand frame, along the fingers"""
    sigma_open: float
    """Motor command on the way to the object"""
    sigma_closed: float
    """Motor command of the grasp"""
    sink_m: float
    """The hand approaches at this distance above the grasp and then sinks"""

    def rotation(self, yaw_rad: float) -> Array:
        """Return world-from-hand (3, 3): fingers along +y, turned by `yaw_rad` about the vertical."""
        return rot_zyz(math.pi / 2 + yaw_rad, self.pitch_rad, self.roll_rad)

    def base_position(self, target: ObjectBounds, rotation: Array) -> Array:
        """Return the position of the base when the fingers close on `target`, (3,), m."""
        height_m = float(target.high[2] - target.low[2])
        in_hand = array([height_m / 2 + self.above_m, self.aside_m, self.along_m])
        return array(target.middle - matmul(rotation, in_hand))

    def way_in(self, at: Array, rotation: Array) -> list[Array]:  # noqa: ARG002
        """Return the positions (3,), m, of the base on its way to the grasp at `at` (3,)."""
        return [array(at + self.sink_m * UP)]


@dataclass(frozen=True)
class SideGrasp:
    """A grasp of the SoftHand from the side: fingers horizontal, thumb up, palm on the longer side."""

    name: str
    roll_rad: float
    """Turns the palm about the fingers' axis, upwards"""
    gap_m: float
    """Distance of the hand's axis from the object's longer side"""
    above_m: float
    """Height of the hand over the object's middle"""
    along_m: float
    """z of the object's middle in the hand frame, along the fingers"""
    sigma_open: float
    """Motor command on the way to the object"""
    sigma_closed: float
    """Motor command of the grasp"""
    back_m: float
    """The hand comes down at this distance from the grasp and then moves forward along its palm normal"""
    rise_m: float
    """It comes down from this height over the grasp"""

    def rotation(self, yaw_rad: float) -> Array:
        """Return world-from-hand (3, 3): fingers along +x, turned by `yaw_rad` about the vertical."""
        upright = array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
        return matmul(rot_z(yaw_rad), upright, rot_z(self.roll_rad))

    def base_position(self, target: ObjectBounds, rotation: Array) -> Array:
        """Return the position of the base when the fingers close on `target`, (3,), m."""
        in_hand = array([target.size[1] / 2 + self.gap_m, 0.0, self.along_m])
        return array(target.middle - matmul(rotation, in_hand) + self.above_m * UP)

    def way_in(self, at: Array, rotation: Array) -> list[Array]:
        """Return the positions (3,), m, of the base on its way to the grasp at `at` (3,)."""
        before = at - self.back_m * rotation[:, 0]
        return [array(before + self.rise_m * UP), array(before)]
