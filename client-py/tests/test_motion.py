"""Parts of controllers, without physics."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import dataclass

import msgspec
import numpy as np
import pytest

import palmares
from palmares.arrays import Array, array
from palmares.rotation import angle_between, quat_of, rot_y, rot_z, rot_zyz
from palmares.skills.attempts import Attempt, attempts_here
from palmares.skills.grasps import SOFTHAND_PRESHAPED, Capsules, TopGrasp
from palmares.skills.motion import BaseLimits, Mover, RunOverError, duration, smoothstep
from palmares.skills.objects import (
    ObjectBounds,
    half_extents,
    largest_radius,
    object_bounds,
    truth_of,
    upright_box,
)
from palmares.skills.runs import Summary, play
from tests.fake_server import BALLS, GREETING, FakeServer

LIMITS = BaseLimits.of(msgspec.convert(GREETING["specs"], palmares.Specs))


def test_the_speeds_are_those_of_the_server() -> None:
    assert (LIMITS.speed_m_s, LIMITS.angular_speed_rad_s) == (1.5, 2.5)


def test_a_smoothstep_starts_and_ends_at_rest() -> None:
    assert (smoothstep(-1.0), smoothstep(0.0), smoothstep(0.5), smoothstep(1.0)) == (0.0, 0.0, 0.5, 1.0)
    x = np.linspace(0.0, 1.0, 1001)
    velocity = np.gradient([smoothstep(float(v)) for v in x], x)
    assert velocity[[0, -1]] == pytest.approx([0.0, 0.0], abs=1e-4)
    assert velocity.min() >= 0.0


@pytest.mark.parametrize(
    ("distance_m", "angle_rad"), [(0.05, 0.0), (1.0, 0.0), (0.0, 0.1), (0.0, 3.0), (2.0, 3.0)]
)
def test_a_duration_uses_the_limits_and_not_more(distance_m: float, angle_rad: float) -> None:
    total_s = duration(distance_m, angle_rad, LIMITS)
    t = np.linspace(0.0, total_s, 2001)
    way = np.array([smoothstep(float(v)) for v in t / total_s])
    velocity = np.gradient(way, t)
    acceleration = np.gradient(velocity, t)
    used = [
        distance_m * velocity.max() / LIMITS.speed_m_s,
        distance_m * acceleration.max() / LIMITS.acceleration_m_s2,
        angle_rad * velocity.max() / LIMITS.angular_speed_rad_s,
        angle_rad * acceleration.max() / LIMITS.angular_acceleration_rad_s2,
    ]
    assert max(used) == pytest.approx(0.95, abs=1e-3)
    assert duration(distance_m, angle_rad, LIMITS, at_least_s=60.0) == 60.0


def test_a_mover_reaches_its_target_and_holds_the_rest() -> None:
    with FakeServer() as server, palmares.Client(server.url) as client:
        mover = Mover(client, client.reset("balls", "softhand"))
        quat = quat_of(rot_y(1.0))
        mover.to(0.2, array([0.0, 0.0, 0.81]), quat, sigma=0.4)
        assert mover.obs.tick * client.run.tick_s >= 0.2
        assert mover.obs.hand.base.xyz == pytest.approx([0.0, 0.0, 0.81])
        assert angle_between(mover.obs.hand.base.quat_xyzw, quat) == pytest.approx(0.0, abs=1e-6)
        before = mover.obs.tick
        mover.wait(0.05)
        assert mover.obs.tick == before + 5
        assert mover.obs.hand.actuators[0].command == pytest.approx(0.4)
        result, summary = mover.stop()
    assert (summary.run_id, summary.seed) == (result.run_id, 77)


def test_a_mover_raises_when_the_run_ends() -> None:
    with FakeServer() as server, palmares.Client(server.url) as client:
        mover = Mover(client, client.reset("balls", "softhand"))
        server.replies.append({**server._obs(), "tick": 1, "truncated": True, "reason": "time_limit"})
        with pytest.raises(RunOverError, match="time_limit"):
            mover.wait(1.0)
        assert mover.obs.tick == 1


def test_where_objects_are_is_unknown_with_sensors_only() -> None:
    with FakeServer() as server, palmares.Client(server.url) as client:
        obs = client.reset("balls", "softhand")
        assert truth_of(obs).positions.tolist() == BALLS
        obs._truth = None
        with pytest.raises(ValueError, match="sensing"):
            truth_of(obs)


def test_bounds_of_the_balls() -> None:
    with FakeServer() as server, palmares.Client(server.url) as client:
        obs = client.reset("balls", "softhand")
        found = object_bounds(client.scene, obs)
        assert largest_radius(client.scene) == 0.05
    assert [(ball.index, ball.name) for ball in found] == [(0, "ball_0"), (1, "ball_1"), (2, "ball_2")]
    for ball, centre in zip(found, BALLS, strict=True):
        assert ball.com == pytest.approx(centre)
        assert ball.middle == pytest.approx(centre)
        assert ball.high - ball.low == pytest.approx([0.1, 0.1, 0.1])


def test_the_upright_box_is_turned_along_the_longer_side() -> None:
    with palmares.Client("local") as client:
        obs = client.reset("grasp", "softhand", seed=102)
        box, yaw_rad = upright_box(client.scene, obs, 0)
        assert box.name == "061_foam_brick"
        longer_side = truth_of(obs).objects[0].rotation[:, 1]
    # Directions are tried in steps of 3 degrees, which makes the box a little larger.
    assert box.size == pytest.approx([0.075, 0.05, 0.05], abs=0.0025)
    assert box.middle == pytest.approx(truth_of(obs).positions[0], abs=1e-6)
    along = float(longer_side @ [math.cos(yaw_rad), math.sin(yaw_rad), 0.0])
    assert abs(along) > math.cos(math.radians(1.6))


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


def test_distances_of_points_from_a_capsule() -> None:
    # From (0, 0, 0) to (0, 0, 1), turned into the direction x and moved to z = 2.
    upright = Capsules(array([[0, 0, 0]]), array([[0, 0, 1]]), array([0.1]))
    lying = upright.at(rot_y(math.pi / 2), array([0, 0, 2]))
    points = array([[0.5, 0.0, 2.0], [0.5, 0.3, 2.0], [1.3, 0.0, 2.4], [-1.0, 0.0, 2.0]])
    assert lying.distances(points) == pytest.approx(array([[-0.1, 0.2, 0.4, 0.9]]))
    assert lying.distances(np.zeros((0, 3))).shape == (1, 0)


def test_spheres_and_bounds_of_the_softhand() -> None:
    hand = SOFTHAND_PRESHAPED.at(rot_zyz(0.3, 2.0, -0.4), array([0.1, 0.2, 0.9]))
    count = len(hand.radius)
    centres, radii = hand.spheres(5)
    assert (centres.shape, radii.shape) == ((5 * count, 3), (5 * count,))
    # The centres are on the axes of their capsules.
    own = hand.distances(centres)[np.tile(np.arange(count), 5), np.arange(5 * count)]
    assert own == pytest.approx(-radii)
    low, high = hand.bounds()
    assert low.min(axis=0) == pytest.approx((centres - radii[:, None]).min(axis=0))
    assert high.max(axis=0) == pytest.approx((centres + radii[:, None]).max(axis=0))


def test_a_grasp_puts_the_object_where_it_should_be_in_the_hand() -> None:
    grasp = TopGrasp("flat", 1.6, 0.3, 0.01, 0.02, 0.19, 0.0, 0.9, 0.02)
    target = ObjectBounds(0, "can", array([0.0, 0.0, 0.7]), array([0.1, 0.1, 0.8]), array([0.05, 0.05, 0.75]))
    rotation = grasp.rotation(0.2)
    assert rotation == pytest.approx(rot_z(math.pi / 2 + 0.2) @ rot_y(1.6) @ rot_z(0.3))
    in_hand = rotation.T @ (target.middle - grasp.base_position(target, rotation))
    assert in_hand == pytest.approx([0.05 + 0.01, 0.02, 0.19])


def test_attempts_count_while_the_object_stays() -> None:
    here, away = array([0.0, 0.0, 0.05]), array([0.0, 0.1, 0.05])
    attempts = [Attempt(0, here, 0.1), Attempt(1, here, 0.2), Attempt(0, away, 0.3), Attempt(0, here, 0.4)]
    assert [tried.yaw_rad for tried in attempts_here(attempts, 0, here + 0.001, 0.01)] == [0.1, 0.4]


@dataclass(frozen=True, kw_only=True)
class OwnSummary(Summary):
    """A summary of a controller with fields of its own."""

    picks: int
    left: list[str]


def run(client: palmares.Client, seed: int | None) -> OwnSummary:
    mover = Mover(client, client.reset("balls", "softhand", seed=seed))
    mover.wait(0.02)
    _, summary = mover.stop()
    return OwnSummary(**vars(summary), picks=3, left=["ball_1", "ball_2"])


def test_runs_are_played_from_the_command_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with FakeServer() as server:
        arguments = ["controller.py", "--url", server.url, "--seed", "5", "--runs", "2"]
        monkeypatch.setattr(sys, "argv", [*arguments, "--json"])
        play(run, __doc__)
        lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
        monkeypatch.setattr(sys, "argv", arguments)
        play(run, __doc__)
        lines_of_text = capsys.readouterr().out.splitlines()
    assert [line["seed"] for line in lines] == [5, 6]
    assert lines[0]["left"] == ["ball_1", "ball_2"]
    assert set(lines[0]) == {"run_id", "seed", "score", "sim_time_s", "rtf", "picks", "left"}
    assert lines_of_text[0].startswith(
        "run run-1: score 0; picks: 3; left: ball_1, ball_2; 0.0 s simulated, "
    )
    assert lines_of_text[2] == "2 runs: score 0 on average"


def test_a_refusal_ends_the_program_with_its_message(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["controller.py", "--url", "http://127.0.0.1:9"])
    with pytest.raises(SystemExit, match="no server at"):
        play(run, __doc__)
