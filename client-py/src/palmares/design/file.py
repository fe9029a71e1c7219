"""The design file: the hand, its unknowns and the goals."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from palmares.design.fields import Fields
from palmares.design.goals import (
    Common,
    Ejected,
    Fates,
    ForcesMissed,
    Goal,
    PosturesMissed,
    PullOut,
)
from palmares.design.grasped import Epsilon, Probability
from palmares.design.places import Place, keys_of
from palmares.design.search import PRIMES
from palmares.sim import HANDS

Row = TypeVar("Row")

KINDS: dict[str, Callable[[Common, Fields], Goal]] = {
    "fates": Fates.read,
    "ejection": Ejected.read,
    "pull_out": PullOut.read,
    "epsilon": Epsilon.read,
    "probability": Probability.read,
    "postures": PosturesMissed.read,
    "forces": ForcesMissed.read,
}


@dataclass(frozen=True)
class Unknown:
    """A number that the design may change."""

    name: str
    places: tuple[Place, ...]
    low: float
    high: float


@dataclass(frozen=True)
class Design:
    """The contents of a design file."""

    path: Path
    hand: str
    """Name of a built-in hand, or the path of a folder"""
    taut: bool
    """Whether the motors' offsets follow, so that the open hand's tendons stay as taut as they are"""
    unknowns: tuple[Unknown, ...]
    goals: tuple[Goal, ...]


def read(path: Path) -> Design:
    """Read a design file.

    Raises:
        ValueError: A field is wrong; the message names file, field and valid values.
        OSError: The file cannot be read.

    """
    try:
        whole = Fields(str(path), tomllib.loads(path.read_text(encoding="utf-8")))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: it is no TOML: {error}") from None
    hand = whole.text("hand")
    if hand not in HANDS:
        folder = path.parent / hand
        if not folder.is_dir():
            raise whole.wrong(
                "hand", "a name of `palmares hands`, or a folder with hand.urdf, relative to this file"
            )
        hand = str(folder)
    taut = whole.flag("taut", True)
    unknowns = _all(whole, "unknowns", _unknown)
    goals = _all(whole, "goals", _goal)
    whole.end()
    for kind, names in (
        ("unknowns", [it.name for it in unknowns]),
        ("goals", [it.common.name for it in goals]),
    ):
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"{path}: two {kind} have the name {name!r}; give each its own")
    if len(unknowns) > len(PRIMES):
        raise ValueError(f"{path}: {len(unknowns)} unknowns; valid: at most {len(PRIMES)}")
    if not any(goal.common.weight for goal in goals):
        raise ValueError(f"{path}: no goal has a weight; wanted at least one to improve")
    return Design(path, hand, taut, tuple(unknowns), tuple(goals))


def _all(whole: Fields, name: str, one: Callable[[Fields], Row]) -> list[Row]:
    given = whole.raw(name)
    if not isinstance(given, list) or not given:
        raise whole.wrong(name, f"at least one table [[{name}]]")
    return [one(Fields(f"{whole.where}: {name}[{number}]", row)) for number, row in enumerate(given)]


def _unknown(fields: Fields) -> Unknown:
    name = fields.text("name")
    places = [Place(text) for text in fields.texts("in")]
    for place in places:
        try:
            keys_of(place.text.removeprefix("-"))
        except ValueError as error:
            raise ValueError(f"{fields.where}: in: {error}") from None
    low, high = fields.numbers("range", (2,))
    if not low < high:
        raise fields.wrong("range", "[low, high] with low below high")
    fields.end()
    return Unknown(name, tuple(places), low, high)


def _goal(fields: Fields) -> Goal:
    kind = fields.text("kind", of=tuple(KINDS))
    least, most = fields.maybe("at_least"), fields.maybe("at_most")
    limited = least is not None or most is not None
    weight = fields.number("weight", 0.0 if limited else 1.0, least=0.0)
    goal = KINDS[kind](Common(fields.text("name", kind), weight, least, most), fields)
    fields.end()
    return goal
