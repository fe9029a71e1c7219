"""The connection: encodings, tokens, heartbeat, restarts."""

from __future__ import annotations

import gc
import shutil
import ssl
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import palmares
from palmares.net import link as link_module
from palmares.net.transport import Closed
from palmares.wire import Request, TimeRequest
from tests.fake_server import FakeServer


@pytest.fixture
def server() -> Iterator[FakeServer]:
    with FakeServer() as fake:
        yield fake


@pytest.mark.parametrize("encoding", ["json", "msgpack"])
def test_both_encodings(server: FakeServer, encoding: palmares.Encoding) -> None:
    with palmares.Client(server.url, encoding=encoding) as client:
        assert client.encoding == encoding
        client.reset("balls", "softhand", seed=3)
        obs = client.step(base=palmares.pose([0, 0, 0.5], [0, 0, 0, 1]), hand=[0.5], repeat=2)
        assert obs.tick == 2
        assert obs.hand.base.position == (0.0, 0.0, 0.5)
        assert client.stop().score == 0.0


def test_the_fastest_encoding_of_the_server_is_chosen(server: FakeServer) -> None:
    both = ("palmares.v1.json", "palmares.v1.msgpack")
    for spoken, chosen in ((both, "msgpack"), (both[1:], "msgpack"), (both[:1], "json")):
        server.subprotocols = spoken
        with palmares.Client(server.url) as client:
            assert client.encoding == chosen
    with palmares.Client(server.url, encoding="json") as client:
        assert client.encoding == "json"
    with pytest.raises(palmares.NoServerError, match=r"palmares\.v1\.msgpack"):
        palmares.Client(server.url, encoding="msgpack")


def test_a_token_from_argument_or_environment(server: FakeServer, monkeypatch: pytest.MonkeyPatch) -> None:
    server.token = "s3cret"
    monkeypatch.delenv("PALMARES_TOKEN", raising=False)
    for wrong in (None, "guess"):
        with pytest.raises(palmares.NotAuthorizedError, match="PALMARES_TOKEN") as caught:
            palmares.Client(server.url, token=wrong)
        assert "guess" not in str(caught.value)
    palmares.Client(server.url, token="s3cret").close()
    monkeypatch.setenv("PALMARES_TOKEN", "s3cret")
    palmares.Client(server.url).close()


@pytest.mark.parametrize(
    ("code", "message", "kind"),
    [
        ("wrong_state", "the competition is closed; try again when it is open", palmares.WrongStateError),
        ("session_over", "the team has had all its sessions; ask the organizer", palmares.SessionOverError),
    ],
)
def test_a_refusal_of_the_session_is_raised_at_once(
    server: FakeServer, code: str, message: str, kind: type[palmares.PalmaresError]
) -> None:
    server.replies.append({"op": "error", "code": code, "message": message, "retry_after_s": 10.0})
    with pytest.raises(kind, match=message) as caught:
        palmares.Client(server.url)
    assert caught.value.retry_after_s == 10.0


