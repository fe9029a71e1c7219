"""Frames, against a socket that sends frames of an incorrect server."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from websockets.frames import Close, Frame, Opcode
from websockets.server import ServerProtocol
from websockets.typing import Subprotocol

from palmares.net.dial import NoWebSocket
from palmares.net.transport import Closed, Transport

Talk = Callable[[socket.socket], None]


@contextmanager
def server(talk: Talk, greeting: bytes = b"") -> Iterator[Transport]:
    """Yield a connection to a peer that does the handshake and then calls `talk`."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve() -> None:
            peer, _ = listener.accept()
            with peer:
                protocol = ServerProtocol(subprotocols=[Subprotocol("test")])
                while not (events := protocol.events_received()):
                    protocol.receive_data(peer.recv(4096))
                protocol.send_response(protocol.accept(events[0]))  # type: ignore[arg-type]
                peer.sendall(b"".join(protocol.data_to_send()) + greeting)
                talk(peer)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        url = f"ws://127.0.0.1:{listener.getsockname()[1]}/"
        transport = Transport.connect(url, ["test"], {}, timeout_s=2.0)
        try:
            yield transport
        finally:
            transport.close()
            thread.join(5.0)


def say_nothing(_: socket.socket) -> None:
    pass


def frame(opcode: Opcode, data: bytes, fin: bool = True) -> bytes:
    return Frame(opcode, data, fin).serialize(mask=False)


def test_a_message_that_comes_with_the_handshake() -> None:
    with server(say_nothing, frame(Opcode.TEXT, b"early")) as transport:
        assert bytes(transport.recv()) == b"early"


@pytest.mark.parametrize("size", [0, 1, 125, 126, 65535, 65536, 3_000_000])
def test_messages_of_any_size_in_any_pieces(size: int) -> None:
    data = bytes(i % 251 for i in range(size))

    def talk(peer: socket.socket) -> None:
        whole = frame(Opcode.BINARY, data) + frame(Opcode.TEXT, b"next")
        for start, end in ((0, 1), (1, 3), (3, 9), (9, len(whole) - 5), (len(whole) - 5, len(whole))):
            peer.sendall(whole[start:end])

    with server(talk) as transport:
        assert bytes(transport.recv()) == data
        assert bytes(transport.recv()) == b"next"


def test_many_messages_in_one_packet_and_nothing_more() -> None:
    def talk(peer: socket.socket) -> None:
        peer.sendall(b"".join(frame(Opcode.TEXT, b"%d" % i) for i in range(50)))
        peer.recv(1)

    with server(talk) as transport:
        assert [bytes(transport.recv()) for _ in range(50)] == [b"%d" % i for i in range(50)]
        assert transport.recv_within(0.0) is None


def test_fragments_with_a_ping_between() -> None:
    answers: list[bytes] = []

    def talk(peer: socket.socket) -> None:
        peer.sendall(frame(Opcode.TEXT, b"one ", fin=False))
        peer.sendall(frame(Opcode.PING, b"hi"))
        peer.sendall(frame(Opcode.CONT, b"two ", fin=False) + frame(Opcode.CONT, b"three"))
        answers.append(peer.recv(100))

    with server(talk) as transport:
        assert bytes(transport.recv()) == b"one two three"
    assert answers[0][0] == 0x8A  # A pong,
    assert answers[0][1] == 0x82  # masked, of two bytes.


def test_pings_do_not_count_as_an_answer() -> None:
    def talk(peer: socket.socket) -> None:
        for _ in range(30):
            peer.sendall(frame(Opcode.PING, b""))
            if stop.wait(0.2):
                return

    stop = threading.Event()
    with server(talk) as transport:
        with pytest.raises(TimeoutError):
            transport.recv()
        stop.set()


def test_a_close_frame_gives_the_reason_even_after_the_pipe_broke() -> None:
    def talk(peer: socket.socket) -> None:
        peer.sendall(frame(Opcode.TEXT, b"last"))
        peer.sendall(frame(Opcode.CLOSE, Close(4410, "session_over").serialize()))

    with server(talk) as transport:
        transport._socket.shutdown(socket.SHUT_WR)
        with pytest.raises(Closed) as caught:
            transport.send(b"too late", binary=False)
        assert (caught.value.code, caught.value.reason) == (4410, "session_over")
        assert transport.unread == [b"last"]
        with pytest.raises(Closed):
            transport.recv()


@pytest.mark.parametrize(
    "nonsense",
    [
        b"\x83\x00",  # an opcode that is none
        b"\xc1\x00",  # a reserved bit
        b"\x81\x81abcd\x00",  # masked, which servers must not
        b"\x80\x00",  # the end of a fragment that never began
        b"\x82\x7f" + b"\xff" * 8,  # more bytes than there are
    ],
)
def test_invalid_frames_close_the_connection(nonsense: bytes) -> None:
    with server(lambda peer: peer.sendall(nonsense)) as transport, pytest.raises(Closed):
        transport.recv()


def test_a_server_that_closes_the_connection() -> None:
    with server(say_nothing) as transport, pytest.raises(Closed, match="closed the connection"):
        transport.recv()


def test_a_server_of_another_protocol() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve() -> None:
            peer, _ = listener.accept()
            with peer:
                peer.sendall(b"220 mail.example.org ESMTP\r\n\r\n")

        threading.Thread(target=serve, daemon=True).start()
        with pytest.raises(NoWebSocket):
            Transport.connect(f"ws://127.0.0.1:{listener.getsockname()[1]}/", ["test"], {}, 2.0)
