"""A client without a server plays the same runs."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

import palmares
from palmares.examples import grasp_softhand
from palmares.sim import World
from tests.real_server import PROGRAM, RealServer, needs_server

PINCH = str(Path(__file__).parents[2] / "models/hands/pinch")


def played(client: palmares.Client) -> palmares.Result:
    obs = client.reset("balls", "softhand", seed=5)
    rng = np.random.default_rng(0)
    for _ in range(5):
        above = obs.hand.base.xyz + rng.normal(0.0, 0.02, 3)
        base = palmares.pose(above, obs.hand.base.quat_xyzw)
        obs = client.step(base=base, hand=rng.uniform(size=1), repeat=7)
    return client.stop()


@needs_server
def test_a_run_is_the_same_on_a_server_and_in_this_process(tmp_path: Path) -> None:
    with RealServer(tmp_path) as server, palmares.Client(server.url) as far, palmares.Client("local") as near:
        theirs, ours = played(far), played(near)
        assert (ours.state_hash, ours.score, ours.ticks) == (theirs.state_hash, theirs.score, theirs.ticks)
        assert ours.events == theirs.events
        assert near.welcome.tasks == far.welcome.tasks
        assert near.welcome.hands == far.welcome.hands
        assert near.welcome.specs == far.welcome.specs
        assert near.welcome.server == far.welcome.server
        assert near.describe_hand("reflex") == far.describe_hand("reflex")
        for client in (near, far):
            client.save_replay(tmp_path / "run.mcap")
            verified = subprocess.run(
                [str(PROGRAM), "verify", tmp_path / "run.mcap"], capture_output=True, text=True, check=False
            )
            assert verified.returncode == 0, verified.stdout + verified.stderr


def test_an_example_plays_without_a_server() -> None:
    with palmares.Client("local") as client:
        summary = grasp_softhand.run(client, 3)
        assert client.result is not None
        assert summary.score == client.result.score
        assert summary.seed == 3


def test_the_world_of_a_local_client_is_accessible() -> None:
    with palmares.Client("local") as client:
        assert client.world is None
        client.reset("balls", "softhand", seed=1)
        assert isinstance(client.world, World)
        kept = client.world.snapshot()
        client.step(hand=[1.0], repeat=20)
        after = client.world.state_hash()
        client.world.restore(kept)
        for _ in range(20):
            client.world.step(hand=[1.0])
        assert client.world.state_hash() == after


def test_a_hand_of_ones_own_is_given_by_its_path() -> None:
    with palmares.Client("local") as client:
        obs = client.reset("balls", PINCH, seed=1)
        assert len(obs.hand.actuators) == 2
        assert client.run.hand == "pinch"
        assert client.welcome.hands[-1].motors == client.welcome.hand("pinch").motors


def test_it_refuses_as_a_server_does() -> None:
    with palmares.Client("local") as client:
        with pytest.raises(palmares.WrongStateError):
            client.stop()
        with pytest.raises(palmares.UnknownTaskError, match="balls"):
            client.reset("bowls", "softhand")
        with pytest.raises(palmares.UnknownHandError, match="softhand"):
            client.reset("balls", "softhat")
        with pytest.raises(palmares.BadRequestError, match="2\\*\\*53"):
            client.reset("balls", "softhand", seed=2**53)
        with pytest.raises(palmares.BadRequestError, match="realtime"):
            client.reset("balls", "softhand", mode="realtime")
        client.reset("balls", "softhand")
        with pytest.raises(palmares.WrongStateError):
            client.reset("balls", "softhand")
        with pytest.raises(palmares.BadActionError):
            client.step(hand=[0.1, 0.2])
        with pytest.raises(palmares.UnknownCameraError):
            client.step(cameras="nose")
        with pytest.raises(palmares.WrongStateError):
            client.observations()  # Only in real time.
        with pytest.raises(palmares.WrongStateError):
            client.leaderboard()
        with pytest.raises(palmares.WrongStateError):
            client.save_replay("nowhere.mcap")
        assert client.time().run is not None


def test_abandoning_opens_the_way_for_another_run() -> None:
    with palmares.Client("local") as client:
        client.reset("balls", "softhand", seed=1)
        client.abandon()
        assert client.tick is None
        client.reset("balls", "softhand", seed=2)
        assert client.run.seed == 2
