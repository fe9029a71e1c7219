"""What is wrong with an argument is told by its name, and changes nothing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import palmares
from palmares.local import REPEAT
from palmares.training import Training
from tests.fake_server import FakeServer
from tests.real_server import RealServer, needs_server

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

# NumPy's whole numbers are as good as Python's own.
MANY: Any = np.int64(REPEAT)


def test_a_seed_that_is_none_changes_nothing() -> None:
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


def test_a_run_that_is_over_says_what_to_do() -> None:
    with palmares.Client("local") as client:
        client.reset("grasp", "pinch", seed=1)
        assert client.world is not None
        client.world.step(repeat=12_000)
        with pytest.raises(palmares.WrongStateError, match=r"the run is over; stop\(\) returns its result"):
            client.step()
        with pytest.raises(palmares.WrongStateError, match=r"the run is over; result\(\)"):
            client.world.step()


def test_numbers_that_are_not_finite_are_told_as_they_are() -> None:
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
    with FakeServer() as server, pytest.raises(ValueError, match="no server offers it"):
        palmares.Client(server.url, training=Training())
