"""Datasets of Minari."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from palmares.arrays import Array
from tests.short_task import short_grasp

pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")
pytest.importorskip("minari", reason="minari is not installed: palmares[minari]")
pytest.importorskip("h5py", reason="h5py is not installed: palmares[minari]")

import minari

import palmares.minari

NAME = "palmares/Grasp-Pinch-v1"


def policy(observations: dict[str, Array]) -> Array:
    """Go to the object, and close."""
    way = observations["objects"][:, 0, :3] - observations["base"][:, :3]
    rest = np.zeros((len(way), 5))
    return np.hstack([np.clip(way, -1.0, 1.0), rest])


@pytest.fixture
def options(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Return arguments of short episodes; datasets are in a folder of the test."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    return {"task": short_grasp(tmp_path, 1.0), "ticks": 25, "shaping": True}


def test_a_dataset_has_the_episodes_of_single_environments(options: dict[str, Any]) -> None:
    made = palmares.minari.collect(
        "palmares/grasp/near-v0", policy, NAME, [5, 2, 9], num_envs=2, options=options, author="pytest"
    )
    assert (made.total_episodes, made.total_steps) == (3, 12)
    found = minari.load_dataset("palmares/grasp/near-v0")
    env = found.recover_environment()
    assert env.observation_space == gymnasium.make(NAME, **options).observation_space
    for episode, seed in zip(found.iterate_episodes(), (5, 2, 9), strict=True):
        observation, _ = env.reset(seed=seed)
        for k in range(4):
            for name, values in observation.items():
                # Single environments compute half extents otherwise.
                np.testing.assert_allclose(episode.observations[name][k], values, rtol=0.0, atol=1e-15)
            action = policy({name: values[None] for name, values in observation.items()})[0]
            np.testing.assert_array_equal(episode.actions[k], action)
            observation, reward, terminated, truncated, info = env.step(action)
            assert (episode.rewards[k], episode.infos["shaping"][k + 1]) == (reward, info["shaping"])
            assert (episode.terminations[k], episode.truncations[k]) == (terminated, truncated)
        assert truncated
        np.testing.assert_array_equal(episode.observations["base"][4], observation["base"])
        assert episode.infos["tick"].tolist() == [0, 25, 50, 75, 100]
    with pytest.raises(ValueError, match="exist"):
        palmares.minari.collect("palmares/grasp/near-v0", policy, NAME, [5], options=options)


def test_seeds_that_are_none_are_refused(options: dict[str, Any]) -> None:
    for seeds in ([], [3, 3], [-1]):
        with pytest.raises(ValueError, match="seeds"):
            palmares.minari.collect("palmares/x-v0", policy, NAME, seeds, options=options)


def test_a_collector_of_minari_keeps_infos(options: dict[str, Any]) -> None:
    pytest.importorskip("jax", reason="jax is not installed: minari[create]")
    env = minari.DataCollector(
        gymnasium.make(NAME, **options), step_data_callback=palmares.minari.Infos, record_infos=True
    )
    env.reset(seed=4)
    truncated = False
    while not truncated:
        *_, truncated, info = env.step(env.action_space.sample())
    made = env.create_dataset("palmares/grasp/mine-v0")
    assert made[0].infos["tick"].tolist() == [0, 25, 50, 75, 100]
    assert made[0].infos["shaping"][-1] == info["shaping"]
    assert made[0].infos["is_success"].dtype == bool
