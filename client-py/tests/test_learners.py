"""The examples that learn, in trainings too short for a result."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from palmares.arrays import Array, array

pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

from palmares.examples import _grasp_runs as grasp_runs
from palmares.examples import train_grasp_cem, train_lift_sb3, train_lift_shaped, train_peg_reward
from palmares.rotation import angle_between, matrix_of, quat_of
from palmares.rotation import rot_zyz as matrix_zyz
from palmares.sim import Batch


def test_training_and_test_have_no_object_in_common() -> None:
    drawn = [next(grasp_runs.training_scenes(np.random.default_rng(3))) for _ in range(2)]
    assert drawn[0] == drawn[1]
    assert [grasp_runs.object_of(seed) for seed in drawn[0]] == list(grasp_runs.LEARNED_WITH)
    assert max(drawn[0]) < grasp_runs.FIRST_TEST_SEED <= min(tested := grasp_runs.test_scenes(8))
    assert len(set(tested)) == 8
    assert {grasp_runs.object_of(seed) for seed in tested} <= set(grasp_runs.HELD_OUT)
    assert not set(grasp_runs.LEARNED_WITH) & set(grasp_runs.HELD_OUT)


def test_quaternions_in_rows() -> None:
    rng = np.random.default_rng(1)
    angles = rng.uniform(-3.0, 3.0, (20, 3))
    quats = grasp_runs.rot_zyz(*angles.T)
    for quat, (yaw, pitch, roll) in zip(quats, angles, strict=True):
        assert angle_between(quat, quat_of(matrix_zyz(yaw, pitch, roll))) < 1e-6
    vectors = rng.normal(size=(20, 3))
    expected = [matrix_of(quat) @ vector for quat, vector in zip(quats, vectors, strict=True)]
    assert np.allclose(grasp_runs.rotated(quats, vectors), expected)
    other = quats[::-1]
    between = grasp_runs.rotation_between(quats, other)
    assert np.all(np.linalg.norm(between, axis=1) <= np.pi + 1e-9)
    ends = grasp_runs.turned(quats, between)
    assert max(angle_between(a, b) for a, b in zip(ends, other, strict=True)) < 1e-6
    assert np.allclose(grasp_runs.rotation_between(quats, quats), 0.0)


def test_the_fingers_lie_across_the_longer_side() -> None:
    yaw = array([0.5, 0.5, 0.5 + np.pi, 0.5 + np.pi / 2])
    sizes = array([[0.09, 0.05, 0.1], [0.05, 0.09, 0.1], [0.09, 0.05, 0.1], [0.06, 0.06, 0.1]])
    across = grasp_runs.yaw_across(yaw, sizes)
    assert np.allclose(np.sin(across - [0.5, 0.5 + np.pi / 2, 0.5, 0.5 - np.pi / 2]), 0.0)
    assert np.all(np.abs(across - grasp_runs.LEAST_TURN_RAD) <= [np.pi / 2] * 3 + [np.pi / 4])


def test_hands_arrive_where_they_are_sent() -> None:
    hands = grasp_runs.Hands(Batch("grasp", "softhand", 2, threads=1))
    start = hands.reset([1, 2])["base"]
    goal = start[:, :3] + [[0.1, 0.0, 0.1], [0.0, -0.1, 0.2]]
    quats = grasp_runs.rot_zyz(array([0.0, 1.5]), array([1.6, 1.6]), array([0.0, 0.3]))
    hands.to(2.0, goal, quats, array([0.2, 0.4]))
    reached = hands.wait(0.3)
    assert np.abs(reached["base"][:, :3] - goal).max() < 2e-3
    assert max(angle_between(a, b) for a, b in zip(reached["base"][:, 3:7], quats, strict=True)) < 0.02
    assert np.allclose(reached["motors"][:, 0, 0], [0.2, 0.4])
    hands.active[0] = False
    ticks = hands.batch.ticks
    hands.to(0.2, start[:, :3])
    assert [after - before for before, after in zip(ticks, hands.batch.ticks, strict=True)] == [0, 20]


def test_cross_entropy_gives_the_same_curve_for_any_number_of_threads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Three objects instead of six: an update plays 6 runs.
    for module in (grasp_runs, train_grasp_cem):
        monkeypatch.setattr(module, "LEARNED_WITH", grasp_runs.LEARNED_WITH[:3])
    learned = [
        train_grasp_cem.train(
            4,
            updates=2,
            population=2,
            tests=2,
            test_every=2,
            threads=threads,
            policy=tmp_path / f"{threads}.json",
        )
        for threads in (1, 2)
    ]
    assert learned[0] == learned[1]
    assert [(point.update, point.episodes) for point in learned[0].curve] == [(0, 0), (1, 6), (2, 12)]
    assert [point.test is None for point in learned[0].curve] == [False, True, False]
    assert learned[0].curve[-1].test == pytest.approx(np.mean(learned[0].scores))
    policies = [(tmp_path / f"{threads}.json").read_text() for threads in (1, 2)]
    assert policies[0] == policies[1]
    moved = array([json.loads(policies[0])[name] for name in train_grasp_cem.NAMES])
    assert not np.allclose(moved, train_grasp_cem.START)


def test_cross_entropy_with_drawn_hands(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (grasp_runs, train_grasp_cem):
        monkeypatch.setattr(module, "LEARNED_WITH", grasp_runs.LEARNED_WITH[:1])
    nominal, drawn = (
        train_grasp_cem.train(4, updates=1, population=2, tests=1, threads=1, randomise=randomise)
        for randomise in (False, True)
    )
    assert [point.test is None for point in drawn.curve] == [True, False]
    assert [point.episodes for point in drawn.curve] == [point.episodes for point in nominal.curve]


def test_decisions_use_only_the_sensors() -> None:
    seeds = grasp_runs.test_scenes(2)
    decisions = train_lift_sb3.Decisions(2, iter(seeds * 2), threads=1)
    assert "objects" not in decisions.batch.fields
    rewards = []
    for _ in range(2):
        observations, over = decisions.reset(), False
        assert observations.shape == (2, train_lift_sb3.OBSERVATIONS)
        gained = np.zeros(2)
        while not over:
            observations, reward, over = decisions.step(np.zeros((2, train_lift_sb3.ACTIONS)))
            gained += reward
            assert np.isfinite(observations).all()
        rewards.append(gained)
        assert decisions.finished[-1] == pytest.approx(gained.mean())
    assert np.array_equal(rewards[0], rewards[1])


def test_ppo_gives_the_same_curve_for_any_number_of_threads() -> None:
    pytest.importorskip("stable_baselines3", reason="stable-baselines3 is not installed: it is in `learn`")
    learned = [train_lift_sb3.train(4, updates=2, worlds=6, tests=2, threads=threads) for threads in (1, 2)]
    assert learned[0] == learned[1]
    assert [point.episodes for point in learned[0].curve] == [0, 12, 24]


@pytest.mark.parametrize("learner", ["ppo", "sac"])
def test_learners_of_shaped_rewards_give_the_same_curve_for_any_number_of_threads(
    learner: train_lift_shaped.Learner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("stable_baselines3", reason="stable-baselines3 is not installed: it is in `learn`")
    monkeypatch.setattr(train_lift_shaped, "DECISIONS", 4)
    monkeypatch.setattr(train_lift_shaped, "TEST_DECISIONS", 4)
    policy = tmp_path / "policy.zip"
    learned = [
        train_lift_shaped.train(
            4,
            learner=learner,
            updates=2,
            worlds=2,
            scenes=1,
            tests=1,
            coarse_tests=1,
            threads=threads,
            policy=policy,
        )
        for threads in (1, 2)
    ]
    assert learned[0] == learned[1]
    assert [point.test is None for point in learned[0].curve] == [True, True, False]
    assert learned[0].curve[-1].episodes >= 4
    assert len(learned[0].scores) == len(learned[0].coarse) == 1
    assert policy.exists()


def grasping(lifts: train_lift_shaped.Lifts) -> list[Array]:
    """Play a run down, closed and up; return the rewards of the decisions."""
    down, close, up = np.zeros((3, lifts.batch.count, train_lift_shaped.ACTIONS))
    down[:, 2], close[:, 3], up[:, 2] = -0.7, 1.0, 1.0
    return [lifts.step(action)[2] for action in (down, down, close, close, close, up, up)]


def test_the_shaped_part_is_the_gained_potential() -> None:
    seeds = next(grasp_runs.training_scenes(np.random.default_rng(3)))[2:5]
    gained = []
    for shaping in (True, False):
        lifts = train_lift_shaped.Lifts(3, seeds, shaping=shaping, step_ms=5.0, threads=1)
        # The second run continues from a snapshot with the potential of its start.
        for _ in range(2):
            assert lifts.reset().shape == (3, train_lift_shaped.OBSERVATIONS)
            first = lifts.batch.observe()["objects"][:, 0, :2].copy()
            before = np.sum(list((lifts.batch.potential or {}).values()), axis=0)
            gained.append(np.sum(grasping(lifts), axis=0))
            after = np.sum(list((lifts.batch.potential or {}).values()), axis=0)
            points = lifts.batch.scores
            assert points.max() >= 1.0
            # A run with a lost object takes the potential back.
            places = lifts.batch.observe()["objects"][:, 0, :2]
            kept = np.abs(places - first).max(axis=1) <= train_lift_shaped.LOST_M
            expected = points + (np.where(kept, after, 0.0) - before if shaping else 0.0)
            assert np.allclose(gained[-1], expected)
    assert np.array_equal(gained[0], gained[1])
    assert np.array_equal(gained[2], gained[3])


def test_the_curriculum_widens_when_runs_score(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(train_lift_shaped, "WINDOW", 4)
    seeds = next(grasp_runs.training_scenes(np.random.default_rng(3)))[2:4]
    rng = np.random.default_rng(1)
    lifts = train_lift_shaped.Lifts(2, seeds, rng, curriculum=True, step_ms=5.0, threads=1)
    lifts.reset()
    assert np.all(lifts.batch.observe()["motors"][:, 0, 0] > 0.5)
    # Both runs last as long, so that four are over after two rounds.
    for passed, stages in ((0.0, 1), (0.0, 2), (1.0, 2), (1.0, 2)):
        monkeypatch.setattr(train_lift_shaped, "PASSED", passed)
        for _ in range(train_lift_shaped.DECISIONS):
            lifts.step(np.zeros((2, train_lift_shaped.ACTIONS)))
        assert lifts.stages == stages


def fields_of_peg(rise_m: float, up: float, off_m: float, sigma: float) -> dict[str, Array]:
    """Return fields of one environment.

    Args:
        rise_m: Rise of the peg.
        up: Vertical part of the thumb's direction, by a turn of the hand about x.
        off_m: Horizontal distance of the grip from the peg.
        sigma: Command of the motor.

    """
    angle = np.arcsin(up)
    quat = [np.sin(angle / 2), 0.0, 0.0, np.cos(angle / 2)]
    objects = np.zeros((1, 2, 13))
    objects[0, 0, 2] = train_peg_reward.PEG_HEIGHT_M + rise_m
    grip = objects[0, 0, :3] + array([off_m, 0.0, train_peg_reward.GRIP_M])
    at = grip - matrix_of(quat) @ train_peg_reward.IN_HAND_M
    motors = np.zeros((1, 1, 4))
    motors[0, 0, 0] = sigma
    return {"base": np.array([[*at, *quat, *np.zeros(6)]]), "objects": objects, "motors": motors}


def test_the_reward_of_the_peg_is_the_gain_by_reach_turn_wrap_and_lift() -> None:
    def potential(rise_m: float, up: float = 1.0, off_m: float = 0.0, sigma: float = 0.0) -> float:
        (found,) = train_peg_reward.potential(fields_of_peg(rise_m, up, off_m, sigma))
        return float(found)

    far = fields_of_peg(0.0, 0.5, 0.2, 0.0)
    np.testing.assert_allclose(np.linalg.norm(train_peg_reward.way(far), axis=1), [0.2], rtol=1e-9)
    assert potential(0.0, 0.5, 0.2) == pytest.approx(0.5 - 1.0)
    assert potential(0.0) == pytest.approx(1.0)
    # A closed hand is worth something around the peg, and costs something elsewhere.
    assert potential(0.0, sigma=1.0) == pytest.approx(1.0 + 3.0)
    assert potential(0.0, 1.0, 0.2, 1.0) == pytest.approx(1.0 - 1.0 - 1.0, abs=1e-5)
    assert potential(-0.08, sigma=1.0) == pytest.approx(1.0 - 1.0 - 0.3)
    assert potential(0.05, sigma=1.0) == pytest.approx(1.0 + 3.0 + 1.5)
    assert potential(0.5, sigma=1.0) == pytest.approx(1.0 + 3.0 + 3.0)
    before, after = fields_of_peg(0.0, 1.0, 0.0, 1.0), fields_of_peg(0.05, 1.0, 0.0, 1.0)
    step: Any = SimpleNamespace(before=before, after=after, rewards=np.array([1.0]))
    assert train_peg_reward.reward(step) == pytest.approx(1.0 + 1.5 + 0.02)


def test_the_scripted_grasp_leads_from_the_start_to_the_lifted_peg() -> None:
    states = train_peg_reward.starts()
    scenes = len(train_peg_reward.SHOWN_SEEDS)
    fields = {
        "base": np.stack([state.base for state in states]),
        "objects": np.stack([state.objects for state in states]),
        "motors": np.stack([state.motors for state in states]),
    }
    potential = train_peg_reward.potential(fields).reshape(-1, scenes)
    rises = train_peg_reward.rise(fields).reshape(-1, scenes)
    assert len(potential) == 8
    np.testing.assert_array_equal(potential[0], potential[2])
    assert np.all(np.diff(potential[2:], axis=0) > 0.0)
    assert np.all(np.abs(rises[:7]) < 0.01)
    assert np.all(rises[7] > train_peg_reward.LIFTED_M)


def test_an_own_reward_gives_the_same_curve_for_any_number_of_threads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(train_peg_reward, "TEST_EVERY", 2)
    monkeypatch.setattr(train_peg_reward, "SHOWN_SEEDS", range(9001, 9002))
    sb3 = pytest.importorskip("stable_baselines3", reason="stable-baselines3 is not installed: `learn`")
    learned = [
        train_peg_reward.train(
            4, updates=2, envs=2, tests=2, threads=threads, policy=tmp_path / f"{threads}.zip"
        )
        for threads in (1, 2)
    ]
    assert learned[0].curve == learned[1].curve
    assert (learned[0].rises, learned[0].scores) == (learned[1].rises, learned[1].scores)
    assert [(point.update, point.episodes) for point in learned[0].curve] == [(1, 2), (2, 4)]
    assert learned[0].curve[0].reward != learned[0].curve[1].reward
    assert [point.lifted for point in learned[0].curve] == [None, 0.0]
    assert sb3.PPO.load(tmp_path / "1.zip", device="cpu").observation_space.shape == (38,)


def test_ppo_in_one_file_gives_the_same_policy_for_any_number_of_threads(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch", reason="PyTorch is not installed: it is in `learn`")
    from palmares.examples import train_ppo_torch

    returns, policies = [], []
    for threads in (1, 2):
        file = tmp_path / f"{threads}.pt"
        words = f"--envs 2 --steps 5 --updates 3 --hand pinch --blind --threads {threads} --policy {file}"
        returns.append(train_ppo_torch.train(train_ppo_torch.parsed(words.split())))
        policies.append(torch.load(file))
    assert len(returns[0]) == 3
    assert returns[0] == returns[1]
    weights = [policy["policy"]["body.0.weight"] for policy in policies]
    assert torch.equal(*weights)
