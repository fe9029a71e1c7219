"""The form of observations: fields, vectors of a policy and a critic, or vectors with a goal."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces

from palmares.arguments import Sensing
from palmares.gym.fields import LARGEST, Arrays
from palmares.gym.goals import Goal
from palmares.gym.hooks import observed
from palmares.gym.images import is_image
from palmares.gym.settings import Settings

# The field that `observe` makes.
OBSERVED = "observed"
# Fields that no sensor reads, beside the hand's channels of the truth.
TRUTH = ("joints", "objects", "object_kind", "object_half_extents", "object_mass", "hand_drawn")


class Form:
    """Makes observations of fields.

    Attributes:
        space: Of an observation.
        layout: Columns of each field in each vector.
        goal: The goal; ``None`` unless there are goals.

    """

    def __init__(self, settings: Settings) -> None:
        self._kind, goal, self._sensing = settings.observations, settings.goal, settings.sensing
        self.goal = Goal() if self._kind == "goal" and goal is None else goal
        self._observe = settings.observe
        self.layout: dict[str, dict[str, slice]] = {}

    @property
    def sensing(self) -> Sensing:
        """The sensing of the fields that it needs."""
        return self._sensing if self._kind == "fields" else "truth"

    def open(self, fields: spaces.Dict, hidden: Iterable[str]) -> None:
        """Learn the fields.

        Args:
            fields: Their spaces, for one environment.
            hidden: Names of the hand's channels that no sensor reads.

        Raises:
            ValueError: The goal's object is none of the task, or the number of objects is unknown.

        """
        if self._observe is not None:
            zeros = {name: np.zeros((1, *(space.shape or ()))) for name, space in fields.items()}
            length = observed(self._observe, zeros, 1).shape[1]
            images = {name: fields[name] for name in fields if is_image(name)}
            self.space = spaces.Dict(
                {OBSERVED: spaces.Box(-LARGEST, LARGEST, (length,), np.float32)} | images
            )
            return
        if self._kind == "fields":
            self.space = fields
            return
        if not isinstance(fields["objects"], spaces.Box):
            raise ValueError(f"objects: found None; observations={self._kind!r} needs their number")
        everything = [name for name in fields if not is_image(name)]
        sensed = [name for name in everything if name not in (*TRUTH, *hidden)]
        named = {"policy": sensed, "critic": everything}
        if self.goal is not None:
            objects = fields["objects"].shape[0]
            if self.goal.object >= objects:
                raise ValueError(f"goal: object: found {self.goal.object}; wanted 0 to {objects - 1}")
            named = {"observation": everything if self._sensing == "truth" else sensed}
        found: dict[str, spaces.Space[Any]] = {}
        for group, names in named.items():
            self.layout[group], length = {}, 0
            for name in names:
                end = length + math.prod(fields[name].shape or ())
                self.layout[group][name], length = slice(length, end), end
            found[group] = spaces.Box(-LARGEST, LARGEST, (length,), dtype=np.float32)
        if self.goal is not None:
            for name in ("achieved_goal", "desired_goal"):
                found[name] = spaces.Box(-LARGEST, LARGEST, (3,), dtype=np.float32)
        self.space = spaces.Dict(found | {name: fields[name] for name in fields if is_image(name)})

    def place(self, fields: Arrays) -> Any:
        """Return the position (…, 3) of the goal's object, m."""
        assert self.goal is not None
        return fields["objects"][..., self.goal.object, :3]

    def reward(self, achieved: Any, desired: Any, info: Any = None) -> Any:  # noqa: ARG002
        """Return the rewards of goals (…, 3), as learners ask for them."""
        assert self.goal is not None
        return self.goal.reward(achieved, desired)

    def never(self, *_: Any) -> bool:
        """Return False: no goal ends an episode."""
        return False

    def made(self, fields: Arrays, lead: Sequence[int], desired: Any = None) -> Arrays:
        """Return the observation of fields.

        Args:
            fields: Arrays (lead, …).
            lead: Their first axes: () or (num_envs,).
            desired: The goals (lead, 3).

        """
        if self._observe is not None:
            rows = fields if lead else {name: values[np.newaxis] for name, values in fields.items()}
            found = observed(self._observe, rows, lead[0] if lead else 1)
            images = {name: values for name, values in fields.items() if is_image(name)}
            return {OBSERVED: found if lead else found[0]} | images
        if self._kind == "fields":
            return fields
        made: Arrays = {}
        for group, names in self.layout.items():
            parts = [fields[name].reshape(*lead, -1) for name in names]
            made[group] = np.concatenate(parts, axis=-1).astype(np.float32)
        if self.goal is not None:
            made["achieved_goal"] = self.place(fields).astype(np.float32)
            made["desired_goal"] = np.asarray(desired, dtype=np.float32).copy()
        return made | {name: values for name, values in fields.items() if is_image(name)}
