"""The wrappers of gymnasium around the environments."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import wrappers
from gymnasium.wrappers import vector

import palmares.gym  # noqa: F401 - registers the ids

pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

NAME = "palmares/Grasp-Pinch-v1"
SIZE = 54
"""Numbers of an observation"""


def flat(env: Any) -> Any:
    return wrappers.FlattenObservation(env)


@pytest.mark.parametrize(
    ("wrap", "shape"),
    [
        (flat, (SIZE,)),
        (lambda env: wrappers.NormalizeObservation(flat(env)), (SIZE,)),
        (lambda env: wrappers.FrameStackObservation(flat(env), 3), (3, SIZE)),
        (lambda env: wrappers.DelayObservation(flat(env), 2), (SIZE,)),
        (lambda env: wrappers.DtypeObservation(flat(env), np.float32), (SIZE,)),
        (
            lambda env: wrappers.NormalizeReward(
                wrappers.RescaleAction(flat(env), np.float64(-2.0), np.float64(2.0))
            ),
            (SIZE,),
        ),
        (lambda env: wrappers.StickyAction(flat(env), 0.5), (SIZE,)),
        (lambda env: wrappers.RecordEpisodeStatistics(wrappers.FilterObservation(env, ["base"])), None),
    ],
)
def test_single_environments(wrap: Callable[[Any], Any], shape: tuple[int, ...] | None) -> None:
    env = wrap(gymnasium.make(NAME, shaping=True, max_episode_steps=2))
    observations, _ = env.reset(seed=1)
    assert observations in env.observation_space
    for k in range(2):
        observations, *_, truncated, info = env.step(env.action_space.sample())
        assert truncated is (k == 1)
    assert observations in env.observation_space
    if shape is None:
        assert info["episode"]["l"] == 2
    else:
        assert observations.shape == shape


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_vector_environments(mode: str) -> None:
    envs: Any = gymnasium.make_vec(NAME, num_envs=3, max_episode_steps=2, autoreset_mode=mode, shaping=True)
    envs = vector.RecordEpisodeStatistics(envs)
    envs = vector.ClipReward(vector.RescaleAction(envs, -2.0, 2.0), -1.0, 1.0)
    if mode == "NextStep":  # These wrappers of gymnasium take no other mode.
        envs = vector.NormalizeReward(vector.NormalizeObservation(vector.FlattenObservation(envs)))
    observations, _ = envs.reset(seed=1)
    assert mode != "NextStep" or observations.shape == (3, SIZE)
    lengths = []
    for _ in range(6):
        observations, *_, infos = envs.step(envs.action_space.sample())
        assert observations in envs.observation_space
        if "episode" in infos:
            lengths.append(infos["episode"]["l"].tolist())
    assert lengths == [[2, 2, 2]] * (2 if mode == "NextStep" else 3)


def test_infos_as_a_list() -> None:
    envs: Any = vector.DictInfoToList(gymnasium.make_vec(NAME, num_envs=2, ticks=100, max_episode_steps=1))
    envs.reset(seed=1)
    *_, infos = envs.step(np.zeros((2, 8)))
    assert [(info["tick"], info["is_success"]) for info in infos] == [(100, False)] * 2
    *_, infos = envs.step(np.zeros((2, 8)))
    assert [list(info) for info in infos] == [["seed"]] * 2


def test_videos(tmp_path: Path) -> None:
    pytest.importorskip("moviepy", reason="moviepy is not installed")
    env = gymnasium.make(NAME, render_mode="rgb_array", render_size=(64, 48), max_episode_steps=3)
    one: Any = wrappers.RecordVideo(env, str(tmp_path / "one"))
    many: Any = vector.RecordVideo(
        gymnasium.make_vec(
            NAME, num_envs=2, render_mode="rgb_array", render_size=(64, 48), max_episode_steps=3
        ),
        str(tmp_path / "many"),
    )
    for there in (one, many):
        there.reset(seed=1)
        for _ in range(3):
            there.step(there.action_space.sample())
        there.close()
    assert {path.parent.name for path in tmp_path.glob("*/*.mp4")} == {"one", "many"}
