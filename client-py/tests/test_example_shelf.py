"""The shelf example: what can be checked of it without physics."""

from __future__ import annotations

import importlib
import math
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import palmares
from palmares.bounds import half_extents
from palmares.rotation import Array, rot_y, rot_z

SHELF = palmares.Region(name="shelf", min=(-0.2, 0.4, 0.7), max=(0.2, 0.8, 1.0))


@pytest.fixture(scope="module")
def shelf() -> ModuleType:
    folder = str(Path(__file__).parent.parent / "examples")
    sys.path.insert(0, folder)
    try:
        return importlib.import_module("shelf_softhand")
    finally:
        sys.path.remove(folder)


def thing(shelf: ModuleType, index: int, x: float, y: float, size: tuple[float, float, float]) -> Any:
    half = np.array(size) / 2
    middle = np.array([x, y, SHELF.min[2] + half[2]])
    return shelf.Thing(index, f"thing_{index}", middle - half, middle + half, middle)


CAN = (0.07, 0.07, 0.1)


def test_extents_are_those_of_the_shapes_corners() -> None:
    turned = rot_z(0.4) @ rot_y(0.9)
    half = (0.03, 0.05, 0.08)
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    box = palmares.Shape(type="box", half_extents=half)
    assert np.allclose(half_extents(box, turned), np.abs(corners @ turned.T).max(axis=0))

    angles = np.linspace(0.0, 2 * math.pi, 721)
    rim = np.stack([0.04 * np.cos(angles), 0.04 * np.sin(angles), np.full_like(angles, 0.06)], axis=1)
    cylinder = palmares.Shape(type="cylinder", radius=0.04, half_length=0.06)
    points: Array = np.concatenate([rim, rim * (1, 1, -1)])
    assert np.allclose(half_extents(cylinder, turned), (points @ turned.T).max(axis=0), atol=1e-5)

    ball = palmares.Shape(type="sphere", radius=0.03)
    assert np.allclose(half_extents(ball, turned), 0.03)


def test_a_lone_can_in_the_middle_has_room(shelf: ModuleType) -> None:
    plan = shelf.choose([thing(shelf, 0, 0.0, 0.5, CAN)], SHELF, [])
    assert plan is not None
    assert plan.room == 0.0
    # Palm down, the fingers into the shelf.
    assert plan.rotation[2, 0] < -0.8
    assert plan.rotation[1, 2] > 0.8


def test_what_stands_in_front_is_taken_first(shelf: ModuleType) -> None:
    tall_in_front = [thing(shelf, 0, 0.0, 0.7, CAN), thing(shelf, 1, 0.0, 0.47, (0.07, 0.07, 0.2))]
    plan = shelf.choose(tall_in_front, SHELF, [])
    assert plan is not None
    assert plan.thing.index == 1


def test_a_failure_changes_the_plan_and_some_give_up(shelf: ModuleType) -> None:
    alone = thing(shelf, 0, 0.0, 0.5, CAN)
    tried: list[Any] = []
    for _ in range(shelf.TRIES):
        plan = shelf.choose([alone], SHELF, tried)
        assert plan is not None
        assert not tried or plan.grasp.name != tried[-1].grasp
        tried.append(shelf.Attempt(0, plan.grasp.name, plan.yaw, alone.middle))
    assert shelf.choose([alone], SHELF, tried) is None
    moved = thing(shelf, 0, 0.05, 0.5, CAN)
    assert shelf.choose([moved], SHELF, tried) is not None


def test_what_is_out_of_the_shelf_is_left_alone(shelf: ModuleType) -> None:
    assert shelf.choose([thing(shelf, 0, 0.0, 0.3, CAN)], SHELF, []) is None
