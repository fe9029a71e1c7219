"""Recipes: where and how each built-in hand grasps an object from above.

The numbers come from the hand's README. `palmares.examples.grasp` plays them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palmares.arrays import Array, array
from palmares.reproducible import cos, matmul, sin
from palmares.skills.objects import ObjectBounds

__all__ = ["RECIPES", "Recipe"]


@dataclass(frozen=True)
class Recipe:
    """A grasp from above, in the frame of the hand's base."""

    approach: tuple[float, float, float]
    """Unit vector that points down at the grasp"""
    across: tuple[float, float, float]
    """Unit vector along which the fingers close: over the shorter side of the object"""
    centre_m: tuple[float, float, float]
    """Point over the middle of the object; its part along `approach` has no effect"""
    palm_m: float
    """Distance along `approach` from the base to the top of a tall object"""
    reach_m: float
    """Distance along `approach` from the base to the table, under a low object"""
    opened: tuple[float, ...]
    """σ of every motor on the way to the object"""
    closed: tuple[float, ...]
    """σ of every motor in the grasp"""
    close_s: float = 0.6
    """Duration of the closing"""

    def rotation(self, yaw_rad: float) -> Array:
        """Return world-from-hand (3, 3): `approach` down, `across` at `yaw_rad` from the world's y."""
        down, across = array(self.approach), array(self.across)
        c, s = cos(yaw_rad), sin(yaw_rad)
        world = np.column_stack([[-s, c, 0.0], [0.0, 0.0, -1.0], [-c, -s, 0.0]])
        return matmul(world, np.column_stack([across, down, np.cross(across, down)]).T)

    def base_position(self, target: ObjectBounds, rotation: Array) -> Array:
        """Return the position of the base for a grasp of `target`, (3,), m."""
        aside = matmul(rotation, self.centre_m)
        height_m = max(target.high[2] + self.palm_m, target.low[2] + self.reach_m)
        return array([target.middle[0] - aside[0], target.middle[1] - aside[1], height_m])

    def moved(
        self, tilt_rad: float = 0.0, up_m: float = 0.0, across_m: float = 0.0, aside_m: float = 0.0
    ) -> Recipe:
        """Return the recipe for another object: the hand is tilted, higher, or elsewhere over it.

        Args:
            tilt_rad: Turns `approach` towards `across`.
            up_m: Raises the base.
            across_m: Moves `centre_m` along `across`.
            aside_m: Moves it along `across` × `approach`.

        """
        down, across = array(self.approach), array(self.across)
        aside = np.cross(across, down)
        cosine, sine = cos(tilt_rad), sin(tilt_rad)
        return replace(
            self,
            approach=tuple((cosine * down + sine * across).tolist()),
            across=tuple((cosine * across - sine * down).tolist()),
            centre_m=tuple((array(self.centre_m) + across_m * across + aside_m * aside).tolist()),
            palm_m=self.palm_m + up_m,
            reach_m=self.reach_m + up_m,
        )

    def motors(self, closed: float) -> list[float]:
        """Return σ of every motor, from the opened hand (0) to the closed one (1)."""
        return [a + closed * (b - a) for a, b in zip(self.opened, self.closed, strict=True)]


RECIPES = {
    "reflex": Recipe(
        (0, 0, 1), (1, 0, 0), (0.01, 0, 0), 0.084, 0.19, (0.35, 0.35, 0.35, 0.3), (1, 1, 1, 0.3)
    ),
    "pinch": Recipe((0, 0, 1), (0, 1, 0), (0, 0, 0), 0.06, 0.15, (0.0, 0.0), (1, 0.4)),
    "yale_t42": Recipe((0, 0, 1), (0, 1, 0), (0, 0, 0), 0.1, 0.208, (0.1, 0.1), (1.0, 1.0)),
    "yale_model_o": Recipe(
        (0, 0, 1), (1, 0, 0), (0.0, 0, 0), 0.1, 0.205, (0.25, 0.25, 0.25, 0.3), (1, 1, 1, 0.3)
    ),
    "allegro": Recipe(
        (1, 0, 0),
        (0, 0, 1),
        (0, 0.0, 0.065),
        0.016,
        0.137,
        (0.5, 0.72, 0.2, 0.23) * 3 + (1.0, 0.083, 0.1, 0.14),
        (0.5, 1.0, 0.55, 0.6) * 3 + (1.0, 0.083, 0.7, 0.6),
    ),
    "leap": Recipe(
        (1, 0, 0),
        (0, 0, 1),
        (0, 0.01, 0.055),
        0.037,
        0.162,
        (0.45, 0.5, 0.28, 0.2) * 3 + (0.785, 0.161, 0.35, 0.35),
        (0.75, 0.5, 0.55, 0.5) * 3 + (0.785, 0.161, 0.75, 0.75),
    ),
    "inspire_rh56": Recipe(
        (0.766, 0, 0.643),
        (-0.643, 0, 0.766),
        (0.085, 0.012, 0.16),
        0.105,
        0.16,
        (0.3, 0.3, 0.3, 0.3, 1.0, 0.0),
        (1, 1, 1, 1, 1, 1),
    ),
    "rbo2": Recipe(
        (0.977, 0, 0.213),
        (-0.213, 0, 0.977),
        (-0.004, 0.013, 0.1),
        0.026,
        0.105,
        (0.17, 0.17, 0.22, 0.27, 0, 0.9, 0.37),
        (1, 1, 1, 1, 1, 0.82, 0.77),
        0.7,
    ),
    "ihy": Recipe(
        (0, 0, 1), (1, 0, 0), (0.01, 0, 0), 0.085, 0.195, (0.2, 0.2, 0.2, 0.0, 0.3), (1, 1, 1, 0.0, 0.3)
    ),
    "softhand2": Recipe(
        (0.9, 0, 0.436), (-0.436, 0, 0.9), (0.05, 0.02, 0.19), 0.06, 0.15, (0.02, 0.02), (0.95, 0.95)
    ),
    "robotiq_3f": Recipe((0, 0, 1), (1, 0, 0), (0, 0, 0), 0.085, 0.235, (0.1, 0.1, 0.1, 0.5), (1, 1, 1, 0.5)),
    "robotiq_2f85": Recipe((0, 0, 1), (0, 1, 0), (0, 0, 0), 0.105, 0.168, (0.0,), (1.0,)),
    "barrett_bh282": Recipe(
        (0, 0, 1),
        (-1, 0, 0),
        (0.005, -0.009, 0.01),
        0.09,
        0.21,
        (0.26, 0.36, 0.22, 0.0),
        (0.88, 0.91, 0.99, 0.12),
        1.25,
    ),
    "shadow": Recipe(
        (0.9397, 0, 0.342),
        (-0.342, 0, 0.9397),
        (0.085, 0.01, 0.17),
        0.09,
        0.148,
        (0.75, 0.588, *(0.5, 0.5, 0.1) * 3, 0.0, 0.5, 0.5, 0.1, 0.65, 1.0, 0.5, 0.5, 0.15),
        (0.75, 0.588, *(0.5, 0.95, 0.6) * 3, 0.3, 0.5, 0.95, 0.6, 0.65, 1.0, 0.5, 0.95, 0.8),
    ),
}
"""By the name of the hand"""
