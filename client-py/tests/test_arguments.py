"""Errors of arguments name the argument, and change nothing."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import palmares
import palmares.gym
from palmares.sim.local import REPEAT
from palmares.training import Training
from tests.fake_server import FakeServer
from tests.real_server import RealServer, needs_server

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

# NumPy's whole numbers are accepted.
MANY: Any = np.int64(REPEAT)
HALF: Any = 0.5
SEEDS: Any = [1, -1]


def test_an_invalid_seed_changes_nothing() -> None:
    world = sim.World("balls", "softhand", 3)
    world.step(hand=[0.5], repeat=5)
    before = world.state_hash()
    wrong: list[tuple[Any, str]] = [
        (-1, "-1"),
        (1.5, "1.5"),
        ("a", "'a'"),
        (2**53, str(2**53)),
        (True, "True"),
    ]
    for seed, found in wrong:
        with pytest.raises(ValueError, match=f"^seed: found {found}; wanted a whole number from 0 to 2"):
            world.reset(seed)
        with pytest.raises(ValueError, match=f"^seed: found {found}; wanted"):
            sim.World("balls", "softhand", seed)
        with (
            palmares.Client("local") as client,
            pytest.raises(palmares.BadRequestError, match=f"seed: found {found}; wanted"),
        ):
            client.reset("balls", "softhand", seed=seed)
    with pytest.raises(palmares.UnknownCameraError):
        world.reset(4, cameras=["nose"])
    assert "seed 3, tick 5" in repr(world)
    assert world.state_hash() == before
    world.reset()
    assert world.run.seed == sim.World("balls", "softhand", np.uint64(3)).run.seed


@pytest.mark.parametrize("repeat", [0, -1, REPEAT + 1, 1.5, "a", None, True])
def test_a_session_takes_as_many_ticks_here_as_on_a_server(repeat: Any) -> None:
    with palmares.Client("local") as client:
        client.reset("balls", "softhand", seed=1)
        message = r"^bad_request: repeat: found .*; wanted a whole number from 1 to 100$"
        with pytest.raises(palmares.BadRequestError, match=message):
            client.step(repeat=repeat)
        assert client.tick == 0
        assert client.step(repeat=MANY).tick == REPEAT


def test_a_world_takes_more() -> None:
    world = sim.World("balls", "softhand")
    assert world.step(repeat=np.int64(2 * REPEAT)).tick == 2 * REPEAT
    with pytest.raises(palmares.BadRequestError, match="repeat: found -1; wanted a whole number from 1 to"):
        world.step(repeat=-1)


@needs_server
def test_the_limit_is_that_of_a_server(tmp_path: Path) -> None:
    with RealServer(tmp_path) as server, palmares.Client(server.url) as far, palmares.Client("local") as near:
        assert far.welcome.limits.repeat == near.welcome.limits.repeat == REPEAT
        far.reset("balls", "softhand", seed=1)
        with pytest.raises(palmares.BadRequestError, match="repeat: found 101; wanted a whole number"):
            far.step(repeat=101)
        assert far.step(repeat=MANY).tick == REPEAT


def test_a_step_after_the_end_names_the_remedy() -> None:
    with palmares.Client("local") as client:
        client.reset("grasp", "pinch", seed=1)
        assert client.world is not None
        client.world.step(repeat=12_000)
        with pytest.raises(palmares.WrongStateError, match=r"the run is over; stop\(\) returns its result"):
            client.step()
        with pytest.raises(palmares.WrongStateError, match=r"the run is over; result\(\)"):
            client.world.step()


def test_the_error_shows_numbers_that_are_not_finite() -> None:
    with palmares.Client("local") as client:
        client.reset("balls", "softhand", seed=1)
        for thing in (client, client.world):
            assert thing is not None
            for hand in ([float("nan")], np.array([np.nan]), float("nan")):
                with pytest.raises(palmares.BadActionError, match=r"hand: found \[nan\]; wanted finite"):
                    thing.step(hand=hand)
        with pytest.raises(palmares.BadActionError, match=r"linear: found \[0.0, inf, 0.0\]; wanted finite"):
            palmares.twist([0.0, float("inf"), 0.0], [0.0] * 3)


def test_training_is_checked_where_it_is_given() -> None:
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"shaping": "yes"}, "shaping: found 'yes'; wanted True or False"),
        ({"discount": "x"}, "discount: found 'x'; wanted 0 to 1"),
        ({"discount": float("nan")}, "discount: found nan"),
        ({"fraction": "a"}, "fraction: found 'a'; wanted a number above 0"),
        ({"fraction": None}, "fraction: found None"),
        ({"randomise": 5}, "randomise: found 5; wanted True, or a sequence of names"),
    ]
    for arguments, message in wrong:
        with pytest.raises(ValueError, match=message):
            Training(**arguments)
    made: list[Callable[[], object]] = [
        lambda: sim.World("balls", "softhand", training=5),
        lambda: sim.Batch("balls", "softhand", 1, training=5),
        lambda: palmares.Client("local", training=5),  # type: ignore[arg-type]
    ]
    for make in made:
        with pytest.raises(ValueError, match=r"training: found 5; wanted a palmares\.Training, or None"):
            make()
    with FakeServer() as server, pytest.raises(ValueError, match="servers do not offer it"):
        palmares.Client(server.url, training=Training())


def refused(call: Callable[[], object], message: str) -> None:
    """Expect a call to be refused with this message, without a warning before."""
    with warnings.catch_warnings(action="error"), pytest.raises(ValueError, match=message):
        call()


ACTIONS: list[tuple[Any, str]] = [
    (np.zeros(6), r"found shape \(6,\); wanted "),
    ([0.0] * 6, r"found shape \(6,\); wanted "),
    (np.zeros((2, 6)), r"found shape \(2, 6\); wanted "),
    (np.zeros((1, 2, 7)), r"found shape \(1, 2, 7\); wanted "),
    (None, r"found None, which are not numbers; wanted shape "),
    ([[1.0], [1.0, 2.0]], r"found \[\[1.0\], \[1.0, 2.0\]\], which are not numbers; wanted shape "),
]


@pytest.mark.parametrize(("action", "message"), ACTIONS)
def test_an_action_is_checked_where_it_is_given(action: Any, message: str) -> None:
    batch = sim.Batch("balls", "softhand", 2, threads=1)
    batch.reset([1, 2])
    many = gymnasium.make_vec("palmares/Balls-SoftHand-v1", num_envs=2, threads=1)
    many.reset(seed=1)
    flat = palmares.gym.FlatEnv("balls", "softhand")
    flat.reset(seed=1)
    refused(lambda: batch.step(action), f"^actions: {message}")
    refused(lambda: many.step(action), f"^actions: {message}")
    refused(lambda: flat.step(action), f"^action: {message}")
    odd = np.zeros((2, 7))
    odd[1, 2] = np.inf
    refused(lambda: batch.step(odd), r"^actions\[1, 2\] is inf; wanted finite numbers")
    refused(lambda: many.step(odd), r"^actions\[1, 2\] is inf; wanted finite numbers")
    refused(lambda: flat.step(odd[1]), r"^action\[2\] is inf; wanted finite numbers")
    flat.step([0.0] * 7)  # type: ignore[arg-type]


def test_seeds_and_masks_are_checked_where_they_are_given() -> None:
    batch = sim.Batch("balls", "softhand", 3, threads=1)
    batch.reset([1, 2, 3])
    before = batch.state_hashes()
    wrong: list[tuple[tuple[Any, ...], str]] = [
        (([1.5, 2, 3],), r"seeds\[0\]: found 1.5; wanted a whole number"),
        (([1, 2],), "seeds: found 2; wanted one for each of 3 worlds"),
        (([1, -1, 3],), r"seeds\[1\]: found -1"),
        (([1, 2, 3], "abc"), r"mask: wanted \(3,\) of bool"),
        (([1, 2, 3], [1, 0, 1]), r"mask: wanted \(3,\) of bool, found \(3,\) of int64"),
    ]
    for arguments, message in wrong:
        refused(lambda arguments=arguments: batch.reset(*arguments), message)  # type: ignore[misc]
    for world in (-1, 3, "a"):
        refused(lambda world=world: batch.events(world), "world: found")  # type: ignore[misc]
    refused(lambda: batch.step(np.zeros((3, 7)), ticks=HALF), "ticks: found 0.5")
    assert batch.state_hashes() == before
    # Seeds of worlds outside the mask are ignored.
    batch.reset([-1, 2, -1], [False, True, False])
    many = gymnasium.make_vec("palmares/Balls-SoftHand-v1", num_envs=2, threads=1)
    for seed, found in ((-1, "seed: found -1"), (1.5, "seed: found 1.5"), ("a", "seed: found 'a'")):
        refused(lambda seed=seed: many.reset(seed=seed), found)  # type: ignore[misc]
    refused(lambda: many.reset(seed=SEEDS), r"seed\[1\]: found -1")


def test_environments_check_their_arguments_when_they_are_made() -> None:
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"ticks": 0}, "ticks: found 0; wanted a whole number from 1"),
        ({"ticks": "a"}, "ticks: found 'a'; wanted a whole number from 1"),
        ({"sensing": "x"}, "sensing: found 'x'; wanted 'sensors' or 'truth'"),
        ({"noise": "x"}, "noise: found 'x'; wanted 'none' or 'real'"),
    ]
    for arguments, message in wrong:
        for make in (gymnasium.make, gymnasium.make_vec):
            refused(lambda: make("palmares/Balls-SoftHand-v1", **arguments), message)  # noqa: B023
    refused(lambda: gymnasium.make("palmares/Balls-SoftHand-v1", ticks=101), "from 1 to 100")
    env = gymnasium.make("palmares/Grasp-SoftHand-v1", cameras="table")
    assert "depth_table" in env.reset(seed=1)[0]
    for single in ({"objects": 3}, {"url": "http://127.0.0.1:8080"}, {"colour": 1}):
        name = next(iter(single))
        with pytest.raises(TypeError, match=f"argument '{name}': unknown, or for a single environment only"):
            gymnasium.make_vec("palmares/Balls-SoftHand-v1", num_envs=1, **single)
    with pytest.raises(TypeError, match="argument 'colour': unknown, or for a server only"):
        gymnasium.make("palmares/Balls-SoftHand-v1", colour=1)


def test_settings_are_given_at_once_or_by_name() -> None:
    settings = palmares.gym.Settings(shaping="info", ticks=20, training=palmares.Training(fraction=0.5))
    one = palmares.gym.FlatEnv("balls", "pinch", settings=settings)
    many: Any = gymnasium.make_vec("palmares/Balls-Pinch-v1", 1, settings=settings, threads=1)
    named = palmares.gym.FlatEnv("balls", "pinch", shaping="info", ticks=20, fraction=0.5)
    for env in (one, named):
        info = (env.reset(seed=4), env.step(env.action_space.sample() * 0.0))[1][4]
        assert info["tick"] == 20
        assert "shaping" in info
    assert one.inner.observation is not None
    assert one.world is not None
    assert named.world is not None
    assert one.world.state_hash() == named.world.state_hash()
    assert (one.fraction, named.fraction, many.fraction) == (0.5, 0.5, 0.5)
    # An argument replaces a setting.
    assert palmares.gym.BatchEnv("balls", "pinch", settings=settings, fraction=1.0).fraction == 1.0
    for make in (palmares.gym.FlatEnv, palmares.gym.BatchEnv):
        with pytest.raises(TypeError, match=r"argument 'tick': unknown, .*; did you mean 'ticks'"):
            make("balls", "pinch", tick=3)
    with pytest.raises(TypeError, match=r"argument 'teem': unknown, .*; did you mean 'team'"):
        palmares.gym.PalmaresEnv("http://127.0.0.1:9", teem="crabs")
    for refused_one in ({"threads": 2}, {"settings": palmares.gym.Settings(threads=2)}):
        with pytest.raises(TypeError, match="argument 'threads'"):
            palmares.gym.FlatEnv("balls", "pinch", **refused_one)
    with pytest.raises(ValueError, match="shaping is a setting"):
        palmares.gym.Settings(training=palmares.Training(shaping=True))
