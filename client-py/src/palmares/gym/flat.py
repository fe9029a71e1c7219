"""Actions in [−1, 1], as most learners want them."""

from __future__ import annotations

from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces

from palmares import own_task
from palmares.arguments import table
from palmares.arrays import Array, array
from palmares.clipping import Clipping
from palmares.gym.env import PalmaresEnv
from palmares.gym.fields import Arrays

# Objects in every scene of the tasks that come with the program.
OBJECTS = {"balls": 10, "shelf": 10, "grasp": 1, "pan": 2, "peg": 2}


class FlatEnv(gymnasium.Env[Arrays, Array]):
    """A `PalmaresEnv` with actions (6 + motors,) in [−1, 1]; the ids of gymnasium make it.

    The first six are the base's velocity as parts of its limits, world frame; the others are the motors, −1
    open and 1 closed. The arguments are those of `PalmaresEnv`. Without `url` it plays in this process.
    `objects` is set for the tasks of the program and for your own by their folder.

    Attributes:
        inner: The `PalmaresEnv`, whose actions are a dictionary in SI units.

    """

    metadata = PalmaresEnv.metadata

    def __init__(self, task: str, hand: str, *, url: str | None = None, **options: Any) -> None:
        options.setdefault("objects", _objects(task))
        self.inner = PalmaresEnv(url, task=task, hand=hand, **options)
        self.render_mode, self.metadata = self.inner.render_mode, self.inner.metadata
        actions = cast(spaces.Dict, self.inner.action_space)
        twist, sigma = cast(spaces.Box, actions["twist"]), cast(spaces.Box, actions["hand"])
        self._clipping = Clipping()
        self._limits: Array = array(twist.high)
        self.action_space = spaces.Box(-1.0, 1.0, (6 + sigma.shape[0],), dtype=np.float64)
        self.observation_space = self.inner.observation_space

    @property
    def fraction(self) -> float:
        """As `PalmaresEnv.fraction`."""
        return self.inner.fraction

    @fraction.setter
    def fraction(self, fraction: float) -> None:
        self.inner.fraction = fraction

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Arrays, dict[str, Any]]:
        """Open a run."""
        super().reset(seed=seed, options=options)
        if seed is None:
            seed = int(self.np_random.integers(2**53))
        return self.inner.reset(seed=seed, options=options)

    def step(self, action: Array) -> tuple[Arrays, float, bool, bool, dict[str, Any]]:
        """Advance the world under one action."""
        action = table("action", action, *cast(tuple[int], self.action_space.shape))
        self._clipping.check_unit(action, stacklevel=2)
        twist, hand = action[:6] * self._limits, 0.5 * (action[6:] + 1.0)
        return self.inner.step({"twist": twist, "hand": hand})

    def render(self) -> Any:
        """As `PalmaresEnv.render`."""
        return self.inner.render()

    def close(self) -> None:
        """End the session."""
        self.inner.close()


def _objects(task: str) -> int | None:
    """Return the number of objects in a task's scenes; ``None`` for a task that only a server knows."""
    own: dict[str, Any] = {} if task in OBJECTS else own_task.read(task).get("objects", {})
    return OBJECTS.get(task, own.get("count"))
