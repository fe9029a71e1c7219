"""Clients that violate the protocol must not affect a client that plays."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Callable, Iterator
from urllib.parse import urlsplit

import pytest

import palmares
from palmares.net.codec import CODECS
from palmares.net.transport import Closed, Transport
from palmares.wire import HelloRequest, TimeRequest
from tests.real_server import RealServer, needs_server

pytestmark = needs_server

JSON = CODECS["json"]


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with RealServer(tmp_path_factory.mktemp("data"), "--resume-grace-s", "1") as server:
        yield server.url


def connection(url: str, timeout_s: float = 5.0) -> Transport:
    return Transport.connect(f"ws{url.removeprefix('http')}/v1/control", ["palmares.v1.json"], {}, timeout_s)


def plain(url: str) -> socket.socket:
    address = urlsplit(url)
    return socket.create_connection((address.hostname, address.port), timeout=5.0)


def read_on(transport: Transport) -> None:
    while True:
        transport.recv()


def nonsense_after_the_handshake(url: str) -> None:
    transport = connection(url)
    transport._socket.sendall(os.urandom(4096))
    with pytest.raises(Closed):
        read_on(transport)


def frames_without_a_mask(url: str) -> None:
    transport = connection(url)
    transport._socket.sendall(b"\x81\x02{}")
    with pytest.raises(Closed):
        read_on(transport)


def half_a_frame_and_then_nothing(url: str) -> None:
    transport = connection(url)
    transport._socket.sendall(b"\x81\xfe\xff")
    transport.abort()


def a_frame_that_claims_to_be_endless(url: str) -> None:
    transport = connection(url)
    transport._socket.sendall(b"\x81\xff\x7f" + b"\xff" * 7 + b"mask" + b"x" * 1000)
    with pytest.raises(Closed):
        read_on(transport)


def requests_whose_replies_are_not_read(url: str) -> None:
    transport = connection(url, timeout_s=0.5)
    transport.send(JSON.encode(HelloRequest(id=1, client={"name": "deaf"})), binary=False)
    request = JSON.encode(TimeRequest(id=2))

    def ask_on() -> None:
        for _ in range(2_000_000):
            transport.send(request, binary=False)

    # The server reads no request before it has sent the last reply, so this client has to wait at the end.
    with pytest.raises(Closed):
        ask_on()


def a_storm_of_pings(url: str) -> None:
    transport = connection(url)
    for _ in range(20_000):
        transport._protocol.send_ping(b"x" * 100)
        transport._socket.sendall(b"".join(transport._protocol.data_to_send()))
        transport.recv_within(0.0)
    transport.close()


def handshakes_left_half_way(url: str) -> None:
    for count in range(200):
        with plain(url) as sock:
            sock.sendall(b"GET /v1/control HTTP/1.1\r\nHost: x\r\n"[: 5 + count % 30])


def no_http_at_all(url: str) -> None:
    for _ in range(50):
        with plain(url) as sock:
            sock.sendall(os.urandom(2000))
            sock.recv(1000)


@pytest.mark.parametrize(
    "misbehave",
    [
        nonsense_after_the_handshake,
        frames_without_a_mask,
        half_a_frame_and_then_nothing,
        a_frame_that_claims_to_be_endless,
        requests_whose_replies_are_not_read,
        a_storm_of_pings,
        handshakes_left_half_way,
        no_http_at_all,
    ],
)
def test_a_client_that_plays_is_not_affected(url: str, misbehave: Callable[[str], None]) -> None:
    failures: list[BaseException] = []

    def run() -> None:
        try:
            misbehave(url)
        except BaseException as error:  # Checked below, in pytest's thread.
            failures.append(error)

    with palmares.Client(url, timeout_s=10.0, reconnect_s=0.0) as client:
        client.reset("balls", "softhand", seed=1)
        other = threading.Thread(target=run)
        other.start()
        ticks = 0
        while other.is_alive() or ticks < 20:
            ticks += 1
            assert client.step(hand=[0.3]).tick == ticks
        other.join()
        result = client.stop()
        assert (result.ticks, result.reason) == (ticks, "stopped")
    assert not failures, failures
