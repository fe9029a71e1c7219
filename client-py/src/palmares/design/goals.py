"""Goals of a design: numbers that a hand has, and how good they are."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, cast

import numpy as np
from numpy.typing import NDArray

from palmares.analysis import Contact, Forces, Hand
from palmares.analysis.hand import Rest
from palmares.arrays import array
from palmares.design.fields import Fields
from palmares.design.hand_files import turn_of
from palmares.reproducible import dot
from palmares.rotation import quat_of

Shape = Literal["sphere", "cylinder", "box"]
SIZES: dict[str, tuple[int, ...]] = {"sphere": (1,), "cylinder": (2,), "box": (3,)}
"""Numbers of a size: radius; radius and half length; half lengths"""
LOADS = ((0, 0, -1), (0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0))
BISECTIONS = 6
"""Steps of `PullOut` after the first load: it ends within the largest load over 2⁶"""


@dataclass(frozen=True)
class Measured:
    """A goal's number of a hand."""

    value: float
    fate: NDArray[np.str_] | None = None
    """Fate of each object, sizes × places, of a goal that plays them"""


@dataclass(frozen=True)
class Common:
    """The fields that every goal has."""

    name: str
    weight: float
    """Part of the score for each unit; 0 for a goal that is only a limit"""
    at_least: float | None
    at_most: float | None


class Goal(ABC):
    """A goal; `common` has the fields that do not depend on its kind."""

    kind: ClassVar[str]
    unit: ClassVar[str] = ""
    larger_is_better: ClassVar[bool]
    common: Common

    @abstractmethod
    def measure(self, hand: str) -> Measured:
        """Return the number of a hand, by its name or path.

        Raises:
            ValueError: The hand cannot be measured.

        """

    def score(self, value: float) -> float:
        """Return the part of the score, more for a better hand."""
        return self.common.weight * (value if self.larger_is_better else -value)

    def missed(self, value: float) -> float:
        """Return by how much the limits are missed, in parts of them; 0 within them."""
        missed = 0.0
        for limit, sign in ((self.common.at_least, 1.0), (self.common.at_most, -1.0)):
            if limit is not None and sign * (limit - value) > 0.0:
                missed += sign * (limit - value) / (abs(limit) or 1.0)
        return missed


@dataclass(frozen=True)
class Trials:
    """Objects at places in which the simulated hand closes, as of `Hand.ejection`."""

    shape: Shape
    sizes: list[list[float]]
    places: list[list[float]]
    sigma: list[float]
    mass: float
    friction: float
    close_s: float
    hold_s: float

    @classmethod
    def read(cls, fields: Fields) -> Trials:
        """Read them from a goal's table."""
        shape = fields.text("shape", of=tuple(SIZES))
        return cls(
            cast(Shape, shape),
            fields.rows("sizes", SIZES[shape]),
            placed(fields, "places"),
            fields.numbers("sigma", default=[1.0]),
            fields.number("mass", 0.1, above=0.0),
            fields.number("friction", 0.8, least=0.0),
            fields.number("close_s", 1.0, above=0.0),
            fields.number("hold_s", 0.2, above=0.0),
        )

    def play(self, hand: str, loads: Sequence[Sequence[float]]) -> NDArray[np.str_]:
        """Return the fate of each object, sizes × places."""
        sigma = self.sigma if len(self.sigma) > 1 else self.sigma[0]
        found = Hand(hand).ejection(
            self.shape,
            self.sizes,
            self.places,
            sigma=sigma,
            mass=self.mass,
            friction=self.friction,
            close_s=self.close_s,
            hold_s=self.hold_s,
            loads=loads,
        )
        return found.fate


def placed(fields: Fields, name: str) -> list[list[float]]:
    """Read positions, with `rpy` for all of them, or poses."""
    rpy = fields.numbers("rpy", (3,), (0.0, 0.0, 0.0))
    quat = quat_of(turn_of(rpy)).tolist()
    return [row if len(row) == 7 else [*row, *quat] for row in fields.rows(name, (3, 7))]


def part(fate: NDArray[np.str_], word: str) -> float:
    """Return the part of the objects with a fate."""
    return float(np.count_nonzero(fate == word)) / fate.size


@dataclass(frozen=True)
class Fates(Goal):
    """Part of the objects that are held under every load."""

    kind = "fates"
    larger_is_better = True
    common: Common
    trials: Trials
    loads: list[list[float]]

    @classmethod
    def read(cls, common: Common, fields: Fields) -> Goal:
        """Read it from its table."""
        return cls(common, Trials.read(fields), fields.rows("loads", (3,), LOADS))

    def measure(self, hand: str) -> Measured:
        """Play all objects."""
        fate = self.trials.play(hand, self.loads)
        return Measured(part(fate, "held"), fate)


