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
        self._message: Callable[[bytes | memoryview], Message] = message.decode
        self._envelope: Callable[[bytes | memoryview], Envelope] = envelope.decode

    def decode(self, data: bytes | memoryview, awaited: int | None) -> Message | None:
        """Read a message; ``None`` for one that is news of a later version, or not the `awaited` reply.

        Raises:
            msgspec.MsgspecError: The message is addressed to us and cannot be read.

        """
        try:
            return self._message(data)
        except msgspec.ValidationError:
            envelope = self._envelope(data)
            if envelope.id is not None and envelope.id == awaited:
                raise
            return None


SUBPROTOCOLS: dict[str, Encoding] = {"palmares.v1.msgpack": "msgpack", "palmares.v1.json": "json"}
"""What the encodings are called in the handshake, the one we would rather have first."""

CODECS: dict[Encoding, Codec] = {encoding: Codec(encoding) for encoding in ("json", "msgpack")}
