"""Environments by their ids of gymnasium: in this process, many at once, and on a server."""

from __future__ import annotations

import itertools
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import palmares.gym
import palmares.sim
from palmares.gym import flat, ids
from tests.real_server import RealServer, needs_server
from tests.short_task import short_grasp

pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

HANDS = ["SoftHand", "ReFlex", "Pinch", "YaleT42", "YaleModelO", "RBO2", "Allegro", "LEAP"]
HANDS += ["InspireRH56", "BarrettBH282", "Shadow", "SoftHand2", "Robotiq3F", "Robotiq2F85", "IHY"]
IDS = [
    f"palmares/{task}-{hand}-v1"
    for task, hand in itertools.product(["Balls", "Shelf", "Grasp", "Pan", "Peg"], HANDS)
]
# Half of a run of the short task, ticks.
HALF = 60


def test_every_built_in_task_and_hand_has_an_id() -> None:
    known = palmares.sim.welcome()
    tasks = {task.name for task in known.tasks}
    assert tasks == set(ids.TASKS.values()) == set(flat.OBJECTS)
    # The SoftHand's variants are arguments: hand="softhand_skin".
    assert {hand.name for hand in known.hands} - {"softhand_skin", "softhand_strong"} == set(
        ids.HANDS.values()
    )
    assert sorted(ids.names()) == sorted(IDS)


def same(a: dict[str, Any], b: dict[str, Any]) -> bool:
    """Return whether two observations are equal; half extents, which clients compute, to rounding."""
    rounded = "object_half_extents"
    if rounded in a and not np.allclose(a[rounded], b[rounded], rtol=0.0, atol=1e-15):
        return False
    return set(a) == set(b) and all(np.array_equal(a[name], b[name]) for name in a if name != rounded)


