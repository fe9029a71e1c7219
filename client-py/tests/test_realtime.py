"""Real-time runs, against a server without physics."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest

import palmares
from palmares.net.stream import Stream
from tests.fake_server import FakeServer


@pytest.fixture
def server() -> Iterator[FakeServer]:
    with FakeServer() as fake:
        yield fake


def test_a_run_in_real_time(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        assert client.reset("balls", "softhand", mode="realtime").tick == 0
        ticks = []
        for obs in client.observations():
            ticks.append(obs.tick)
            if not obs.done:
                client.act(hand=[0.01 * obs.tick])
        assert ticks == sorted(set(ticks))
        assert ticks[-1] == 20
        assert len(ticks) + client.skipped == 20
        assert client.stop().ticks == 20
    assert any(request["op"] == "act" for request in server.requests)


def test_a_slow_controller_sees_the_newest_and_every_event(server: FakeServer) -> None:
    server.ticks, server.events = 400, {3: "in_goal", 9: "left_goal"}
    with palmares.Client(server.url) as client:
        client.reset("balls", "softhand", mode="realtime")
        next(client.observations())
        while server.tick < 60:
            time.sleep(0.05)
        behind = server.tick
        obs = next(client.observations())
        # The newest received observation, not the first: the backlog was skipped.
        assert behind > 40
        assert obs.tick >= behind - 20
        assert [event.kind for event in obs.events] == ["in_goal", "left_goal"]
        assert client.skipped >= obs.tick - 5
        client.stop()


def test_the_backlog_is_read_while_the_controller_thinks(server: FakeServer) -> None:
    server.ticks, server.realtime_tick_s = 2000, 0.0
    with palmares.Client(server.url) as client:
        client.reset("balls", "softhand", mode="realtime")
        deadline = time.monotonic() + 20.0
        # The sockets' buffers are too small for this run: it ends only because the heartbeat reads.
        while server.tick < 2000 and time.monotonic() < deadline:
            time.sleep(0.05)
        assert server.tick == 2000
        obs = client.latest()
        while not obs.done:
            obs = client.latest()
        assert obs.tick == 2000
        client.stop()


def test_latest_returns_the_last_observation_again(server: FakeServer) -> None:
    server.ticks = 1
    with palmares.Client(server.url) as client:
        with pytest.raises(palmares.WrongStateError):
            client.latest()
        first = client.reset("balls", "softhand", mode="realtime")
        obs = first
        while not obs.done:
            obs = client.latest()
        assert client.latest() is obs
        client.stop()


def test_an_action_after_the_end_is_no_error_before_the_end_is_read(server: FakeServer) -> None:
    server.ticks = 1
    with palmares.Client(server.url) as client:
        client.reset("balls", "softhand", mode="realtime")
        time.sleep(0.1)
        server.replies.append({"op": "error", "code": "wrong_state", "message": "the run is over"})
        client.act(hand=[0.5])
        assert client.latest().done
        server.replies.append({"op": "error", "code": "wrong_state", "message": "the run is over"})
        with pytest.raises(palmares.WrongStateError):
            client.act(hand=[0.5])
        client.stop()


def test_a_run_in_real_time_goes_on_after_the_connection_broke(server: FakeServer) -> None:
    server.ticks = 10_000
    with palmares.Client(server.url) as client:
        client.reset("balls", "softhand", mode="realtime")
        next(client.observations())
        client._link.abort()
        assert client.act(hand=[0.5]) > 0
        client.stop()
    assert [request["op"] for request in server.requests if request["op"] == "hello"] == ["hello"] * 2


def test_a_run_that_ended_while_the_connection_was_broken(server: FakeServer) -> None:
    server.ticks = 10_000
    with palmares.Client(server.url) as client:
        client.reset("balls", "softhand", mode="realtime")
        observations = client.observations()
        tick = next(observations).tick
        server.closed_meanwhile = True
        client._link.abort()
        *_, last = observations
        assert last.done
        assert last.tick >= tick
        assert client.stop().reason == "stopped"


def test_a_perturbation_goes_over_the_wire(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        client.reset("balls", "softhand")
        client.perturb("palm", force=[0, 0, 1.0], duration_s=0.2)
    push = next(request for request in server.requests if request["op"] == "perturb")
    assert push["link"] == "palm"
    assert push["wrench"] == {"force": [0.0, 0.0, 1.0], "torque": [0.0, 0.0, 0.0]}


def test_an_observation_of_another_run_is_ignored() -> None:
    stream = Stream()
    stream.open("run-2")
    with FakeServer() as server, palmares.Client(server.url) as client:
        stream.put(client.reset("balls", "softhand"))
    assert stream.take() is None


@pytest.mark.parametrize("where", ["local", "server"])
def test_observations_of_a_lockstep_run_are_an_error_at_once(server: FakeServer, where: str) -> None:
    with palmares.Client(where if where == "local" else server.url) as client:
        with pytest.raises(palmares.WrongStateError, match="no run is open"):
            client.observations()
        client.reset("balls", "softhand", seed=1)
        with pytest.raises(palmares.WrongStateError, match=r"waits for `step`.*mode='realtime'"):
            client.observations()
        assert client.step(hand=[0.5]).tick == 1


def test_a_hand_that_was_held_was_not_clipped(server: FakeServer) -> None:
    server.ticks = 60
    with palmares.Client(server.url) as client:
        client.reset("balls", "softhand", mode="realtime")
        hold_ticks = client.welcome.limits.hold_ticks
        tick = client.act(hand=[0.75])
        server.sigma = 0.25  # The server stops the hand.
        deadline = time.monotonic() + 10.0
        while not client._session.stream.over and time.monotonic() < deadline:
            time.sleep(0.02)
        with pytest.warns(
            palmares.HeldHandWarning, match=f"no action came for more than {hold_ticks} ticks"
        ) as caught:
            for _ in client.observations():
                pass
        assert f"after that of tick {tick}" in str(caught[0].message)
        assert not [warning for warning in caught if warning.category is palmares.ClippedActionWarning]
