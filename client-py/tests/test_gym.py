"""The environment for learners, against a server without physics."""

from __future__ import annotations

import warnings
from typing import cast

import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env

from palmares.errors import WrongStateError
from palmares.gym import PalmaresEnv
from tests.fake_server import FakeServer


def test_an_episode() -> None:
    with FakeServer() as server:
        env = PalmaresEnv(server.url, ticks=5)
        obs, _ = env.reset(seed=4)
        assert obs["objects"].shape == (3, 13)
        assert env.observation_space.contains(obs)
        action = {"twist": np.array([0.1, 0, 0, 0, 0, 0.2]), "hand": np.array([0.4])}
        obs, reward, terminated, truncated, info = env.step(action)
        assert obs["motors"][0, 0] == 0.4
        assert (reward, terminated, truncated) == (0.0, False, False)
        assert env.observation is not None
        assert env.observation.tick == info["tick"] == 5
        env.reset(seed=5)  # Closes the first run.
        env.close()
    sent = [(request["op"], request.get("seed")) for request in server.requests]
    runs = [ask for ask in sent if ask[0] in ("reset", "stop")]
    assert runs == [("reset", 4), ("stop", None), ("reset", 5)]


def test_the_spaces_are_known_without_a_run() -> None:
    with FakeServer() as server:
        env = PalmaresEnv(server.url)
        limits = [1.5] * 3 + [2.5] * 3
        twist, hand = (cast(spaces.Dict, env.action_space)[name] for name in ("twist", "hand"))
        assert twist == spaces.Box(-np.array(limits), np.array(limits), dtype=np.float64)
        assert hand == spaces.Box(0.0, 1.0, (1,), dtype=np.float64)
        observed = cast(spaces.Dict, env.observation_space)
        assert isinstance(observed["objects"], spaces.Sequence)
        assert {name: space.shape for name, space in observed.items() if name != "objects"} == {
            "base": (13,),
            "motors": (1, 4),
            "wrist": (6,),
            "time_left": (1,),
            "joints": (2, 2),
        }
        env.close()
        env = PalmaresEnv(server.url, sensing="sensors")
        assert set(cast(spaces.Dict, env.observation_space)) == {"base", "motors", "wrist", "time_left"}
        env.close()
    assert not [request for request in server.requests if request["op"] == "reset"]


def test_a_learner_can_ask_for_a_fixed_number_of_objects() -> None:
    with FakeServer() as server:
        env = PalmaresEnv(server.url, objects=3)
        assert cast(spaces.Dict, env.observation_space)["objects"].shape == (3, 13)
        obs, _ = env.reset(seed=1)
        assert env.observation_space.contains(obs)
        env.close()
        env = PalmaresEnv(server.url, objects=10)
        with pytest.raises(ValueError, match="the scene has 3 objects, not 10"):
            env.reset(seed=1)
        env.close()


def test_gymnasium_finds_nothing_wrong() -> None:
    with FakeServer() as server, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # It recommends flat and bounded spaces.
        env = PalmaresEnv(server.url)
        check_env(env, skip_render_check=True)
        env.close()


def test_a_closed_environment_begins_again_in_this_process_and_not_on_a_server() -> None:
    pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")
    env = PalmaresEnv("local", task="grasp", hand="pinch")
    first, _ = env.reset(seed=5)
    env.close()
    again, _ = env.reset(seed=5)
    assert all(np.array_equal(first[name], again[name]) for name in first)
    env.step(env.action_space.sample())
    env.close()
    with FakeServer() as server:
        env = PalmaresEnv(server.url)
        env.close()
        with pytest.raises(WrongStateError, match="the client is closed"):
            env.reset(seed=1)
