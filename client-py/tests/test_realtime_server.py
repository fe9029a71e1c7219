"""Real-time runs on the real server."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest

import palmares
from tests.real_server import RealServer, needs_server

pytestmark = needs_server


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with RealServer(tmp_path_factory.mktemp("data")) as server:
        yield server.url


@pytest.mark.parametrize("encoding", ["json", "msgpack"])
def test_the_world_runs_by_the_clock(url: str, encoding: palmares.Encoding) -> None:
    with palmares.Client(url, encoding=encoding) as client:
        first = client.reset("balls", "softhand", mode="realtime", seed=1)
        assert first.run is not None
        assert first.run.mode == "realtime"
        ticks, closing = [0], 0
        for obs in client.observations():
            assert obs.truth is not None
            ticks.append(obs.tick)
            if obs.tick >= 60:
                break
            closing = client.act(hand=[0.4])
            assert closing > obs.tick
        assert ticks == sorted(set(ticks))
        assert obs.applied_action.hand == [0.4]
        result = client.stop()
        assert result.mode == "realtime"
        assert result.ticks >= 60
        assert result.missed_ticks <= result.ticks


def test_each_mode_has_its_call(url: str) -> None:
    with palmares.Client(url) as client:
        client.reset("balls", "softhand", mode="realtime")
        with pytest.raises(palmares.WrongStateError):
            client.step()
        client.stop()
        client.reset("balls", "softhand")
        with pytest.raises(palmares.WrongStateError):
            client.act(hand=[0.1])
        client.stop()


def test_an_invalid_action_is_an_error(url: str) -> None:
    with palmares.Client(url) as client:
        client.reset("balls", "softhand", mode="realtime")
        for bad in ([0.1, 0.2], [float("nan")]):
            with pytest.raises(palmares.BadActionError):
                client.act(hand=bad)
        assert client.act(hand=[0.1]) > 0
        client.stop()


def test_a_client_that_stops_reading_misses_observations_and_nothing_else(url: str) -> None:
    with palmares.Client(url, encoding="json") as client:
        client.reset("balls", "softhand", mode="realtime", seed=1)
        with client._link._lock:  # Neither the controller nor the heartbeat can read.
            time.sleep(2.0)
        ticks = [next(client.observations()).tick for _ in range(3)]
        assert ticks == sorted(set(ticks))
        client.act(hand=[0.2])
        result = client.stop()
        assert result.ticks >= ticks[-1]
        assert client.skipped + result.dropped_obs > 0


def test_a_pulled_cable_in_real_time(url: str) -> None:
    with palmares.Client(url) as client:
        run_id = client.reset("balls", "softhand", mode="realtime").run_id
        tick = next(client.observations()).tick
        for _ in range(2):
            client._link.abort()
            obs = next(client.observations())
            # The world continued meanwhile.
            assert obs.run_id == run_id
            assert obs.tick > tick
            tick = obs.tick
        assert client.stop().run_id == run_id


def test_a_perturbation_is_measured_at_the_wrist(url: str) -> None:
    with palmares.Client(url) as client:
        client.reset("balls", "softhand", seed=1)
        calm = client.step(repeat=20).hand.wrist.force[0]
        links = [link["name"] for link in client.describe_hand("softhand")["links"]]
        client.perturb(links[0], force=[20.0, 0, 0], duration_s=1.0)
        pushed = client.step(repeat=20).hand.wrist.force[0]
        assert abs(pushed - calm) > 10.0
        with pytest.raises(palmares.PalmaresError, match="elbow"):
            client.perturb("elbow", force=[1.0, 0, 0])
        client.stop()
