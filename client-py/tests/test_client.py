"""The client against a server without physics."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any, Literal

import numpy as np
import pytest

import palmares
from palmares.net import link as link_module
from palmares.wire import TimeRequest
from tests.fake_server import BALLS, GREETING, FakeServer


@pytest.fixture
def server() -> Iterator[FakeServer]:
    with FakeServer() as fake:
        yield fake


def requests_until_bye(server: FakeServer) -> list[dict[str, Any]]:
    """Wait for the last request, `bye`, which has no reply, and return all of them."""
    deadline = time.monotonic() + 5.0
    while time.monotonic() < deadline and server.requests[-1]["op"] != "bye":
        time.sleep(0.01)
    return server.requests


@pytest.mark.parametrize("encoding", ["json", "msgpack"])
def test_the_truth_is_the_same_in_both_encodings(
    server: FakeServer, encoding: Literal["json", "msgpack"]
) -> None:
    with palmares.Client(server.url, encoding=encoding) as client:
        client.reset("balls", "softhand")
        truth = client.step().truth
        assert truth is not None
        assert truth.positions.tolist() == BALLS
        assert truth.quats_xyzw.tolist() == [[0.0, 0.0, 0.0, 1.0]] * 3
        assert truth.linear.shape == truth.angular.shape == (3, 3)
        assert truth.joints.position.tolist() == [0.5, 1.0]
        assert truth.joints.velocity.tolist() == [0.0, 0.0]
        assert truth.predicted_equilibrium.tolist() == [0.25, 0.75]
        ball = truth.object("ball_1")
        assert (ball.id, ball.position, ball.linear) == (1, tuple(BALLS[1]), (0.0, 0.0, 0.0))
        with pytest.raises(KeyError, match="ball_0, ball_1, ball_2"):
            truth.object("cube")
        (contact,) = truth.contacts
        assert (contact.a, contact.b) == ("palm", "ball_1")
        assert (contact.position, contact.force) == ((0.1, 0.2, 0.3), (0.0, 0.0, -2.0))
        truth.positions[0] += 1.0  # The array can be written to.
        assert truth.positions[0].tolist() == [1.0, 1.0, 1.05]


def test_a_note_on_the_name_is_logged(server: FakeServer, caplog: pytest.LogCaptureFixture) -> None:
    server.note = "`crаbs` looks like the team `crabs`"
    with palmares.Client(server.url, team="crаbs"):
        pass
    assert "`crаbs` looks like the team `crabs`" in caplog.text


def test_a_run_from_reset_to_result(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        obs = client.reset("balls", "softhand", seed=3)
        assert obs.tick == 0
        assert obs.scene is not None
        assert client.scene.region("box_b").contains(np.array([0.7, 0.0, 0.05]))
        obs = client.step(base=palmares.pose([0, 0, 0.5], [0, 0, 0, 1]), hand=np.array([0.5]))
        assert obs.hand.base.xyz == pytest.approx([0.0, 0.0, 0.5])
        assert obs.truth is not None
        assert obs.truth.positions.shape == (3, 3)
        assert client.step(repeat=10).tick == 11
        assert client.time().session_left_s is None
        assert client.stop().reason == "stopped"
        assert client.tick is None
    ops = [(request["op"], request["id"]) for request in requests_until_bye(server)]
    assert ops == [
        ("hello", 1),
        ("reset", 2),
        ("step", 3),
        ("step", 4),
        ("time", 5),
        ("stop", 6),
        ("bye", 7),
    ]
    assert server.requests[1]["seed"] == 3
    assert server.requests[2]["action"] == {
        "base": {"position": [0.0, 0.0, 0.5], "quat_xyzw": [0.0, 0.0, 0.0, 1.0]},
        "hand": [0.5],
    }
    assert server.requests[3]["action"] == {}
    assert server.requests[3]["tick"] == 1


def test_every_error_code_has_its_exception(server: FakeServer) -> None:
    kinds = {
        "bad_json": palmares.BadJsonError,
        "unknown_op": palmares.UnknownOpError,
        "bad_request": palmares.BadRequestError,
        "bad_action": palmares.BadActionError,
        "stale_tick": palmares.StaleTickError,
        "wrong_state": palmares.WrongStateError,
        "unknown_task": palmares.UnknownTaskError,
        "unknown_hand": palmares.UnknownHandError,
        "not_authorized": palmares.NotAuthorizedError,
        "session_taken": palmares.SessionTakenError,
        "session_over": palmares.SessionOverError,
        "not_scheduled": palmares.NotScheduledError,
        "capacity": palmares.CapacityError,
        "too_large": palmares.TooLargeError,
        "internal": palmares.InternalError,
        "from_the_future": palmares.PalmaresError,
    }
    with palmares.Client(server.url) as client:
        for code, kind in kinds.items():
            after = None if kind in (palmares.WrongStateError, palmares.InternalError) else 2.5
            refusal = {"op": "error", "code": code, "message": "why", "fatal": False, "retry_after_s": after}
            server.replies.append(refusal)
            with pytest.raises(kind, match=f"{code}: why") as caught:
                client.time()
            assert caught.value.code == code
            assert caught.value.retry_after_s == after
            assert not caught.value.fatal
        assert client.time().session_left_s is None


def test_late_replies_are_skipped(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        server.replies.append({"op": "obs", "id": 999})
        server.requests.clear()
        # The fake server sends one reply per request; the second request gets that of the first.
        client._link._send(TimeRequest())
        assert client.time().session_left_s is None


@pytest.mark.parametrize(
    ("when", "repeats", "tick"),
    [("before", True, 5), ("before", False, 5), ("after", True, 5), ("after", False, 6)],
)
def test_a_step_survives_a_broken_connection(
    server: FakeServer, monkeypatch: pytest.MonkeyPatch, when: str, repeats: bool, tick: int
) -> None:
    server.repeats = repeats
    monkeypatch.setattr(link_module, "RESUME_DELAYS_S", (0.0, 0.05, 0.1))
    with palmares.Client(server.url, team="crabs") as client:
        assert client.welcome.team == "crabs"
        client.reset("balls", "softhand")
        (server.drop_before if when == "before" else server.drop_after).add("step")
        obs = client.step(hand=[0.3], repeat=5)
        assert obs.tick == tick
        assert obs.hand.actuators[0].command == 0.3
        assert client.step().tick == tick + 1
    hellos = [request for request in server.requests if request["op"] == "hello"]
    assert "resume_token" not in hellos[0]
    assert hellos[1]["resume_token"] == "r"


def test_a_last_step_whose_observation_is_lost(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        client.reset("balls", "softhand")
        client.step(repeat=4)
        server.drop_after.add("step")
        server.closed_meanwhile, server.repeats = True, False
        obs = client.step(repeat=3)
        assert obs.done
        assert obs.tick == 7
        assert client.stop().ticks == 7


@pytest.mark.parametrize("repeats", [True, False])
def test_a_reset_survives_a_broken_connection(
    server: FakeServer, monkeypatch: pytest.MonkeyPatch, repeats: bool
) -> None:
    server.repeats = repeats
    monkeypatch.setattr(link_module, "RESUME_DELAYS_S", (0.0, 0.05))
    with palmares.Client(server.url) as client:
        server.drop_after.add("reset")
        obs = client.reset("balls", "softhand")
        assert obs.tick == 0
        assert obs.run is not None
        assert obs.run.seed == 77
    ops = [request["op"] for request in requests_until_bye(server)]
    again = ["reset"] if repeats else ["reset", "stop", "reset"]
    assert ops == ["hello", "reset", "hello", *again, "bye"]


def test_the_rate_limit_is_waited_for(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        limited = {"op": "error", "code": "rate_limited", "message": "slower", "retry_after_s": 0.01}
        server.replies += [limited, limited]
        assert client.time().elapsed_s == 0.0


def test_a_pause_is_waited_for_however_long(server: FakeServer, caplog: pytest.LogCaptureFixture) -> None:
    with palmares.Client(server.url) as client:
        client.reset("balls", "softhand")
        paused = {"op": "error", "code": "wrong_state", "message": "paused", "retry_after_s": 0.001}
        server.replies += [paused] * 50
        assert client.step().tick == 1
    assert [record.levelname for record in caplog.records if "paused" in record.message] == ["WARNING"]


def test_warnings_are_logged(server: FakeServer, caplog: pytest.LogCaptureFixture) -> None:
    with palmares.Client(server.url) as client:
        server.replies.append({"op": "warning", "id": None, "mark_s": 60, "session_left_s": 59.9})
        client._link._send(TimeRequest())
        client.time()
    assert "60 s of the session are left" in caplog.text


def test_a_fatal_close_is_not_resumed(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        server.replies.append({"close": "session_over"})
        with pytest.raises(palmares.SessionOverError) as caught:
            client.time()
        assert caught.value.fatal
    assert [request["op"] for request in server.requests] == ["hello", "time"]


def test_a_lost_server_is_given_up(server: FakeServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(link_module, "RESUME_DELAYS_S", (0.0, 0.05))
    with palmares.Client(server.url, reconnect_s=0.2) as client:
        assert server.server is not None
        server.drop_before.add("time")
        server.server.shutdown()
        with pytest.raises(palmares.ConnectionLostError, match="did not come back"):
            client.time()


def test_a_lost_connection_is_logged_at_once_and_once(
    server: FakeServer, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(link_module, "RESUME_DELAYS_S", (0.0, 0.05))
    with palmares.Client(server.url, reconnect_s=0.5) as client:
        assert server.server is not None
        server.drop_before.add("time")
        server.server.shutdown()
        with pytest.raises(palmares.ConnectionLostError):
            client.time()
    logged = [record for record in caplog.records if "connection lost" in record.message]
    assert len(logged) == 1
    assert "trying again for 0.5 s: no server at" in logged[0].message
    assert logged[0].created < caplog.records[-1].created + 0.5


def test_a_closed_client_stays_closed(server: FakeServer) -> None:
    for url in (server.url, "local"):
        client = palmares.Client(url)
        client.reset("balls", "softhand", seed=1)
        client.close()
        operations = [request["op"] for request in server.requests]
        for call in (
            lambda client=client: client.step(hand=[0.5]),
            lambda client=client: client.act(hand=[0.5]),
            lambda client=client: client.reset("balls", "softhand", seed=1),
            client.stop,
            client.latest,
            client.time,
        ):
            with pytest.raises(palmares.WrongStateError, match="the client is closed; make another one"):
                call()
        assert [request["op"] for request in server.requests] == operations
        client.close()


def test_a_missing_server_is_an_error_with_a_remedy() -> None:
    with pytest.raises(palmares.NoServerError, match="is `palmares serve` running"):
        palmares.Client("http://127.0.0.1:1")


def test_an_address_with_the_wrong_scheme_names_the_right_one(server: FakeServer) -> None:
    with pytest.raises(palmares.NoServerError, match=f"does not speak TLS; try {server.url}$"):
        palmares.Client(server.url.replace("http:", "https:"))
    # The address that `palmares serve` prints for controllers, with any scheme or none.
    for address in (
        f"{server.url}/v1/control",
        server.url.replace("http:", "ws:") + "/v1/control",
        server.url[7:],
    ):
        palmares.Client(address).close()


def test_a_team_that_is_no_text_is_named() -> None:
    with pytest.raises(ValueError, match="team: found 7; wanted a text"):
        palmares.Client("local", team=7)  # type: ignore[arg-type]


def test_an_invalid_address() -> None:
    with pytest.raises(ValueError, match="not the address of a server"):
        palmares.Client("ftp://example.org")


def test_step_before_reset(server: FakeServer) -> None:
    with palmares.Client(server.url) as client, pytest.raises(palmares.WrongStateError):
        client.step()


def test_an_unreadable_reply(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        server.replies.append({"op": "time", "session_left_s": "soon"})
        with pytest.raises(palmares.ProtocolError, match="cannot read"):
            client.time()


@pytest.mark.parametrize("mode", ["practice", "official"])
def test_a_competition_makes_the_client_wait_for_a_place(
    server: FakeServer, monkeypatch: pytest.MonkeyPatch, mode: str
) -> None:
    monkeypatch.setitem(GREETING["competition"], "mode", mode)
    full = {"op": "error", "code": "capacity", "message": "full", "retry_after_s": 0.001}
    with palmares.Client(server.url) as client:
        server.replies += [full] * 50
        if mode == "practice":
            with pytest.raises(palmares.CapacityError):
                client.reset("balls", "softhand")
        else:
            assert client.reset("balls", "softhand").tick == 0
            server.replies.append(full)
            with pytest.raises(palmares.CapacityError):
                client.step()
