"""The text of a task with the rules of the task `grasp`, and one object on one piece of furniture."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

TEXT = """\
{remark}
name = {name}
description = {description}
tick_s = 0.01
step_s = 0.001
time_limit_s = 120.0

[hand]
position = {position}
quat_xyzw = {quat}

[ground]
height = -0.74
friction = 0.5
color = [0.55, 0.57, 0.60]
center = [0.0, 0.0]
size = [3.0, 3.0]

[[furniture]]
name = {furniture}
friction = 0.5
color = [0.62, 0.50, 0.38]
parts = [{box}]

[[regions]]
name = "middle"
min = [-0.4, -0.4, 0.0]
max = [0.4, 0.4, 0.7]

[objects]
count = 1
from = [{object}]

{own}

{place}

[rules]
kind = "hold"
lift_m = 0.1
hold_s = 2.0
slip_m = 0.03
slow_s = 30.0
shake = {{ amplitude_m = 0.02, frequency_hz = 3.5, axis_s = 1.0 }}
points = {{ lifted = 1.0, held = 3.0, shaken = 3.0, firm = 2.0, quick = 1.0 }}
"""
TABLE = ("table", (0.6, 0.6, 0.02))
"""Name and half extents of the furniture of the task `grasp`, m; its top is at the height 0"""


def grasp_task(
    name: str,
    description: str,
    object_name: str,
    own: str,
    place: str,
    position: Iterable[float],
    quat: Iterable[float],
    furniture: tuple[str, tuple[float, float, float]] = TABLE,
    remark: str = "",
) -> str:
    """Return a ``task.toml``.

    Args:
        name: Of the task; its first 64 characters are taken.
        description: For people.
        object_name: Of the object.
        own: Its table ``[[objects.own]]``; empty for one of the catalogue.
        place: The tables of its place.
        position: Of the hand's base at the start, (3,), m.
        quat: Its quaternion x y z w, (4,).
        furniture: Name and half extents, m, of what the object is on.
        remark: First line, a comment.

    """
    kind, (x, y, z) = furniture
    return TEXT.format(
        remark=f"# {remark}" if remark else "",
        name=inline(name[:64]),
        description=inline(description),
        position=inline([float(it) for it in position]),
        quat=inline([float(it) for it in quat]),
        furniture=inline(kind),
        box=inline({"position": [0.0, 0.0, -z], "half_extents": [x, y, z]}),
        object=inline(object_name),
        own=own,
        place=place,
    ).lstrip()


def fixed(object_name: str, position: Iterable[float], quat: Iterable[float]) -> str:
    """Return the table that puts the object at a pose, m and x y z w."""
    place = {"object": object_name, "position": [float(it) for it in position]}
    place["quat_xyzw"] = [float(it) for it in quat]
    return "\n".join(["[[place.fixed]]", *(f"{key} = {inline(value)}" for key, value in place.items())])


def own_object(table: dict[str, Any]) -> str:
    """Return a table ``[[objects.own]]``."""
    return "\n".join(["[[objects.own]]", *(f"{key} = {inline(value)}" for key, value in table.items())])


def inline(value: Any) -> str:
    """Return a value as TOML in one line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {inline(it)}" for key, it in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(inline, value)) + "]"
    return json.dumps(value, ensure_ascii=False)
