"""How messages are written: as JSON in text frames or as MessagePack in binary frames."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, TypeAlias

import msgspec

from palmares.messages import (
    Ack,
    Envelope,
    ErrorMessage,
    Observation,
    Result,
    SessionWarning,
    Time,
    Welcome,
)

Message: TypeAlias = Observation | Ack | Result | Time | Welcome | ErrorMessage | SessionWarning
"""What a server says; told apart by `op`, in one pass over the bytes."""

Encoding: TypeAlias = Literal["json", "msgpack"]


class Codec:
    """One of the two encodings."""

    def __init__(self, encoding: Encoding) -> None:
        self.encoding = encoding
        self.binary = encoding == "msgpack"
        encoder: msgspec.json.Encoder | msgspec.msgpack.Encoder
        message: msgspec.json.Decoder[Message] | msgspec.msgpack.Decoder[Message]
        envelope: msgspec.json.Decoder[Envelope] | msgspec.msgpack.Decoder[Envelope]
        if self.binary:
            encoder = msgspec.msgpack.Encoder()
            message, envelope = msgspec.msgpack.Decoder(Message), msgspec.msgpack.Decoder(Envelope)
        else:
            encoder = msgspec.json.Encoder()
            message, envelope = msgspec.json.Decoder(Message), msgspec.json.Decoder(Envelope)
        self.encode: Callable[[Any], bytes] = encoder.encode
        self.message: Callable[[bytes | memoryview], Message] = message.decode
        """Reads a message; raises `msgspec.MsgspecError` if it cannot."""
        self._envelope: Callable[[bytes | memoryview], Envelope] = envelope.decode

    def concerns(self, unreadable: bytes | memoryview, awaited: int | None) -> bool:
        """Whether a message that cannot be read had to be: the `awaited` reply, or no message at all.

        Others are news of a later version, or replies to requests given up.
        """
        try:
            envelope = self._envelope(unreadable)
        except msgspec.MsgspecError:
            return True
        return envelope.id is not None and envelope.id == awaited


SUBPROTOCOLS: dict[str, Encoding] = {"palmares.v1.msgpack": "msgpack", "palmares.v1.json": "json"}
"""What the encodings are called in the handshake, the one we would rather have first."""

CODECS: dict[Encoding, Codec] = {encoding: Codec(encoding) for encoding in ("json", "msgpack")}
