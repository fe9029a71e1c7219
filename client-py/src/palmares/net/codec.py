"""The two encodings of messages: JSON in text frames, MessagePack in binary frames."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, TypeAlias

import msgspec

from palmares.messages import Observation, Result, Welcome
from palmares.wire import Ack, ErrorMessage, SessionWarning, Time

Message: TypeAlias = Observation | Ack | Result | Time | Welcome | ErrorMessage | SessionWarning
"""Any message of the server; `op` selects the type in one pass over the bytes"""

Encoding: TypeAlias = Literal["json", "msgpack"]


class Envelope(msgspec.Struct, kw_only=True):
    """The fields that every message from the server has."""

    op: str
    id: int | None = None


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
        self.message: Callable[[bytes], Message] = message.decode
        """Decodes a message; raises `msgspec.MsgspecError` if that fails"""
        self._envelope: Callable[[bytes], Envelope] = envelope.decode

    def is_fault(self, unreadable: bytes, awaited: int | None) -> bool:
        """Whether an undecodable message is an error: the `awaited` reply, or no message at all.

        All others are ignored: messages of a later version, or replies to requests that timed out.
        """
        try:
            envelope = self._envelope(unreadable)
        except msgspec.MsgspecError:
            return True
        return envelope.id is not None and envelope.id == awaited


SUBPROTOCOLS: dict[str, Encoding] = {"palmares.v1.msgpack": "msgpack", "palmares.v1.json": "json"}
"""Subprotocol of each encoding in the handshake, the preferred one first"""

CODECS: dict[Encoding, Codec] = {encoding: Codec(encoding) for encoding in ("json", "msgpack")}
