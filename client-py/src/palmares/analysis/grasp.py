"""A grasp: G, J, stiffness, closure and quality."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from palmares._native import HandModel, quasistatic
from palmares._native import contact_stiffness as native_contact_stiffness
from palmares._native import ellipsoid as native_ellipsoid
from palmares._native import force_closure as native_force_closure
from palmares._native import spaces as native_spaces
from palmares.analysis.closure import Closure, Quality, form_closure, quality
from palmares.analysis.contacts import Array, Contact, Numbers, grasp_matrix
from palmares.analysis.linear import LinearGrasp, LinearHand, Tendons, fixed
from palmares.views import Brief


@dataclass(frozen=True, repr=False)
class Ellipsoid(Brief):
    """What inputs of size 1 reach."""

    radii: Array
    """Semi-axes, descending; directions in which it is flat or infinite are left out"""
    axes: Array
    """Their directions, in columns"""
    inputs: Array
    """Inputs of size 1 that reach them, in columns"""
    manipulability: float
    """Product of the semi-axes; 0 if it is flat"""
    isotropy: float
    """Smallest over largest semi-axis; 0 if it is flat"""


def ellipsoid(map: Array) -> Ellipsoid:  # noqa: A002
    """Return ``{map @ x: |x| ≤ 1}``, as of velocities for a Jacobian."""
    return Ellipsoid(**native_ellipsoid(np.asarray(map, float), False))


def force_ellipsoid(map: Array) -> Ellipsoid:  # noqa: A002
    """Return ``{f: |mapᵀ f| ≤ 1}``: the forces that efforts of size 1 hold, for a map of velocities."""
    return Ellipsoid(**native_ellipsoid(np.asarray(map, float), True))


class Grasp:
    """Contacts of a hand with an object. `palmares.analysis.Hand.grasp` makes it.

    The contact forces λ have for each contact, in its frame, f_n, then f_t and f_o unless it is frictionless,
    then m_n if it is soft.
    """

    G: Array
    """Grasp matrix, 6 × c: ``G @ λ`` is the wrench on the object, in its axes, about its origin"""
    J: Array
    """Hand Jacobian, c × n: ``J.T @ λ`` are the joint torques that balance λ"""
    contacts: tuple[Contact, ...]
    """The contacts in the world"""

    def __init__(
        self,
        hand: HandModel,
        base: Numbers,
        q: Array,
        tension: Array,
        contacts: Sequence[Contact],
        object: Numbers,  # noqa: A002
        forces: Numbers | None = None,
    ) -> None:
        given = None if forces is None else [float(x) for x in np.ravel(forces)]
        found = hand.grasp(base, q, list(contacts), object, given)
        self._hand, self.q, self.tension, self.object = hand, q, tension, np.array(object)
        self.G, self.J = found["G"], found["J"]
        self.forces = None if given is None else np.array(given)
        self._hand_geometric: Array | None = found["hand_geometric"]
        self._object_geometric: Array | None = found["object_geometric"]
        placed = zip(contacts, found["points"], found["normals"], found["tangents"], strict=True)
        self.contacts = tuple(Contact("", p, n, c.model, c.friction, c.arm, t) for c, p, n, t in placed)
        self.links = tuple(contact.link for contact in contacts)

    def hand(self, tendons: Tendons = "compliant") -> LinearHand:
        """Return the linear behaviour of the hand in this posture; `tendons` as in `linear`."""
        found = self._hand.compliant(self.q, self.tension, fixed(tendons), self._hand_geometric)
        return LinearHand(**found)

    def linear(
        self,
        contact_stiffness: float | Sequence[float] | Array = 1e4,
        tendons: Tendons = "compliant",
        hand: LinearHand | None = None,
    ) -> LinearGrasp:
        """Return stiffness and maps of the grasp.

        Args:
            contact_stiffness: K_c: one number k, N/m, for every direction, with k · arm², N·m/rad, about the
                normal of soft fingers; three for (normal, tangential, spin in N·m/rad); or a c × c matrix.
            tendons: Their compliance.
            hand: Another linear hand, such as one of `soft_synergies`.

        """
        given = np.asarray(contact_stiffness, float)
        if given.ndim < 2:
            given = native_contact_stiffness(self.contacts, np.atleast_1d(given))
        hand = hand or self.hand(tendons)
        return LinearGrasp(**quasistatic(hand, self.G, self.J, given, self._object_geometric))

    def form_closure(self, *, planar: bool = False) -> Closure:
        """Return whether the contacts hold the object without friction.

        With `planar` it moves along x and y of its frame, and turns about z.
        """
        return form_closure(self.contacts, self.object, planar=planar)

    def force_closure(self, *, planar: bool = False) -> Closure:
        """Return whether the contacts hold the object with friction, and the hand all inner forces."""
        return Closure(**native_force_closure(self.contacts, self.object, self.J, planar))

    def quality(
        self,
        norm: Literal["total", "each"] = "total",
        *,
        edges: int = 8,
        length: float | None = None,
        planar: bool = False,
    ) -> Quality:
        """Return the measures of Ferrari and Canny; for the arguments see `palmares.analysis.quality`."""
        return quality(self.contacts, self.object, norm, edges=edges, length=length, planar=planar)

    def spaces(self) -> dict[str, Array]:
        """Return bases of the spaces that classify a grasp (Prattichizzo and Trinkle).

        ``graspable`` N(G), ``indeterminate`` N(Gᵀ), ``redundant`` N(J), ``defective`` N(Jᵀ), ``hyperstatic``
        N(G) ∩ N(Jᵀ). The grasp
        is so if its space is not empty.
        """
        return native_spaces(self.G, self.J)

    def matrix_about(self, object: Numbers) -> Array:  # noqa: A002
        """Return G about another frame."""
        return grasp_matrix(self.contacts, object)
