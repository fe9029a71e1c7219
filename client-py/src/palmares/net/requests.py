"""Requests of a client in protocol v1."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal

import msgspec

from palmares.arguments import whole
from palmares.errors import BadRequestError
from palmares.messages import Action
from palmares.scene import Vec3


def names(cameras: Iterable[str]) -> list[str]:
    """Return the names as a list; a single name may be a string."""
    return [cameras] if isinstance(cameras, str) else list(cameras)


def whole_of(field: str, value: Any, least: int, most: int) -> int:
    """Return a whole number of a request, within these limits.

    Raises:
        BadRequestError: The value is no such number.

    """
    try:
        return whole(field, value, least, most)
    except ValueError as wrong:
        raise BadRequestError(f"bad_request: {wrong}") from None


class Request(msgspec.Struct, kw_only=True, omit_defaults=True, tag_field="op"):
    """A request; the link fills in its `id`."""

    id: int = 0


class Hello(Request, kw_only=True, tag="hello"):
    """Opens a session or resumes one."""

    client: dict[str, str]
    resume_token: str | None = None
    session_s: float | None = None


class Reset(Request, kw_only=True, tag="reset"):
    """Opens a run."""

    task: str
    hand: str
    mode: Literal["lockstep", "realtime"]
    sensing: Literal["sensors", "truth"]
    noise: Literal["none", "real"] | None = None
    seed: int | None = None
    cameras: list[str] = []


class Step(Request, kw_only=True, tag="step"):
    """Lockstep: advances the world."""

    tick: int
    action: Action
    repeat: int = 1
    cameras: list[str] = []


class Act(Request, kw_only=True, tag="act"):
    """Realtime: sets the targets from the next tick on."""

    action: Action
    cameras: list[str] = []


class Wrench(msgspec.Struct, kw_only=True):
    """Force (N) and torque (N·m), world frame."""

    force: Vec3
    torque: Vec3


class Perturb(Request, kw_only=True, tag="perturb"):
    """Practice: applies a wrench to a link of the hand."""

    link: str
    wrench: Wrench
    duration_s: float


class Stop(Request, kw_only=True, tag="stop"):
    """Closes the run."""


class Time(Request, kw_only=True, tag="time"):
    """Returns the session's clock."""


class Bye(Request, kw_only=True, tag="bye"):
    """Ends the session."""
