"""Grasp one object with the SoftHand by its sensors alone, lift it, hold it through a shake.

    python grasp_sensors.py --seed 1                    # needs `palmares serve`, or --url local

Two depth cameras show the table. Points above it belong to the object: the smallest upright box around them
is its position, its size and the direction of its longer side. `grasp_softhand.py` has the grasps for an
object of this size. The hand takes the first one, closes and lifts. If the wrist then does not carry the
object's weight, the controller takes new images and tries the next grasp.
"""

from __future__ import annotations

import contextlib
import logging
import math
from dataclasses import dataclass, replace

import numpy as np

import palmares
from palmares.arrays import Array, array
from palmares.examples.grasp_softhand import CLOSE_S, LIFT_S, Grasp, grasps_for
from palmares.reproducible import matmul, norm
from palmares.rotation import quat_of, rot_z
from palmares.skills.holding import GraspSummary, grasp_summary
from palmares.skills.motion import UP, Mover, RunOverError
from palmares.skills.objects import ObjectBounds
from palmares.skills.runs import play

LOG = logging.getLogger(__name__)

LIFT_M = 0.16
"""Height of the lift"""
TRIES = 4
"""Attempts per run"""
CAMERAS = ["table", "top"]
FEEL_S = 0.2
"""Duration of the mean over the wrist's noise"""
IMAGES = 10
"""Images of each camera in the mean"""
ASIDE_M = 0.45
"""Distance of the hand from the middle during the images, away from the camera at the table"""
HALF_AREA_M = 0.3
"""Half the sides of the searched area, along x and y from the middle"""
ABOVE_TABLE_M = 0.01
"""Points above this height are no noise of the table"""
MIN_POINTS = 30
"""Fewest points of an object"""
SQUARE = 1.15
"""Sides of an object that differ by a smaller factor count as equal"""


@dataclass(frozen=True)
class FoundObject:
    """The smallest upright box around the object."""

    bounds: ObjectBounds
    """The box, turned until its longer side is along x"""
    yaw_rad: float
    """Direction of its longer side, from x"""


def find_object(points: Array, table_m: float) -> FoundObject | None:
    """Return the box around the `points` (n, 3), m, above the table; `None` if there are too few."""
    near = np.all(np.abs(points[:, :2]) < HALF_AREA_M, axis=1)
    cloud = points[near & (points[:, 2] > table_m + ABOVE_TABLE_M)]
    if len(cloud) < MIN_POINTS:
        return None
    best: tuple[float, float, Array, Array] | None = None
    for yaw_rad in (math.radians(degrees) for degrees in range(0, 90, 3)):
        # Some points at the edges are wrong: leave out one in two hundred on each side.
        low, high = np.percentile(matmul(cloud[:, :2], rot_z(yaw_rad)[:2, :2]), [0.5, 99.5], axis=0)
        area = float((high[0] - low[0]) * (high[1] - low[1]))
        if best is None or area < best[0]:
            best = area, yaw_rad, low, high
    assert best is not None
    _, yaw_rad, low, high = best
    middle = matmul(rot_z(yaw_rad)[:2, :2], (low + high) / 2)
    long, wide = high - low
    # If the sides are equal, as of a round object, the one that turns the hand less counts as longer.
    equal = max(long, wide) < SQUARE * min(long, wide)
    if (equal and yaw_rad > math.pi / 4) or (not equal and wide > long):
        long, wide, yaw_rad = wide, long, yaw_rad + math.pi / 2
    top = float(np.percentile(cloud[:, 2], 98.0))
    half = array([long / 2, wide / 2, (top - table_m) / 2])
    centre = array([*middle, (top + table_m) / 2])
    # The grasp is possible from both sides: choose the one that turns the hand less.
    yaw_rad = (yaw_rad + math.pi / 2) % math.pi - math.pi / 2
    return FoundObject(ObjectBounds(0, "object", centre - half, centre + half, centre), yaw_rad)


def mean_reading(images: list[Array]) -> Array:
    """Return the mean (h, w, 3) of images (h, w, 3) over their readings; NaN where none of them has one."""
    found, counts = np.zeros_like(images[0]), np.zeros_like(images[0])
    for image in images:
        has = np.isfinite(image)
        found, counts = found + np.where(has, image, 0.0), counts + has
    return array(np.where(counts > 0.0, found / np.maximum(counts, 1.0), np.nan))


class Senses(Mover):
    """Moves the hand and takes images."""

    def look(self) -> Array:
        """Return the points (n, 3), m, of both cameras, each the mean of several images."""
        self.wait(0.15)  # An image may be 0.13 s old.
        images: dict[str, list[Array]] = {name: [] for name in CAMERAS}
        for _ in range(IMAGES):
            self.wait(0.03)
            self.keep(self.client.step(cameras=CAMERAS))
            for name in CAMERAS:
                images[name].append(self.obs.cameras[name].points())
        clouds = [mean_reading(stack).reshape(-1, 3) for stack in images.values()]
        cloud = np.concatenate(clouds)
        return array(cloud[np.isfinite(cloud).all(axis=1)])


def attempt(hand: Senses, found: FoundObject, grasp: Grasp, turn_rad: float, weight_n: float) -> bool:
    """Grasp and lift the object. Return whether the wrist carries its weight."""
    rotation = grasp.rotation(found.yaw_rad + turn_rad)
    at = grasp.base_position(found.bounds, rotation)
    for position in grasp.way_in(at, rotation):
        hand.to(0.8, position, quat_of(rotation), sigma=grasp.sigma_open)
    empty = hand.wrist_force(FEEL_S)
    hand.to(0.5, at)
    hand.to(CLOSE_S, sigma=grasp.sigma_closed)
    hand.wait(0.3)
    hand.to(LIFT_S, at + LIFT_M * UP)
    return norm(hand.wrist_force(FEEL_S) - empty) > 0.5 * weight_n


def run(client: palmares.Client, seed: int | None) -> GraspSummary:
    """Play one run."""
    first = client.reset("grasp", "softhand", sensing="sensors", noise="real", seed=seed, cameras=CAMERAS)
    table = client.scene.body("table").parts[0]
    table_m = table.position[2] + (table.shape.half_extents or (0.0, 0.0, 0.0))[2]
    target = client.scene.free[0]
    weight_n = target.mass * norm(client.scene.gravity)
    hand = Senses(client, first)
    start, upright = hand.position, hand.quat_xyzw
    away = -array([*first.cameras["table"].position[:2], 0.0])
    aside = start + ASIDE_M * away / norm(away)
    tries, bounds = 0, None
    with contextlib.suppress(RunOverError):  # The shake is over.
        while tries < TRIES:
            hand.to(0.6, aside, upright, sigma=0.0)
            found = find_object(hand.look(), table_m)
            if found is None:
                break
            size_m = found.bounds.size
            grasps = grasps_for(size_m, target.mass)
            grasp, turn_rad = grasps[tries % len(grasps)]
            tries += 1
            bounds = bounds or replace(found.bounds, name=target.name)
            LOG.info(f"{grasp.name}: {np.round(size_m, 3)} m large at {np.round(found.bounds.middle, 3)} m")
            if attempt(hand, found, grasp, turn_rad, weight_n):
                hand.wait(10.0)
            hand.to(0.4, sigma=0.0)
            hand.to(0.6, hand.position + 0.1 * UP)
    return grasp_summary(hand, bounds or ObjectBounds(0, target.name, start, start, start), tries)


if __name__ == "__main__":
    play(run, __doc__)
