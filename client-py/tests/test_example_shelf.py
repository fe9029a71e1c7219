"""The shelf example, as far as it can be tested without physics."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import palmares
from palmares.motion import ObjectBounds

SHELF = palmares.Region(name="shelf", min=(-0.2, 0.4, 0.7), max=(0.2, 0.8, 1.0))


@pytest.fixture(scope="module")
def shelf() -> ModuleType:
    folder = str(Path(__file__).parent.parent / "src/palmares/examples")
    sys.path.insert(0, folder)
    try:
        return importlib.import_module("shelf_softhand")
    finally:
        sys.path.remove(folder)


def standing(index: int, x: float, y: float, size: tuple[float, float, float]) -> ObjectBounds:
    half = np.array(size) / 2
    middle = np.array([x, y, SHELF.min[2] + half[2]])
    return ObjectBounds(index, f"object_{index}", middle - half, middle + half, middle)


CAN = (0.07, 0.07, 0.1)


def test_a_lone_can_in_the_middle_has_room(shelf: ModuleType) -> None:
    plan = shelf.choose([standing(0, 0.0, 0.5, CAN)], SHELF, [])
    assert plan is not None
    assert plan.room_m == 0.0
    # Palm down, the fingers into the shelf.
    assert plan.rotation[2, 0] < -0.8
    assert plan.rotation[1, 2] > 0.8


def test_what_stands_in_front_is_taken_first(shelf: ModuleType) -> None:
    tall_in_front = [standing(0, 0.0, 0.7, CAN), standing(1, 0.0, 0.47, (0.07, 0.07, 0.2))]
    plan = shelf.choose(tall_in_front, SHELF, [])
    assert plan is not None
    assert plan.target.index == 1


def test_a_failure_changes_the_plan_and_some_give_up(shelf: ModuleType) -> None:
    alone = standing(0, 0.0, 0.5, CAN)
    tried: list[Any] = []
    for _ in range(shelf.TRIES):
        plan = shelf.choose([alone], SHELF, tried)
        assert plan is not None
        assert not tried or plan.grasp.name != tried[-1].grasp
        tried.append(shelf.Attempt(0, alone.middle, plan.yaw_rad, plan.grasp.name))
    assert shelf.choose([alone], SHELF, tried) is None
    moved = standing(0, 0.05, 0.5, CAN)
    assert shelf.choose([moved], SHELF, tried) is not None


def test_what_is_out_of_the_shelf_is_left_alone(shelf: ModuleType) -> None:
    assert shelf.choose([standing(0, 0.0, 0.3, CAN)], SHELF, []) is None
