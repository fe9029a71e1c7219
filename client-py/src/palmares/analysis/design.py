"""Variables and goals of a design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from palmares.analysis.contacts import Array, Numbers
from palmares.views import Brief

Parameter: TypeAlias = tuple[str, str, str, float]
"""A number of a hand: its kind, tendon and coordinate, and a factor"""


def arm(tendon: str, coordinate: str, factor: float = 1.0) -> Parameter:
    """Return the parameter of a tendon's moment arm at a coordinate: an entry of R, in metres a radius."""
    return ("arm", tendon, coordinate, factor)


def stiffness(coordinate: str, factor: float = 1.0) -> Parameter:
    """Return the parameter of a coordinate's stiffness E."""
    return ("stiffness", "", coordinate, factor)


def rest(coordinate: str, factor: float = 1.0) -> Parameter:
    """Return the parameter of a coordinate's rest position q₀."""
    return ("rest", "", coordinate, factor)


@dataclass(frozen=True, repr=False)
class Variable(Brief):
    """A number that the optimisation may change; times each factor it is the value of a parameter."""

    parameters: Sequence[Parameter]
    """One parameter, or several that share the number, as joints with equal pulleys"""
    lower: float
    """Smallest value"""
    upper: float
    """Largest value"""


@dataclass(frozen=True, repr=False)
class Postures(Brief):
    """Goal: coordinates of the free hand at several σ: a trajectory of closing."""

    sigma: Sequence[Sequence[float]]
    """σ of every motor, for each posture"""
    q: Sequence[Sequence[float]]
    """Coordinates, for each posture; NaN for those that do not matter"""
    weight: float = 1.0
    """Weight of a difference of 1 rad or 1 m"""

    def __post_init__(self) -> None:
        for name in ("sigma", "q"):
            rows = [[float(x) for x in row] for row in getattr(self, name)]
            object.__setattr__(self, name, rows)


@dataclass(frozen=True, repr=False)
class Forces(Brief):
    """Goal: normal forces of contacts in given proportions, such as equal ones."""

    sigma: Sequence[float]
    """σ of every motor"""
    jacobian: Array
    """Rows of J of the normals, contacts × coordinates, where the contacts touch"""
    posture: Sequence[float]
    """Coordinates at which they touch"""
    shares: Sequence[float] = field(default_factory=list)
    """Proportions of the forces; equal if empty"""
    compliance: float = 1e-4
    """Compliance of each contact, m/N"""
    weight: float = 1.0
    """Weight of a difference of forces and shares, each over their root mean square"""

    def __post_init__(self) -> None:
        object.__setattr__(self, "jacobian", np.atleast_2d(np.asarray(self.jacobian, float)))
        object.__setattr__(self, "sigma", [float(x) for x in self.sigma])
        object.__setattr__(self, "posture", [float(x) for x in self.posture])
        shares: Numbers = self.shares if len(self.shares) else np.ones(len(self.jacobian))
        object.__setattr__(self, "shares", [float(x) for x in shares])


@dataclass(frozen=True, repr=False)
class Optimum(Brief):
    """The end of an optimisation."""

    values: Array
    """Values of the variables"""
    cost: float
    """Half the sum of the squared differences"""
    history: Array
    """The cost after each step, from the start"""
    converged: bool
    """Whether no step within the bounds lowers it further"""
    R: Array
    """R of the design"""
    E: Array
    """E of the design"""
    q0: Array
    """q₀ of the design"""