@dataclass(frozen=True)
class Ejected(Goal):
    """Part of the objects that leave the hand while it closes."""

    kind = "ejection"
    larger_is_better = False
    common: Common
    trials: Trials

    @classmethod
    def read(cls, common: Common, fields: Fields) -> Goal:
        """Read it from its table."""
        return cls(common, Trials.read(fields))

    def measure(self, hand: str) -> Measured:
        """Play all objects without a load."""
        fate = self.trials.play(hand, [])
        return Measured(part(fate, "ejected"), fate)


@dataclass(frozen=True)
class PullOut(Goal):
    """Largest load, N, under which all objects stay, in each of some directions."""

    kind, unit = "pull_out", "N"
    larger_is_better = True
    common: Common
    trials: Trials
    directions: list[list[float]]
    most: float

    @classmethod
    def read(cls, common: Common, fields: Fields) -> Goal:
        """Read it from its table."""
        directions = fields.rows("directions", (3,), LOADS)
        for row in directions:
            if not any(row):
                raise fields.wrong("directions", "vectors that are not 0")
        return cls(common, Trials.read(fields), directions, fields.number("most", 50.0, above=0.0))

    def measure(self, hand: str) -> Measured:
        """Bisect the load; 0 N if an object does not even stay under the smallest one."""
        units = [[x / math.sqrt(dot(row, row)) for x in row] for row in self.directions]

        def stay(load: float) -> bool:
            loads = [[load * x for x in unit] for unit in units]
            return bool((self.trials.play(hand, loads) == "held").all())

        if stay(self.most):
            return Measured(self.most)
        low, high = 0.0, self.most
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if stay(middle) else (low, middle)
        return Measured(low)


@dataclass(frozen=True)
class PosturesMissed(Goal):
    """Root mean square distance of the free hand's coordinates from wanted ones, rad or m."""

    kind, unit = "postures", "rad"
    larger_is_better = False
    common: Common
    sigma: list[list[float]]
    q: list[list[float]]

    @classmethod
    def read(cls, common: Common, fields: Fields) -> Goal:
        """Read it from its table."""
        found = cls(common, fields.rows("sigma"), fields.rows("q", nan=True))
        if len(found.sigma) != len(found.q):
            raise fields.wrong("q", f"{len(found.sigma)} postures, one for each sigma")
        return found

    def measure(self, hand: str) -> Measured:
        """Compute the equilibria."""
        model = Hand(hand)
        differences: list[float] = []
        for sigma, q in zip(self.sigma, self.q, strict=True):
            if len(q) != len(model.coordinates):
                raise ValueError(
                    f"goal {self.common.name!r}: q: wanted {len(model.coordinates)} numbers each"
                )
            reached = model.rest(sigma if len(sigma) > 1 else sigma[0]).q
            pairs = zip(reached.tolist(), q, strict=True)
            differences += [found - wanted for found, wanted in pairs if not math.isnan(wanted)]
        return Measured(_rms(differences))


@dataclass(frozen=True)
class ForcesMissed(Goal):
    """Root mean square distance of contact forces from wanted proportions, of forces whose rms is 1."""

    kind = "forces"
    larger_is_better = False
    common: Common
    sigma: list[float]
    posture: list[float]
    contacts: list[Contact]
    shares: list[float]

    @classmethod
    def read(cls, common: Common, fields: Fields) -> Goal:
        """Read it from its table."""
        contacts = []
        given = fields.raw("contacts")
        if not isinstance(given, list) or not given:
            raise fields.wrong("contacts", "a list of { link, point, normal }")
        for number, row in enumerate(given):
            own = Fields(f"{fields.where}: contacts[{number}]", row)
            link, point, normal = own.text("link"), own.numbers("point", (3,)), own.numbers("normal", (3,))
            own.end()
            contacts.append(Contact(link, point, normal, "frictionless"))
        shares = fields.numbers("shares", (len(contacts),), [1.0] * len(contacts))
        return cls(common, fields.numbers("sigma"), fields.numbers("posture"), contacts, shares)

    def measure(self, hand: str) -> Measured:
        """Compute the forces in closed form, without friction, at contacts that touch in the posture."""
        model = Hand(hand)
        if len(self.posture) != len(model.coordinates):
            raise ValueError(
                f"goal {self.common.name!r}: posture: wanted {len(model.coordinates)} numbers, of "
                f"{', '.join(model.coordinates)}"
            )
        q, none = array(self.posture), array([])
        slack = np.zeros(len(model.tendons))
        at = Rest(q, slack, array([0, 0, 0, 0, 0, 0, 1]), model.poses(q), "", (), none, none)
        touching = model.grasp(at, self.contacts)
        sigma = self.sigma * (len(model.motors) if len(self.sigma) == 1 else 1)
        wanted = Forces(sigma, touching.J, self.posture, self.shares)
        return Measured(_rms(model.differences([], [wanted])[0].tolist()))


def _rms(differences: list[float]) -> float:
    return math.sqrt(dot(differences, differences) / len(differences)) if differences else 0.0
