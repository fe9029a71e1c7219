"""Move balls from box A to box B with the SoftHand by its sensors: a depth camera above box A and the wrist.

    python balls_sensors.py --seed 7 --runs 3           # needs `palmares serve`, or --url local

Grasp, rake and choice are those of `balls_softhand.py`, which uses the true positions. This controller uses
images:

    hand aside -> depth image -> spheres in it -> the ball with most room -> down -> close -> up
    -> does the wrist carry a ball's weight? -> over box B -> open -> next image
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

import palmares
from palmares.arrays import Array, array
from palmares.client import Client
from palmares.examples.balls_softhand import GRASP, RAKE, SCRIPT, SoftHand
from palmares.messages import Observation
from palmares.reproducible import cos, least_squares, mean, norm, norms, sin
from palmares.rotation import quat_of
from palmares.skills.balls import BallsSummary, play_balls
from palmares.skills.runs import play

LEAN = 0.156
"""Slope of the approach, horizontal per vertical distance"""
FEEL_S = 0.1
"""Duration of the mean over the wrist's noise"""
ASIDE = array([0.65, 0.0, 0.75])
"""Position of the base where the hand does not hide box A from the camera, m"""

# --- the depth image; its error is 1 to 6 mm ---
WALL_M, FLOOR_M = 0.008, 0.03
"""Points this near to a wall or the floor may belong to it"""
SHELL_M = (0.02, 0.012)
"""Points this near to a ball's surface belong to it, in the first and in the later steps of the fit"""
MIN_POINTS = 80
"""Fewest pixels of a ball, which has about 600, half hidden 300"""


def find_balls(points: Array, radius_m: float, box: palmares.Region) -> Array:
    """Return the centres (n, 3), m, of the balls in `box` among `points` (h, w, 3), m; NaN has no reading.

    The highest point outside all known balls is near the top of another one. From there a sphere of the known
    radius is fitted by Gauss–Newton, and its points are removed.
    """
    low, high = box.min + array([WALL_M, WALL_M, FLOOR_M]), box.max - array([WALL_M, WALL_M, 0.0])
    inside = np.all((points > low) & (points < high), axis=2)
    # Mean height over 5 x 5 pixels; the highest of many noisy points is too high.
    heights, counts = (
        around(image)[inside] for image in (np.where(inside, points[..., 2], 0.0), inside.astype(float))
    )
    cloud, height = points[inside], heights / counts
    left = np.ones(len(cloud), bool)
    balls = []
    while np.count_nonzero(left) >= MIN_POINTS:
        top = int(np.argmax(np.where(left, height, -np.inf)))
        left[top] = False
        centre = array([*cloud[top, :2], height[top] - radius_m])
        for step in range(12):
            offset = cloud - centre
            distance_m = norms(offset)
            # Only upper halves are visible: without this a sphere fits from above, too.
            near = (np.abs(distance_m - radius_m) < SHELL_M[step >= 6]) & (offset[:, 2] > 0.0)
            if np.count_nonzero(near & left) < MIN_POINTS:
                break
            towards = offset[near] / distance_m[near, None]
            centre = centre + least_squares(towards, distance_m[near] - radius_m)
        else:
            balls.append(centre)
        left &= norms(cloud - centre) > radius_m + SHELL_M[0]
    return array(balls, -1, 3)


def around(image: Array) -> Array:
    """Return the mean of the 5 x 5 pixels around every pixel of an image (h, w)."""
    padded = np.pad(image, 2)
    rows = mean([padded[k : k + len(image)] for k in range(5)])
    return mean([rows[:, k : k + image.shape[1]] for k in range(5)])


class Senses(SoftHand):
    """The SoftHand by its sensors."""

    sensing = "sensors"
    picks, tries = 40, math.inf
    how = replace(RAKE, travel_s=1.2, retreat_s=1.2, retreat_height_m=SCRIPT.lift_height_m, fall_s=0.0)

    def __init__(self, client: Client, first: Observation) -> None:
        super().__init__(client, first)
        self._weight_n = client.scene.free[0].mass * norm(client.scene.gravity)

    def ready(self) -> None:
        """Move the hand out of the image."""
        self.to(1.0, ASIDE, quat_of(GRASP.rotation(0.0)))

    @classmethod
    def way(cls, yaw_rad: float) -> Array:
        """Return the approach over 1 m of height, (3,), m."""
        return array([LEAN * cos(yaw_rad), LEAN * sin(yaw_rad), -1.0])

    def balls(self) -> tuple[Array, list[int]]:
        """Return the centres (n, 3) of the balls in the image, m, and all rows."""
        balls = find_balls(self.look(), self.radius_m, self.box_a)
        return balls, list(range(len(balls)))

    def look(self) -> Array:
        """Move the hand out of the way; return the points (h, w, 3), m, of the camera above box A."""
        self.to(0.0, array([max(self.position[0], ASIDE[0]), *self.position[1:]]))
        self.wait(0.2)  # An image may be 0.13 s old.
        self.keep(self.client.step(cameras=["box_a"]))
        return self.obs.cameras["box_a"].points()

    def feel_empty(self) -> None:
        """Feel the wrist without a ball."""
        self._empty = self.wrist_force(FEEL_S)

    def look_before_lift(self) -> None:
        """Feel nothing: the wrist carries no ball yet."""

    def has_ball(self) -> bool:
        """Return whether the wrist carries a ball's weight."""
        return norm(self.wrist_force(FEEL_S) - self._empty) > 0.5 * self._weight_n


def run(client: palmares.Client, seed: int | None) -> BallsSummary:
    """Play one run."""
    return play_balls(Senses, client, seed)


if __name__ == "__main__":
    play(run, __doc__)
