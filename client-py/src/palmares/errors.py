"""One exception per error code of the protocol."""

from __future__ import annotations

from typing import Any, Self

from palmares.messages import Result
from palmares.outputs import shown


class PalmaresError(Exception):
    """The server refused a request, or could not be reached.

    Attributes:
        code: The protocol's error code, such as ``bad_action``.
        fatal: True when the session is over; the client cannot be used any more.
        retry_after_s: When to try again; ``None`` when trying again would not help.

    """

    code = "unknown"

    def __init__(
        self,
        message: str,
        *,
        code: str | None = None,
        fatal: bool = False,
        retry_after_s: float | None = None,
    ) -> None:
        super().__init__(message)
        if code is not None:
            self.code = code
        self.fatal = fatal
        self.retry_after_s = retry_after_s

    def __str__(self) -> str:
        return shown(super().__str__())


class NoServerError(PalmaresError):
    """There is no server at the given address."""

    code = "no_server"


class ConnectionLostError(PalmaresError):
    """The connection broke and could not be made again."""

    code = "connection_lost"


class RunLostError(PalmaresError):
    """The run ended while the connection was broken, for example by a restart of the server.

    The session goes on: `Client.reset` opens another run.

    Attributes:
        result: The result of the run, if the server has one.

    """

    code = "run_lost"
    result: Result | None = None

    @classmethod
    def of(cls, run_id: str, result: Result | None) -> Self:
        """Return the error that says how the run ended."""
        if result is None:
            outcome = "ended while the connection was broken, and the server has no result of it"
        elif result.voided:
            why = result.reason if result.note is None else f"{result.reason}: {result.note}"
            outcome = f"was voided ({why}): it counts for nothing"
            if result.note is None or "not given back" not in result.note:
                outcome += " and its time is given back"
        else:
            outcome = f"ended while the connection was broken ({result.reason}), score {result.score:g}"
        error = cls(f"run {run_id} {outcome}; open another with reset(…)")
        error.result = result
        return error


class ProtocolError(PalmaresError):
    """The client cannot decode a message of the server; the versions may not match."""

    code = "protocol"


class BadJsonError(PalmaresError):
    """The message was not valid JSON or MessagePack."""

    code = "bad_json"


class UnknownOpError(PalmaresError):
    """The server does not know this operation."""

    code = "unknown_op"


class BadRequestError(PalmaresError):
    """A field of the request is missing, unknown, of the wrong type or out of range."""

    code = "bad_request"


class BadActionError(PalmaresError):
    """The action has the wrong length, or a number that is not finite."""

    code = "bad_action"


class StaleTickError(PalmaresError):
    """The step names another tick than the current one."""

    code = "stale_tick"


class WrongStateError(PalmaresError):
    """The request is not allowed now: no run is open, or one is already open."""

    code = "wrong_state"


class UnknownTaskError(PalmaresError):
    """No task has this name."""

    code = "unknown_task"


class UnknownHandError(PalmaresError):
    """No hand has this name."""

    code = "unknown_hand"


class UnknownCameraError(PalmaresError):
    """Neither task nor hand has this camera, or its channel is not for ``sensing="sensors"``."""

    code = "unknown_camera"


class HandInTheWayError(PalmaresError):
    """At its start the hand touches something, or is inside a region of the rules."""

    code = "hand_in_the_way"


class NotAuthorizedError(PalmaresError):
    """The token is missing or wrong."""

    code = "not_authorized"


class ForbiddenError(PalmaresError):
    """The token is valid, but does not permit this."""

    code = "forbidden"


class SessionTakenError(PalmaresError):
    """Another connection holds this session."""

    code = "session_taken"


class SessionOverError(PalmaresError):
    """The session's time is spent, or the session has ended."""

    code = "session_over"


class NotScheduledError(PalmaresError):
    """The team has no time slot now; the text and ``retry_after_s`` say when the next one begins."""

    code = "not_scheduled"


class CapacityError(PalmaresError):
    """The server has no capacity for another world or connection; see ``retry_after_s``."""

    code = "capacity"


class RateLimitedError(PalmaresError):
    """Too many requests per second; see ``retry_after_s``."""

    code = "rate_limited"


class TooLargeError(PalmaresError):
    """The message was larger than the server accepts."""

    code = "too_large"


class InternalError(PalmaresError):
    """A fault of the server."""

    code = "internal"


class WorldFaultError(InternalError):
    """The world of the run failed. The run is void; `Client.reset` or `World.reset` opens another.

    The text has the cause, the tick, its meaning and possible remedies.

    Attributes:
        fault: Cause: ``not_finite``, ``out_of_bounds``, ``unsolvable``, ``work_exhausted``, or ``crashed``
            for the program itself; `palmares.sim.FAULTS` explains each.

    """

    def __init__(self, message: str, *, fault: str = "unknown", **others: Any) -> None:
        super().__init__(message, **others)
        self.fault = fault


class InUseError(RuntimeError):
    """Another thread, or the parent of a forked process, uses this client, world or batch."""


class NotFoundError(PalmaresError):
    """No such page, run or hand."""

    code = "not_found"


_BY_CODE: dict[str, type[PalmaresError]] = {
    kind.code: kind
    for kind in (
        BadJsonError,
        UnknownOpError,
        BadRequestError,
        BadActionError,
        StaleTickError,
        WrongStateError,
        UnknownTaskError,
        UnknownHandError,
        UnknownCameraError,
        HandInTheWayError,
        NotAuthorizedError,
        ForbiddenError,
        SessionTakenError,
        SessionOverError,
        NotScheduledError,
        CapacityError,
        RateLimitedError,
        TooLargeError,
        InternalError,
        NotFoundError,
    )
}


def error_of(
    code: str,
    message: str,
    *,
    fatal: bool = False,
    retry_after_s: float | None = None,
    fault: str | None = None,
) -> PalmaresError:
    """Return the exception for an error code; `PalmaresError` for an unknown one."""
    text = f"{code}: {message}" if message else code
    if fault is not None:
        return WorldFaultError(text, fault=fault, code=code, fatal=fatal, retry_after_s=retry_after_s)
    kind = _BY_CODE.get(code, PalmaresError)
    return kind(text, code=code, fatal=fatal, retry_after_s=retry_after_s)
