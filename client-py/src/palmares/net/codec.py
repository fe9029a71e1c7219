"""The two encodings of messages: JSON in text frames, MessagePack in binary frames."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal, TypeAlias

import msgspec

from palmares.messages import HandState, Observation, Result, Specs, Welcome
from palmares.wire import Ack, ErrorMessage, SessionWarning, Time

Others: TypeAlias = Ack | Result | Time | Welcome | ErrorMessage | SessionWarning
Message: TypeAlias = Observation | Others
"""Any message of the server; `op` selects the type in one pass over the bytes"""

Numbers: TypeAlias = bytearray | list[Any] | dict[str, Any] | None
"""A channel of a hand that `HandState` does not know; ``None`` if the hand does not have it."""

Encoding: TypeAlias = Literal["json", "msgpack"]


class Envelope(msgspec.Struct, kw_only=True):
    """The fields that every message from the server has."""

    op: str
    id: int | None = None


class Codec:
    """One of the two encodings.

    Args:
        encoding: Name of the encoding.
        channels: Further fields of `Observation.hand` that `HandState` does not have.

    """

    def __init__(self, encoding: Encoding, channels: Sequence[str] = ()) -> None:
        self.encoding = encoding
        kinds: Any = _observation(channels) | Others
        self.binary = encoding == "msgpack"
        encoder: msgspec.json.Encoder | msgspec.msgpack.Encoder
        message: msgspec.json.Decoder[Message] | msgspec.msgpack.Decoder[Message]
        envelope: msgspec.json.Decoder[Envelope] | msgspec.msgpack.Decoder[Envelope]
        if self.binary:
            encoder = msgspec.msgpack.Encoder()
            message, envelope = msgspec.msgpack.Decoder(kinds), msgspec.msgpack.Decoder(Envelope)
        else:
            encoder = msgspec.json.Encoder()
            message, envelope = msgspec.json.Decoder(kinds), msgspec.json.Decoder(Envelope)
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


def with_channels(codec: Codec, specs: Specs) -> Codec:
    """Return a codec that also decodes channels of hands that `HandState` does not know."""
    known = {field.encode_name for field in msgspec.structs.fields(HandState)}
    paths = [field.name.split(".") for field in specs.observation]
    keys = [path[1].removesuffix("[]") for path in paths if path[0] == "hand" and len(path) > 1]
    new = [key for key in dict.fromkeys(keys) if key not in known]
    return Codec(codec.encoding, new) if new else codec


def _observation(channels: Sequence[str]) -> Any:
    """Return the type of observations whose hand has these channels as well."""
    if not channels:
        return Observation
    fields = [(key, Numbers, None) for key in channels]
    hand = msgspec.defstruct("HandState", fields, bases=(HandState,), kw_only=True, gc=False)
    return msgspec.defstruct("Observation", [("hand", hand)], bases=(Observation,), kw_only=True, tag="obs")


SUBPROTOCOLS: dict[str, Encoding] = {"palmares.v1.msgpack": "msgpack", "palmares.v1.json": "json"}
"""Subprotocol of each encoding in the handshake, the preferred one first"""

CODECS: dict[Encoding, Codec] = {encoding: Codec(encoding) for encoding in ("json", "msgpack")}
