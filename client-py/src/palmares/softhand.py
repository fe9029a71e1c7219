"""The SoftHand for planning: how much room it takes on its way to an object."""

from __future__ import annotations

import numpy as np

# The preshaped hand as capsules: two end points in the hand frame and a radius, all in m.
HAND_CAPSULES: list[tuple[tuple[float, float, float], tuple[float, float, float], float]] = [
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
]
CAPSULE_A = np.array([a for a, _, _ in HAND_CAPSULES])
CAPSULE_B = np.array([b for _, b, _ in HAND_CAPSULES])
CAPSULE_RADIUS = np.array([r for _, _, r in HAND_CAPSULES])
