"""Contacts and the grasp matrix."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from palmares._native import DEFAULT_ARM
from palmares._native import grasp_matrix as native_grasp_matrix
from palmares.views import Brief

Array: TypeAlias = NDArray[np.float64]
"""An array of numbers"""
Numbers: TypeAlias = Sequence[float] | Array
"""Numbers in a row"""
ContactModel: TypeAlias = Literal["frictionless", "hard_finger", "soft_finger"]
"""The transmitted components: f_n; f_n, f_t, f_o; or these and the moment m_n about the normal"""

ORIGIN = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
"""The world's frame, as a pose"""


@dataclass(frozen=True, repr=False)
class Contact(Brief):
    """A contact: on a link and in its frame, or, with an empty `link`, in the world.

    Its frame has the axes n, the normal into the object, t, the tangent, and o = n × t. Friction holds while
    ``f_t² + f_o² + (m_n/arm)² ≤ (friction · f_n)²``.
    """

    link: str
    """Name of the link"""
    point: Numbers
    """Position, m"""
    normal: Numbers
    """Direction out of the hand and into the object; of any length"""
    model: ContactModel = "hard_finger"
    """Transmitted components"""
    friction: float = 1.0
    """Coulomb coefficient"""
    arm: float = DEFAULT_ARM
    """Arm of the friction moment of a soft finger, m: 0.005 unless it is given; 0 transmits no moment"""
    tangent: Numbers | None = None
    """Direction of t; by default the axis that is farthest from the normal, made orthogonal to it"""

    def __post_init__(self) -> None:
        for name in ("point", "normal", "tangent"):
            given = getattr(self, name)
            if given is not None:
                object.__setattr__(self, name, tuple(float(x) for x in given))


def pose_of(name: str, pose: Numbers | None) -> list[float]:
    """Return a pose as seven numbers; three are a position."""
    numbers = [float(x) for x in (ORIGIN if pose is None else pose)]
    if len(numbers) == 3:
        numbers += ORIGIN[3:]
    if len(numbers) != 7:
        raise ValueError(
            f"{name}: found {len(numbers)} numbers; wanted 3 (a position) or 7 (with a quaternion)"
        )
    return numbers


def grasp_matrix(contacts: Sequence[Contact], object: Numbers | None = None) -> Array:  # noqa: A002
    """Return G, 6 × components, of contacts in the world.

    ``G @ λ`` is the wrench of the contact forces λ on the object: force, then moment about the origin of the
    frame `object`, in its
    axes.
    """
    return native_grasp_matrix(list(contacts), pose_of("object", object))
