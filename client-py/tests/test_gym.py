"""The environment for learners, against a server without physics."""

from __future__ import annotations

import warnings

import numpy as np
from gymnasium.utils.env_checker import check_env

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
        assert env.observation.tick == info["tick"] == 5
        env.reset(seed=5)  # Closes the first run.
        env.close()
    asked = [(request["op"], request.get("seed")) for request in server.requests]
    assert [ask for ask in asked if ask[0] in ("reset", "stop")] == [
        ("reset", None),
        ("stop", None),
        ("reset", 4),
        ("stop", None),
        ("reset", 5),
    ]


def test_gymnasium_finds_nothing_wrong() -> None:
    with FakeServer() as server, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # It recommends flat and bounded spaces.
        env = PalmaresEnv(server.url)
        check_env(env, skip_render_check=True)
        env.close()
