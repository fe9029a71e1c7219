"""Places of the hand for raking, and a few pulls in the physics."""

from __future__ import annotations

import numpy as np
import pytest

import palmares
from palmares.arrays import array
from palmares.examples import shelf_reflex, shelf_softhand
from palmares.skills import clearing, raking
from palmares.skills.attempts import Attempt
from palmares.skills.motion import ACCELERATION, BaseLimits, Mover, fling
from palmares.skills.objects import ObjectBounds

SHELF = palmares.Region(name="shelf", min=(-0.2, 0.4, 0.7), max=(0.2, 0.8, 1.0))
CAN = (0.07, 0.07, 0.1)
HANDS = pytest.mark.parametrize("shape", [clearing.RAKE, shelf_reflex.RAKE], ids=["softhand", "reflex"])


def standing(index: int, x: float, y: float, size: tuple[float, float, float] = CAN) -> ObjectBounds:
    half = np.array(size) / 2
    middle = np.array([x, y, SHELF.min[2] + half[2]])
    return ObjectBounds(index, f"object_{index}", middle - half, middle + half, middle)


@HANDS
def test_the_fingers_come_down_behind_a_lone_can(shape: raking.RakeShape) -> None:
    can = standing(0, 0.0, 0.5)
    plan = raking.choose([can], SHELF, shape, [])
    assert plan is not None
    assert plan.kind == "rake"
    fingers = shape.hook.reshape(-1, 3) @ plan.rotation.T + plan.at
    assert fingers[:, 1].min() > can.high[1]
    assert fingers[:, 1].max() < SHELF.max[1]
    assert SHELF.min[2] < fingers[:, 2].min() < can.high[2] - shape.bite_m
    palm = shape.body.reshape(-1, 3) @ plan.rotation.T + plan.at
    assert palm[:, 2].max() < SHELF.max[2]


@HANDS
def test_nothing_fits_behind_a_tin_at_the_rear_wall(shape: raking.RakeShape) -> None:
    plan = raking.choose([standing(0, 0.0, 0.76, (0.07, 0.07, 0.05))], SHELF, shape, [])
    if "drag" in shape.kinds:
        assert plan is not None
        assert plan.kind == "drag"
    else:
        assert plan is None


@HANDS
def test_after_failures_other_ways_are_tried_and_then_none(shape: raking.RakeShape) -> None:
    can = standing(0, 0.0, 0.55)
    tried: list[Attempt] = []
    for _ in range(4):
        plan = raking.choose([can], SHELF, shape, tried, tries=4)
        assert plan is not None
        again = (plan.kind, plan.yaw_rad) in [(attempt.grasp, attempt.yaw_rad) for attempt in tried]
        assert shape is clearing.RAKE or not again or len(tried) >= 3
        tried.append(Attempt(0, can.middle, plan.yaw_rad, plan.kind))
    # With a high cost of turning, the hand first repeats the straight pull.
    assert len({(attempt.grasp, attempt.yaw_rad) for attempt in tried}) >= 2
    assert raking.choose([can], SHELF, shape, tried, tries=4) is None
    assert raking.choose([standing(0, 0.05, 0.55)], SHELF, shape, tried, tries=4) is not None


@HANDS
def test_a_ball_is_not_touched_in_passing(shape: raking.RakeShape) -> None:
    target, ball = standing(0, 0.0, 0.6), standing(1, 0.06, 0.45, (0.07, 0.07, 0.07))
    alone = raking.choose([target], SHELF, shape, [])
    # After all its attempts the ball is no candidate.
    tried = [Attempt(1, ball.middle, 0.0, "rake")] * 8
    beside = raking.choose([target, ball], SHELF, shape, tried, rolls=frozenset({1}))
    assert alone is not None
    assert beside is not None
    assert beside.score < alone.score


def test_a_fling_keeps_to_the_limits_of_the_base() -> None:
    with palmares.Client("local") as client:
        mover = Mover(client, client.reset("shelf", "softhand", seed=1))
        limits, start = BaseLimits.of(client.welcome.specs), mover.position
        end = start + array([0.0, -0.4, 0.0])
        ticks = client.tick or 0
        fling(mover, end, speed_m_s=1.0)
        took_s = ((client.tick or 0) - ticks) * client.run.tick_s
        assert np.linalg.norm(mover.obs.hand.base.xyz - end) < 2e-3
        # Speeding up to 1 m/s and braking takes 0.26 s each; all of it at most at 1 m/s.
        assert took_s == pytest.approx(0.4 + 1.0 / ACCELERATION, abs=0.02)
        assert limits.acceleration_m_s2 > ACCELERATION


@pytest.mark.parametrize("example", [shelf_softhand, shelf_reflex], ids=["softhand", "reflex"])
def test_a_few_pulls_bring_objects_into_the_box(example: object) -> None:
    with palmares.Client("local") as client:
        summary = example.run(client, 3, picks=6)  # type: ignore[attr-defined]
        assert client.result is not None
        assert summary.in_box == client.result.in_goal
        assert summary.in_box >= 4
