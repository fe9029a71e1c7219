"""Connections through TCP, TLS or a proxy, and the handshake of WebSocket."""

from __future__ import annotations

import socket
import ssl
import time
from http.client import HTTPConnection

from websockets.client import ClientProtocol
from websockets.exceptions import InvalidHandshake, InvalidProxy, InvalidStatus
from websockets.protocol import OPEN
from websockets.proxy import get_proxy, parse_proxy
from websockets.uri import WebSocketURI

from palmares.net.http import is_loopback

CONNECT_TIMEOUT_S = 10.0
READ_BYTES = 64 * 1024


class Refused(Exception):  # noqa: N818 - the caller raises an error of its own instead
    """The server answered the handshake with an HTTP status.

    Attributes:
        status: The HTTP status.
        body: The body of the response.

    """

    def __init__(self, status: int, body: bytes) -> None:
        super().__init__(f"HTTP status {status}")
        self.status = status
        self.body = body


class NoWebSocket(Exception):  # noqa: N818
    """The other side does not speak the subprotocol."""


def dial(uri: WebSocketURI, url: str) -> socket.socket:
    """Open a TCP or TLS connection, through a proxy if the environment names one."""
    proxy = None if is_loopback(url) else get_proxy(uri)
    if proxy is None:
        sock = socket.create_connection((uri.host, uri.port), timeout=CONNECT_TIMEOUT_S)
    else:
        sock = _through_proxy(proxy, uri)
    try:
        # A request is one small packet; it must not wait until there is more to send.
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if uri.secure:
            return ssl.create_default_context().wrap_socket(sock, server_hostname=uri.host)
    except BaseException:
        sock.close()
        raise
    return sock


def _through_proxy(address: str, uri: WebSocketURI) -> socket.socket:
    proxy = parse_proxy(address)
    if proxy.scheme != "http":
        raise InvalidProxy(address, "only http proxies are supported; unset it for this server with NO_PROXY")
    connection = HTTPConnection(proxy.host, proxy.port, timeout=CONNECT_TIMEOUT_S)
    headers = {}
    if proxy.username is not None and proxy.password is not None:
        from websockets.headers import build_authorization_basic

        headers["Proxy-Authorization"] = build_authorization_basic(proxy.username, proxy.password)
    connection.set_tunnel(uri.host, uri.port, headers)
    connection.connect()
    return connection.sock


def handshake(sock: socket.socket, protocol: ClientProtocol, headers: dict[str, str]) -> bytes:
    """Do the opening handshake; return the bytes that came after it."""
    request = protocol.connect()
    request.headers.update(headers)
    protocol.send_request(request)
    sock.sendall(b"".join(protocol.data_to_send()))
    received = b""
    deadline = time.monotonic() + CONNECT_TIMEOUT_S
    while protocol.handshake_exc is None and protocol.state is not OPEN:
        if time.monotonic() > deadline:
            raise TimeoutError("no response to the handshake")
        data = sock.recv(READ_BYTES)
        if not data:
            protocol.receive_eof()
            break
        received += data
        head, mark, rest = received.partition(b"\r\n\r\n")
        if mark and head.startswith(b"HTTP/1.1 101"):
            # `Transport` passes the bytes after the handshake on at its first read.
            data = data[: len(data) - len(rest)]
            received = rest
        protocol.receive_data(data)
    refusal = protocol.handshake_exc
    if isinstance(refusal, InvalidStatus):
        raise Refused(refusal.response.status_code, bytes(refusal.response.body or b""))
    if isinstance(refusal, InvalidHandshake) or protocol.state is not OPEN:
        raise NoWebSocket(str(refusal or "it closed the connection during the handshake")) from refusal
    return received
