"""Closure and quality of contacts in the world, of a hand or without one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from palmares._native import force_closure as native_force_closure
from palmares._native import form_closure as native_form_closure
from palmares._native import quality as native_quality
from palmares.analysis.contacts import Array, Contact, Numbers, grasp_matrix, pose_of
from palmares.reproducible import mean, norms
from palmares.views import Brief


@dataclass(frozen=True, repr=False)
class Closure(Brief):
    """The result of a test of closure."""

    closed: bool
    """Whether the grasp has this closure"""
    rank: int
    """Rank of G"""
    margin: float
    """Largest distance of balanced contact forces from the bounds of their cones, with a mean normal force of
    1 N"""
    forces: Array
    """The contact forces λ with this margin"""
    uncontrolled: Array | None = None
    """For force closure: basis of the inner forces that the joints do not control, N(G) ∩ N(Jᵀ)"""
    frictional: bool | None = None
    """For force closure: whether there is closure with friction, if all contact forces are controlled"""


@dataclass(frozen=True, repr=False)
class Quality(Brief):
    """Measures of Ferrari and Canny; moments are divided by a length."""

    epsilon: float
    """ε: radius of the largest ball about the origin inside the set of wrenches, N"""
    epsilon_bound: float
    """Upper bound of the ε of round cones; `epsilon` is a lower one"""
    weakest: Array
    """Unit wrench that the grasp resists least: force, then moment over length"""
    volume: float | None
    """Volume of the set; None for ``norm="each"``"""


def form_closure(
    contacts: Sequence[Contact],
    object: Numbers | None = None,  # noqa: A002
    *,
    planar: bool = False,
) -> Closure:
    """Return whether contacts in the world hold an object without friction.

    Args:
        contacts: With an empty `link`; at least one.
        object: The object's frame; by default the middle of the contacts, with the world's axes.
        planar: It moves along x and y of its frame, and turns about z.

    Raises:
        ValueError: There is no contact, or one is on a link.

    """
    frame = _frame(contacts, object)
    return Closure(**native_form_closure(list(contacts), frame, planar))


def force_closure(
    contacts: Sequence[Contact],
    object: Numbers | None = None,  # noqa: A002
    *,
    planar: bool = False,
) -> Closure:
    """Return whether contacts in the world hold an object with friction, if all their forces are controlled.

    The arguments are those of `form_closure`. `Grasp.force_closure` also asks whether a hand controls them.
    """
    frame = _frame(contacts, object)
    components = grasp_matrix(contacts, frame).shape[1]
    return Closure(**native_force_closure(list(contacts), frame, np.eye(components), planar))


def quality(
    contacts: Sequence[Contact],
    object: Numbers | None = None,  # noqa: A002
    norm: Literal["total", "each"] = "total",
    *,
    edges: int = 8,
    length: float | None = None,
    planar: bool = False,
) -> Quality:
    """Return the measures of Ferrari and Canny of contacts in the world.

    Args:
        contacts: As for `form_closure`.
        object: As for `form_closure`.
        norm: ``total``: the sum of the normal forces is at most 1 N (L1); ``each``: each of them
            is (L∞), only with `planar`.
        edges: Edges of the pyramids inside the friction cones, at least 3.
        length: Divides moments, m; by default the largest distance of a contact from the object's origin.
        planar: The object moves along x and y of its frame, and turns about z.

    """
    frame = _frame(contacts, object)
    if length is None:
        points = np.array([contact.point for contact in contacts])
        length = float(norms(points - np.array(frame[:3])).max())
    return Quality(**native_quality(list(contacts), frame, norm, edges, length, planar))


def _frame(contacts: Sequence[Contact], given: Numbers | None) -> list[float]:
    if not contacts:
        raise ValueError("contacts: found none; wanted at least one")
    for number, contact in enumerate(contacts):
        if contact.link:
            raise ValueError(
                f"contacts[{number}]: found link {contact.link!r}; wanted contacts in the world, with an "
                "empty link: Hand.grasp takes contacts on links"
            )
    middle = mean([np.array(contact.point) for contact in contacts]) if given is None else given
    return pose_of("object", middle)
