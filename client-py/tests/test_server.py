"""The client against the real server, over a real socket."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import palmares
from tests.real_server import RealServer, needs_server

pytestmark = needs_server


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with RealServer(tmp_path_factory.mktemp("data")) as server:
        yield server.url


def test_a_run_and_its_place_on_the_leaderboard(url: str) -> None:
    with palmares.Client(url, team="pytest") as client:
        assert client.welcome.team == "pytest"
        assert client.encoding == "msgpack"
        assert "balls" in [task.name for task in client.welcome.tasks]
        obs = client.reset("balls", "softhand", seed=5)
        assert obs.tick == 0
        assert obs.run is not None
        assert obs.run.seed == 5
        assert obs.truth is not None
        assert obs.truth.positions.shape == (10, 3)
        box_a = client.scene.region("box_a")
        assert all(box_a.contains(center) for center in obs.truth.positions)

        up = obs.hand.base.xyz + np.array([0.0, 0.0, 0.01])
        obs = client.step(base=palmares.pose(up, obs.hand.base.quat_xyzw), hand=np.array([0.2]))
        assert obs.tick == 1
        assert obs.applied_action.hand == [0.2]
        obs = client.step(repeat=30)
        assert obs.sim_time_s == pytest.approx(0.31)
        assert obs.hand.base.xyz == pytest.approx(up, abs=2e-3)
        assert obs.hand.actuators[0].position == pytest.approx(0.2, abs=1e-3)

        time = client.time()
        assert time.session_left_s is None
        assert time.run is not None
        assert time.run.tick == 31
        result = client.stop()
        assert (result.status, result.reason, result.score) == ("practice", "stopped", 0.0)

        row = next(row for row in client.leaderboard() if row.team == "pytest")
        assert row.tasks["balls"].run_id == result.run_id


def test_limits_and_constants_come_from_the_server(url: str) -> None:
    with palmares.Client(url) as client:
        welcome = client.welcome
        low, high = welcome.specs.action_field("base.linear").range
        assert -low == high > 0.0
        assert welcome.specs.action_field("hand").range == (0.0, 1.0)
        with pytest.raises(KeyError, match=r"there are: base\.position"):
            welcome.specs.action_field("base.spin")
        units = {field.name: (field.shape, field.unit) for field in welcome.specs.observation}
        assert units["truth.joints.velocity"] == (["joints"], "rad/s")
        assert welcome.server.version
        assert welcome.limits.ping_timeout_s is not None
        hand, task = welcome.hand("softhand"), welcome.task("balls")
        assert task.step_s <= task.tick_s

        obs = client.reset("balls", "softhand", seed=1)
        assert (client.run.tick_s, client.run.time_limit_s) == (task.tick_s, task.time_limit_s)
        assert (client.run.seed, client.run.mode) == (1, "lockstep")
        assert [motor.name for motor in obs.hand.actuators] == hand.motors
        assert obs.truth is not None
        assert obs.truth.joints.position.shape == (len(hand.joints),)
        # A velocity beyond the limit is clipped.
        obs = client.step(base=palmares.twist([10.0 * high, 0, 0], [0, 0, 0]))
        assert obs.applied_action.base is not None
        assert obs.applied_action.base.linear == pytest.approx((high, 0.0, 0.0))
        client.stop()
        assert client.time().refunded_s == 0.0


def test_a_run_goes_on_after_the_connection_broke(url: str) -> None:
    with palmares.Client(url) as client:
        obs = client.reset("balls", "softhand", seed=2)
        assert obs.truth is not None
        assert [body.name for body in obs.truth.objects] == [body.name for body in client.scene.free]
        client.step(hand=[0.5], repeat=20)
        client._link.abort()
        assert client.step(repeat=20).sim_time_s == pytest.approx(0.4)
        client.stop()


def test_same_seed_and_actions_same_bits(url: str) -> None:
    hashes = set()
    with palmares.Client(url) as client:
        for _ in range(2):
            client.reset("balls", "softhand", seed=9)
            client.step(base=palmares.twist([0.1, 0, -0.2], [0, 0, 0.5]), hand=[0.7], repeat=40)
            hashes.add(client.stop().state_hash)
    assert len(hashes) == 1


def test_sensors_show_no_truth(url: str) -> None:
    with palmares.Client(url) as client:
        obs = client.reset("balls", "softhand", sensing="sensors")
        assert not obs.has_truth
        with pytest.raises(palmares.NoTruthError, match="sensing='sensors'"):
            print(obs.truth.positions)
        assert getattr(obs, "truth", None) is None
        client.stop()


def test_refusals_leave_the_run_unharmed(url: str) -> None:
    with palmares.Client(url) as client:
        with pytest.raises(palmares.UnknownTaskError):
            client.reset("juggling", "softhand")
        with pytest.raises(palmares.UnknownHandError):
            client.reset("balls", "claw")
        with pytest.raises(palmares.WrongStateError):
            client.stop()
        client.reset("balls", "softhand", seed=1)
        with pytest.raises(palmares.WrongStateError):
            client.reset("balls", "softhand", seed=2)
        client._session.tick = 0
        with pytest.raises(palmares.BadActionError):
            client.step(hand=[0.1, 0.2])
        with pytest.raises(palmares.BadActionError):
            client.step(hand=[float("nan")])
        with pytest.raises(palmares.BadRequestError):
            client.step(repeat=0)
        assert client.step(hand=[0.1]).tick == 1
        assert client.stop().ticks >= 1


def test_the_hand_is_described(url: str) -> None:
    with palmares.Client(url) as client:
        hand = client.describe_hand("softhand")
        assert hand["name"] == "softhand"
        with pytest.raises(palmares.UnknownHandError):
            client.describe_hand("claw")