def test_pings_are_answered_while_the_controller_thinks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(link_module, "HEARTBEAT_S", 0.05)
    with FakeServer(ping_interval_s=0.2) as server, palmares.Client(server.url) as client:
        client.reset("balls", "softhand")
        time.sleep(1.0)  # The fake server closes the connection after 0.2 s without a pong.
        assert client.step().tick == 1
    assert [request["op"] for request in server.requests].count("hello") == 1


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_a_client_that_is_not_closed_leaves_no_thread(
    server: FakeServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(link_module, "HEARTBEAT_S", 0.02)
    client = palmares.Client(server.url)
    heartbeat = next(thread for thread in threading.enumerate() if thread.name == "palmares-heartbeat")
    del client
    deadline = time.monotonic() + 5.0
    while heartbeat.is_alive() and time.monotonic() < deadline:
        gc.collect()
        time.sleep(0.02)
    assert not heartbeat.is_alive()


def test_the_heartbeat_resumes_a_session_whose_connection_broke(
    server: FakeServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(link_module, "HEARTBEAT_S", 0.05)
    with palmares.Client(server.url) as client:
        client.reset("balls", "softhand")
        client.step()
        client._link.abort()
        deadline = time.monotonic() + 5.0
        while [request["op"] for request in server.requests].count("hello") < 2:
            assert time.monotonic() < deadline
            time.sleep(0.02)
        assert client.step().tick == 2


def test_a_client_waits_behind_a_proxy_for_the_server_to_come_back(server: FakeServer) -> None:
    server.unavailable = 1
    with pytest.raises(palmares.NoServerError, match="HTTP status 503"):
        palmares.Client(server.url)
    with palmares.Client(server.url) as client:
        client.reset("balls", "softhand")
        server.drop_before.add("step")
        server.unavailable = 2
        assert client.step().tick == 1
    assert server.unavailable == 0


def test_a_client_whose_session_another_one_has_resumed_gives_up(server: FakeServer) -> None:
    with palmares.Client(server.url, reconnect_s=5.0) as client:
        client.reset("balls", "softhand")
        server.replies.append({"close": "session_taken"})
        for _ in range(2):
            with pytest.raises(palmares.SessionTakenError) as caught:
                client.step()
            assert caught.value.fatal
            client._link.beat()
    assert [request["op"] for request in server.requests] == ["hello", "reset", "step"]


def test_a_client_that_is_replaced_while_it_resumes_gives_up(server: FakeServer) -> None:
    with palmares.Client(server.url, reconnect_s=5.0) as client:
        client.reset("balls", "softhand")
        server.drop_before.add("step")
        server.replies.append({"close": "session_taken"})
        with pytest.raises(palmares.SessionTakenError):
            client.step()
    assert [request["op"] for request in server.requests] == ["hello", "reset", "step", "hello"]


def test_a_client_whose_heartbeat_learns_that_it_is_replaced_gives_up(
    server: FakeServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    with palmares.Client(server.url, reconnect_s=5.0) as client:
        client.reset("balls", "softhand")
        link, resume = client._link, client._link.resume

        def after_the_heartbeat(lost: Closed) -> None:
            link.beat()
            resume(lost)

        monkeypatch.setattr(link, "resume", after_the_heartbeat)
        server.drop_before.add("step")
        server.replies.append({"close": "session_taken"})
        for _ in range(2):
            with pytest.raises(palmares.SessionTakenError):
                client.step()
            link.beat()
    assert [request["op"] for request in server.requests] == ["hello", "reset", "step", "hello"]


def test_a_restart_that_voids_the_run_is_an_error(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        obs = client.reset("balls", "softhand")
        server.drop_before.add("step")
        server.forget = True
        with pytest.raises(palmares.RunLostError, match=rf"{obs.run_id} .* open another with reset"):
            client.step()
        server.forget = server.running = False
        with pytest.raises(palmares.WrongStateError):
            client.step()
        assert client.reset("balls", "softhand").tick == 0


def test_a_restart_found_by_the_heartbeat_just_before_a_request_is_an_error(
    server: FakeServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    with palmares.Client(server.url) as client:
        obs = client.reset("balls", "softhand")
        server.forget = True
        exchange, link = client._link.exchange, client._link

        def after_the_heartbeat(request: Request, kind: type[Any]) -> Any:
            monkeypatch.setattr(link, "exchange", exchange)
            link.abort()
            link.beat()
            return exchange(request, kind)

        monkeypatch.setattr(link, "exchange", after_the_heartbeat)
        with pytest.raises(palmares.RunLostError, match=str(obs.run_id)):
            client.step()


def test_a_result_that_came_without_a_request_is_what_stop_returns(server: FakeServer) -> None:
    with palmares.Client(server.url) as client:
        client.reset("balls", "softhand")
        result = server._reply({"op": "stop"}) | {"id": None, "score": 4.0}
        server.running = server.forget = True
        server.replies.append(result)
        server.drop_before.add("stop")
        client._link._send(TimeRequest())
        time.sleep(0.1)
        assert client.stop().score == 4.0


def test_a_run_left_open_by_an_earlier_program_is_stopped(
    server: FakeServer, caplog: pytest.LogCaptureFixture
) -> None:
    server.running, server.tick = True, 7
    with palmares.Client(server.url) as client:
        for _ in range(2):
            assert client.reset("balls", "softhand").tick == 0
            client.stop()
    assert [request["op"] for request in server.requests][:5] == ["hello", "stop", "reset", "stop", "reset"]
    assert [record.message for record in caplog.records if "open at tick 7" in record.message]


def test_the_error_of_a_lost_run_has_its_outcome() -> None:
    result = palmares.Result(
        run_id="r1",
        task="balls",
        hand="softhand",
        status="voided",
        score=0.0,
        in_goal=0,
        outside=0,
        reason="voided",
        ticks=3,
        sim_time_s=0.03,
        state_hash="",
        task_hash="",
        mode="lockstep",
        missed_ticks=0,
        late_ticks=0,
        late_max_s=0.0,
        dropped_obs=0,
        events=[],
    )
    assert "counts for nothing and its time is given back" in str(palmares.RunLostError.of("r1", result))
    result.status, result.reason, result.score = "practice", "disconnected", 2.0
    assert "(disconnected), score 2" in str(palmares.RunLostError.of("r1", result))


def test_tls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    openssl = shutil.which("openssl")
    if openssl is None:
        pytest.skip("no `openssl` program to make a certificate with")
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    command = [
        openssl,
        "req",
        "-x509",
        "-newkey",
        "rsa:2048",
        "-nodes",
        "-days",
        "2",
        "-subj",
        "/CN=localhost",
    ]
    command += ["-addext", "subjectAltName=IP:127.0.0.1", "-keyout", str(key), "-out", str(certificate)]
    subprocess.run(command, check=True, capture_output=True)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, key)
    with FakeServer(tls=context) as server:
        with pytest.raises(palmares.NoServerError, match=r"not trusted .*SSL_CERT_FILE"):
            palmares.Client(server.url)
        monkeypatch.setenv("SSL_CERT_FILE", str(certificate))
        with palmares.Client(server.url) as client:
            client.reset("balls", "softhand", mode="realtime")
            assert [obs.tick for obs in client.observations()][-1] == 20
            client.stop()


def test_a_fault_that_lost_nothing_is_tried_again(
    server: FakeServer, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    waited: list[float] = []
    monkeypatch.setattr(time, "sleep", waited.append)
    failed = {
        "op": "error",
        "code": "internal",
        "message": "nothing was lost, try again",
        "retry_after_s": 1.0,
    }
    server.replies += [failed] * 2  # The greeting, too.
    with palmares.Client(server.url) as client:
        server.replies += [failed] * 3
        assert client.reset("balls", "softhand").tick == 0
        server.replies += [failed] * 2
        assert client.step(hand=[0.5]).tick == 1
        assert waited == [1.0, 1.0, 1.0, 1.0, 2.0, 1.0, 1.0]
        server.replies += [failed] * 20
        with pytest.raises(palmares.InternalError, match="nothing was lost, try again; tried 7 times"):
            client.stop()
        assert len(server.replies) == 13
        server.replies.clear()
        assert client.stop().ticks == 1
        server.replies.append(failed | {"retry_after_s": None})
        with pytest.raises(palmares.InternalError):
            client.time()
    assert "try 1 failed, trying again in 1 s: internal: nothing was lost" in caplog.text
