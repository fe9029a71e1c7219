"""Choices of objects to fetch from the shelf or to push in, without physics."""

from __future__ import annotations

import numpy as np
import pytest

import palmares
from palmares.skills import fetching, pushing
from palmares.skills.attempts import Attempt
from palmares.skills.objects import ObjectBounds

SHELF = palmares.Region(name="shelf", min=(-0.2, 0.4, 0.7), max=(0.2, 0.8, 1.0))


def standing(index: int, x: float, y: float, size: tuple[float, float, float]) -> ObjectBounds:
    half = np.array(size) / 2
    middle = np.array([x, y, SHELF.min[2] + half[2]])
    return ObjectBounds(index, f"object_{index}", middle - half, middle + half, middle)


CAN = (0.07, 0.07, 0.1)


def test_a_lone_can_in_the_middle_has_room() -> None:
    plan = fetching.choose([standing(0, 0.0, 0.5, CAN)], SHELF, [])
    assert plan is not None
    assert plan.room_m == 0.0
    # Palm down, the fingers into the shelf.
    assert plan.rotation[2, 0] < -0.8
    assert plan.rotation[1, 2] > 0.8


def test_objects_in_front_come_first() -> None:
    tall_in_front = [standing(0, 0.0, 0.7, CAN), standing(1, 0.0, 0.47, (0.07, 0.07, 0.2))]
    plan = fetching.choose(tall_in_front, SHELF, [])
    assert plan is not None
    assert plan.target.index == 1


def test_a_failure_changes_the_plan_and_some_give_up() -> None:
    alone = standing(0, 0.0, 0.5, CAN)
    tried: list[Attempt] = []
    for _ in range(fetching.TRIES):
        plan = fetching.choose([alone], SHELF, tried)
        assert plan is not None
        assert not tried or plan.grasp.name != tried[-1].grasp
        tried.append(Attempt(0, alone.middle, plan.yaw_rad, plan.grasp.name))
    assert fetching.choose([alone], SHELF, tried) is None
    moved = standing(0, 0.05, 0.5, CAN)
    assert fetching.choose([moved], SHELF, tried) is not None


def test_objects_outside_the_shelf_are_ignored() -> None:
    assert fetching.choose([standing(0, 0.0, 0.3, CAN)], SHELF, []) is None


def test_an_object_at_the_opening_is_pushed_in_once() -> None:
    can = standing(0, 0.0, 0.45, CAN)
    plan = pushing.choose([can], SHELF, [], frozenset())
    assert plan is not None
    assert can.middle[1] + plan.way_m == pytest.approx(SHELF.min[1] + pushing.IN_M)
    assert plan.before[1] + pushing.REACH_M < can.low[1]
    tried = [Attempt(0, can.middle, 0.0, "push")]
    assert pushing.choose([can], SHELF, tried, frozenset()) is None
    assert pushing.choose([standing(0, 0.0, 0.6, CAN)], SHELF, [], frozenset()) is None


def test_no_rolling_object_is_pushed_and_none_into_the_rear_wall() -> None:
    can, behind = standing(0, 0.0, 0.45, CAN), standing(1, 0.0, 0.53, CAN)
    assert pushing.choose([can], SHELF, [], frozenset({0})) is None
    assert pushing.choose([can, behind], SHELF, [], frozenset({1})) is None
    assert pushing.choose([can, behind], SHELF, [], frozenset()) is not None
    # There is a centimetre between the can, the object behind it and the rear wall.
    long = standing(1, 0.0, 0.637, (0.07, 0.3, 0.1))
    assert pushing.choose([can, long], SHELF, [], frozenset()) is None
