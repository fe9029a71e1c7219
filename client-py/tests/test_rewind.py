"""A run that another host has continued from an earlier tick."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import pytest

import palmares
from palmares.net.replayed import KEPT_TICKS
from tests.fake_server import FakeServer


@pytest.fixture
def server() -> Iterator[FakeServer]:
    with FakeServer() as fake:
        yield fake


def steps(server: FakeServer) -> list[tuple[int, int, list[float]]]:
    """Return tick, repeat and command of the steps after the last greeting."""
    greeting = max(k for k, request in enumerate(server.requests) if request["op"] == "hello")
    made = [request for request in server.requests[greeting:] if request["op"] == "step"]
    return [(step["tick"], step.get("repeat", 1), step["action"].get("hand", [])) for step in made]


def played(client: palmares.Client) -> int:
    """Make eight steps of one to eight ticks; return the tick after them."""
    client.reset("balls", "softhand")
    for k in range(1, 9):
        obs = client.step(hand=[k / 10], repeat=k)
        assert obs.hand.actuators[0].position == k / 10
    assert client.tick == 36
    return 36


def test_the_steps_since_then_are_sent_again_and_the_controller_notices_nothing(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        tick = played(client)
        server.rewind_to = tick - 17
        server.drop_before.add("step")
        obs = client.step(hand=[0.9], repeat=3)
        assert (obs.tick, client.tick, obs.hand.actuators[0].position) == (tick + 3, tick + 3, 0.9)
        assert client.step().tick == tick + 4
    # Tick 19 is within the sixth step, which ends at tick 21.
    assert steps(server)[:-1] == [(19, 2, [0.6]), (21, 7, [0.7]), (28, 8, [0.8]), (36, 3, [0.9])]


def test_a_stop_comes_after_the_steps(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        tick = played(client)
        server.rewind_to = tick - 8
        server.drop_before.add("stop")
        assert client.stop().ticks == tick
    assert steps(server) == [(28, 8, [0.8])]


def test_the_rest_of_a_step_is_made(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        tick = played(client)
        server.rewind_to = tick + 30
        server.drop_before.add("step")
        assert client.step(hand=[0.9], repeat=50).tick == tick + 50
        # The server makes the ticks that are missing.
        assert steps(server) == [(tick, 50, [0.9])]
        # Both together: it goes back again, to a tick before this step.
        server.rewind_to = tick - 3
        server.drop_before.add("step")
        assert client.step(hand=[1.0]).tick == tick + 51
        assert steps(server) == [(tick - 3, 3, [0.8]), (tick, 50, [0.9]), (tick + 50, 1, [1.0])]


def test_a_connection_that_breaks_while_they_are_sent_again(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        tick = played(client)
        server.rewind_to = tick - 17
        server.drop_before.add("step")
        # The lost step, the greeting, two repeated steps.
        server.drop_at = {len(server.requests) + 4}
        assert client.step(hand=[0.9]).tick == tick + 1
    assert steps(server) == [(21, 7, [0.7]), (28, 8, [0.8]), (36, 1, [0.9])]


def test_a_pause_while_they_are_sent_again(server: FakeServer, monkeypatch: pytest.MonkeyPatch) -> None:
    paused = {"op": "error", "code": "wrong_state", "message": "paused", "retry_after_s": 0.001}
    reply, refusals = server._reply, [paused] * 5

    def refusing(request: dict[str, Any]) -> dict[str, Any]:
        if request["op"] == "step" and request["tick"] == 21 and refusals:
            return dict(refusals.pop())
        return reply(request)

    with palmares.Client(server.url) as client:
        tick = played(client)
        monkeypatch.setattr(server, "_reply", refusing)
        server.rewind_to = tick - 17
        server.drop_before.add("step")
        assert client.step(hand=[0.9]).tick == tick + 1
    assert [step for step in steps(server) if step[0] != 21] == [
        (19, 2, [0.6]),
        (28, 8, [0.8]),
        (36, 1, [0.9]),
    ]


def test_a_run_that_went_back_too_far_goes_on_where_it_is(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        client.reset("balls", "softhand")
        for _ in range(3):
            client.step(hand=[0.5], repeat=KEPT_TICKS)
        server.rewind_to = 7
        server.drop_before.add("step")
        assert client.step(hand=[0.5]).tick == 8


def test_a_new_run_forgets_the_steps_of_the_one_before(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        played(client)
        client.stop()
        client.reset("balls", "softhand")
        client.step(hand=[0.2], repeat=4)
        server.rewind_to = 1
        server.drop_before.add("step")
        assert client.step(hand=[0.3]).tick == 5
    assert steps(server) == [(1, 3, [0.2]), (4, 1, [0.3])]


@pytest.mark.parametrize("slow", [False, True])
def test_a_real_time_controller_gets_resumed(server: FakeServer, slow: bool) -> None:
    server.rewinds, server.events = {12: 9}, {5: "early", 11: "twice", 15: "late"}
    with palmares.Client(server.url) as client:
        client.reset("balls", "softhand", mode="realtime")
        # The heartbeat reads the observations meanwhile.
        while slow and not client._session.stream.over:
            time.sleep(0.02)
        received = list(client.observations())
    resumed = [obs.tick for obs in received if obs.resumed]
    kinds = [event.kind for obs in received for event in obs.events]
    if slow:
        assert (resumed, kinds) == ([20], ["early", "twice", "late"])
    else:
        assert len(resumed) == 1
        assert kinds in (["early", "twice", "late"], ["early", "twice", "twice", "late"])