@pytest.mark.parametrize(
    "name",
    [
        f"palmares/{kind}-v1"
        for kind in ("Balls-SoftHand", "Shelf-ReFlex", "Grasp-Pinch", "Pan-SoftHand", "Peg-Pinch")
    ],
)
def test_the_checker_of_gymnasium_accepts_an_environment(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(name, render_mode="rgb_array")
        check_env(env.unwrapped)
        env.reset(seed=1)
        picture: Any = env.render()
    assert picture.dtype == np.uint8
    assert picture.ndim == 3
    assert picture.std() > 5.0
    env.close()


def test_there_is_an_id_for_each_task_and_hand() -> None:
    assert [name for name in gymnasium.registry if name.startswith("palmares/")] == IDS


@pytest.mark.parametrize("options", [{"sensing": "sensors"}, {"noise": "real"}, {}])
def test_a_batch_plays_as_single_environments_do(options: dict[str, Any]) -> None:
    name = "palmares/Shelf-ReFlex-v1"
    many, one = (
        gymnasium.make_vec(name, num_envs=3, ticks=4, **options),
        gymnasium.make(name, ticks=4, **options),
    )
    assert isinstance(many, palmares.gym.BatchEnv)
    assert one.observation_space == many.single_observation_space
    assert one.action_space == many.single_action_space
    first, infos = many.reset(seed=7)
    assert list(infos["seed"]) == [7, 8, 9]
    observations, info = one.reset(seed=8)
    assert info["seed"] == 8
    assert same(observations, {key: values[1] for key, values in first.items()})
    many.action_space.seed(1)
    for _ in range(10):
        actions = many.action_space.sample()
        found, rewards, *_ = many.step(actions)
        expected, reward, *_ = one.step(actions[1])
        assert same(expected, {key: values[1] for key, values in found.items()})
        assert rewards[1] == reward
        assert found in many.observation_space


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the path of a task whose runs have two halves of `HALF` ticks."""
    return short_grasp(tmp_path_factory.mktemp("short"), 2 * HALF * 0.01)


def episodes(task: str, mode: AutoresetMode, threads: int) -> list[Any]:
    """Play four steps of half a run; return the outcome of each."""
    envs = gymnasium.make_vec(
        "palmares/Grasp-Pinch-v1", task=task, num_envs=2, ticks=HALF, threads=threads, autoreset_mode=mode
    )
    envs.reset(seed=3)
    rest = np.array([[0.0] * 6 + [-1.0, -1.0]] * 2)
    outcomes: list[Any] = []
    for _ in range(4):
        if mode is AutoresetMode.DISABLED and outcomes and outcomes[-1][3].any():
            envs.reset(options={"reset_mask": np.array([True, True])})
        outcomes.append(envs.step(rest))
    return outcomes


def test_every_way_to_begin_again_loses_nothing(short: str) -> None:
    next_step, same_step, by_hand = (episodes(short, mode, 2) for mode in AutoresetMode)
    assert [list(step[3]) for step in next_step] == [[False] * 2, [True] * 2, [False] * 2, [False] * 2]
    assert [list(step[3]) for step in same_step] == [[False] * 2, [True] * 2, [False] * 2, [True] * 2]
    assert [list(step[3]) for step in by_hand] == [[False] * 2, [True] * 2, [False] * 2, [True] * 2]
    # The last observation of an episode, and the first of the next.
    final, infos = next_step[1][0], same_step[1][4]
    assert same(infos["final_obs"][0], {name: values[0] for name, values in final.items()})
    assert list(infos["_final_obs"]) == [True, True]
    assert same(same_step[1][0], next_step[2][0])
    assert list(next_step[2][1]) == [0.0, 0.0]
    assert list(infos["result"]["reason"]) == ["time_limit"] * 2
    assert same(same_step[2][0], by_hand[2][0])
    # Another scene than before, the same for any number of threads.
    assert not np.array_equal(same_step[1][0]["objects"], next_step[0][0]["objects"])
    again = episodes(short, AutoresetMode.SAME_STEP, 1)
    assert all(same(a[0], b[0]) for a, b in zip(same_step, again, strict=True))


def test_a_missing_reset_is_an_error_when_resets_are_by_hand(short: str) -> None:
    envs = gymnasium.make_vec(
        "palmares/Grasp-Pinch-v1",
        task=short,
        num_envs=1,
        ticks=2 * HALF,
        autoreset_mode=AutoresetMode.DISABLED,
    )
    with pytest.raises(RuntimeError, match="call reset"):
        envs.step(np.zeros((1, 8)))
    envs.reset(seed=1)
    envs.step(np.zeros((1, 8)))
    with pytest.raises(RuntimeError, match="reset_mask"):
        envs.step(np.zeros((1, 8)))
    with pytest.raises(ValueError, match="reset_mask"):
        envs.reset(options={"reset_mask": [True, False]})
    with pytest.raises(ValueError, match="seed: found 2"):
        envs.reset(seed=[1, 2])  # type: ignore[arg-type]


def test_arguments_for_a_server_are_refused_without_one() -> None:
    with pytest.raises(ValueError, match="give the server's url"):
        palmares.gym.PalmaresEnv(None, render_mode="human")
    with pytest.raises(ValueError, match="render_mode: found 'ansi'"):
        palmares.gym.PalmaresEnv(None, render_mode="ansi")
    with pytest.raises(TypeError, match="argument 'team': unknown, or for a server only"):
        palmares.gym.PalmaresEnv(None, team="crabs")


@needs_server
def test_the_same_id_plays_on_a_server(tmp_path: Path) -> None:
    name = "palmares/Grasp-SoftHand-v1"
    with RealServer(tmp_path) as server:
        there, here = gymnasium.make(name, url=server.url), gymnasium.make(name)
        assert there.observation_space == here.observation_space
        assert there.action_space == here.action_space
        here.action_space.seed(2)
        assert same(there.reset(seed=5)[0], here.reset(seed=5)[0])
        for _ in range(8):
            action = here.action_space.sample()
            expected, found = here.step(action), there.step(action)
            assert same(found[0], expected[0])
            assert found[1:4] == expected[1:4]
        there.close()
