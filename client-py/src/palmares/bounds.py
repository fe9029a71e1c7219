"""Where the free objects of a scene are, as boxes along the world's axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palmares.messages import Observation
from palmares.rotation import Array, matrix_of
from palmares.scene import Scene, Shape


@dataclass(frozen=True)
class Thing:
    """A free object as it stands now: bounds in the world frame and centre of mass, m."""

    index: int
    name: str
    low: Array
    high: Array
    com: Array

    @property
    def middle(self) -> Array:
        """Middle of the bounds, m."""
        middle: Array = (self.low + self.high) / 2
        return middle


def half_extents(shape: Shape, rotation: Array) -> Array:
    """Half the extents along the world's axes of a shape turned by `rotation`, (3,), m."""
    radius = shape.radius or 0.0
    if shape.type == "box" and shape.half_extents is not None:
        extents: Array = np.abs(rotation) @ np.array(shape.half_extents)
        return extents
    axis = np.abs(rotation[:, 2]) * (shape.half_length or 0.0)
    round_part = np.sqrt(np.clip(1.0 - rotation[:, 2] ** 2, 0.0, 1.0)) if shape.type == "cylinder" else 1.0
    sum_: Array = axis + radius * round_part
    return sum_


def look(scene: Scene, obs: Observation) -> list[Thing]:
    """Return every free object where it is now."""
    if obs.truth is None:
        raise ValueError('where objects are is known with sensing="truth" only')
    things = []
    for body, state in zip([b for b in scene.bodies if b.free], obs.truth.objects, strict=True):
        rotation, origin = state.rotation, state.xyz
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for part in body.parts:
            middle = origin + rotation @ np.array(part.position)
            half = half_extents(part.shape, rotation @ matrix_of(part.quat_xyzw))
            low, high = np.minimum(low, middle - half), np.maximum(high, middle + half)
        com = origin + rotation @ np.array(body.com)
        things.append(Thing(state.id, state.name, low, high, com))
    return things
