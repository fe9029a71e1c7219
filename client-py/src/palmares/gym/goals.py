"""Goals of episodes, for learners that relabel them: hindsight experience replay."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from palmares.arguments import is_real, one_of, short, whole
from palmares.arrays import Array
from palmares.reproducible import norms

Three = tuple[float, float, float]
# The draws of goals are independent of all others of a seed.
_STREAM = 0x676F616C


@dataclass(frozen=True)
class Goal:
    """Where an object's centre is wanted: the goal of an environment with ``observations="goal"``.

    The seed of the scene draws it evenly between `low` and `high`. Without arguments the object is wanted
    10 cm above its first place, as the task ``grasp`` has it.

    >>> Goal(low=(-0.1, -0.1, 0.1), high=(0.1, 0.1, 0.3)).drawn(7, np.zeros(3)).round(2)
    array([-0.05, -0.05,  0.24])

    Args:
        low: Least x, y, z, m.
        high: Largest x, y, z, m.
        origin: ``object``: from the object's place at the reset; ``world``: from the origin of the world.
        object: Index of the object.
        tolerance_m: Largest distance of a success.

    Raises:
        ValueError: An argument is out of range.

    """

    low: Three = (0.0, 0.0, 0.1)
    high: Three = (0.0, 0.0, 0.1)
    origin: Literal["object", "world"] = "object"
    object: int = 0
    tolerance_m: float = 0.05

    def __post_init__(self) -> None:
        for name, corner in (("low", self.low), ("high", self.high)):
            if len(corner) != 3 or not all(map(is_real, corner)):
                raise ValueError(f"{name}: found {short(corner)}; wanted three finite numbers")
        if any(low > high for low, high in zip(self.low, self.high, strict=True)):
            raise ValueError(f"low: found {short(self.low)}; wanted at most high, {short(self.high)}")
        one_of("origin", self.origin, ("object", "world"))
        whole("object", self.object, 0, 1_000)
        if not (is_real(self.tolerance_m) and self.tolerance_m > 0.0):
            raise ValueError(f"tolerance_m: found {short(self.tolerance_m)}; wanted more than 0")

    def drawn(self, seed: int, position: Array) -> Array:
        """Return the goal (3,) of the scene of a seed, m.

        Args:
            seed: The scene.
            position: (3,), m, the object's place at the reset.

        """
        goal = np.random.default_rng([int(seed), _STREAM]).uniform(self.low, self.high)
        return goal + position if self.origin == "object" else goal

    def reward(self, achieved: Any, desired: Any) -> Any:
        """Return 0 where a goal is reached, and −1 elsewhere.

        Args:
            achieved: (…, 3), m.
            desired: (…, 3), m.

        Returns:
            (…,) of float32; a float for single goals.

        """
        distance = norms(np.asarray(achieved) - np.asarray(desired))
        rewards = np.where(distance <= self.tolerance_m, 0.0, -1.0).astype(np.float32)
        return rewards if rewards.ndim else float(rewards)
