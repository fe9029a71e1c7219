"""A spectator of a server: the messages of its watch socket."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import msgspec
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from palmares.errors import ConnectionLostError, NoServerError, ProtocolError, error_of
from palmares.net.address import addresses
from palmares.net.http import error_of_response, is_loopback

SUBPROTOCOL = Subprotocol("palmares.v1.json")
OVERLAYS = ("telemetry", "contacts")


class Spectator:
    """One connection to the watch socket.

    Args:
        url: The address of the server.
        session: The session to watch; without it the featured run, then the next.
        token: The token of a spectator, a team or an organizer; practice runs need none.

    Raises:
        NoServerError: There is no server at `url`.
        PalmaresError: The server refused the spectator.

    """

    def __init__(self, url: str, *, session: str | None = None, token: str | None = None) -> None:
        server = addresses(url)
        self.url = server.http
        try:
            self._socket = connect(
                server.watch,
                subprotocols=[SUBPROTOCOL],
                additional_headers={"Authorization": f"Bearer {token}"} if token else None,
                max_size=None,
                proxy=None if is_loopback(server.http) else True,
            )
        except InvalidStatus as refused:
            body = refused.response.body or b""
            raise error_of_response(refused.response.status_code, bytes(body), server.watch) from None
        except (OSError, InvalidHandshake) as unreachable:
            raise NoServerError(
                f"no server at {self.url} ({unreachable}); is `palmares serve` running?"
            ) from None
        which = {"featured": True} if session is None else {"session_id": session}
        request = {"op": "subscribe", "id": 1, **which, "overlays": OVERLAYS}
        self._socket.send(msgspec.json.encode(request).decode())

    def messages(self) -> Iterator[dict[str, Any]]:
        """Yield the messages of the watch socket, as docs/protocol.md describes them.

        Raises:
            ConnectionLostError: The connection broke.
            PalmaresError: The server refused the subscription.

        """
        while True:
            try:
                text = self._socket.recv()
            except ConnectionClosed as lost:
                raise ConnectionLostError(f"{self.url} closed the connection: {lost}") from None
            try:
                message = msgspec.json.decode(text, type=dict[str, Any])
            except msgspec.MsgspecError as unreadable:
                raise ProtocolError(f"a message of {self.url} is not JSON: {unreadable}") from None
            if message.get("op") == "error":
                raise error_of(str(message.get("code")), str(message.get("message", "")))
            yield message

    def close(self) -> None:
        """Close the connection; `messages` ends with an error."""
        self._socket.close()
