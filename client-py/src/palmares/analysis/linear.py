"""The linear behaviour of a hand, and of a grasp, near an equilibrium."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from palmares._native import soft_synergies as native_soft_synergies
from palmares.analysis.contacts import Array
from palmares.views import Brief

Tendons: TypeAlias = Literal["compliant", "fixed"]
"""Compliance of the tendons: each with its stiffness K, or of constant length"""


def fixed(tendons: Tendons) -> bool:
    """Return whether tendons are fixed."""
    if tendons not in ("compliant", "fixed"):
        raise ValueError(f'tendons: found {tendons!r}; wanted "compliant" or "fixed"')
    return tendons == "fixed"


@dataclass(frozen=True, repr=False)
class LinearHand(Brief):
    """A hand of n coordinates and k inputs near its equilibrium; m tendons act."""

    compliance: Array
    """Joint compliance ∂q/∂τ at constant inputs, n × n"""
    motion: Array
    """∂q/∂σ of the free hand, n × k"""
    tension: Array
    """∂f/∂σ of the free hand, m × k"""
    tension_per_torque: Array
    """∂f/∂τ at constant inputs, m × n"""
    winding: Array
    """Wound length of each tendon per input, m × k"""
    acting: tuple[int, ...]
    """Indices of the tendons that act: neither slack nor at their limits"""
    R: Array | None = None
    """R(q) of these tendons, m × n"""
    E: Array | None = None
    """Joint stiffness without tendons: springs, limits that joints are beyond, the curvature of tendons under
    tension, n × n"""
    stiffness: Array | None = None
    """Joint stiffness ∂τ/∂q, n × n; None where fixed tendons make it infinite"""
    tendon_stiffness: Array | None = None
    """(R E⁻¹ Rᵀ + K⁻¹)⁻¹, m × m"""
    input_stiffness: Array | None = None
    """Stiffness of the inputs, ∂(Wᵀ f)/∂σ, k × k"""


@dataclass(frozen=True, repr=False)
class LinearGrasp(Brief):
    """A grasp with c contact components near its equilibrium. Inputs are σ, or commands of synergies."""

    contact_stiffness: Array
    """Stiffness of contacts and hand in series, c × c"""
    object_stiffness: Array
    """∂w/∂u: wrench on the object per displacement of it, at constant inputs, 6 × 6"""
    object_per_input: Array
    """Object motion per input, 6 × k: translation of its origin, then rotation, in its axes"""
    forces_per_input: Array
    """Contact forces per input, c × k"""
    joints_per_input: Array
    """∂q/∂σ in the grasp, n × k"""
    tension_per_input: Array
    """∂f/∂σ in the grasp, m × k"""
    input_stiffness: Array
    """∂(Wᵀ f)/∂σ in the grasp, k × k"""
    object_per_wrench: Array
    """Object motion per wrench on it, 6 × 6"""
    forces_per_wrench: Array
    """Contact forces per wrench on the object, c × 6"""
    joints_per_wrench: Array
    """Joint motion per wrench on the object, n × 6"""
    internal_forces: Array
    """Orthonormal basis of the internal forces, G λ = 0, in columns"""
    controllable_internal_forces: Array
    """Basis of those that the inputs cause"""
    rigid_inputs: Array
    """Basis of the inputs that change no contact force"""
    rigid_motions: Array
    """The object motions of these inputs, 6 × their number"""
    held: int
    """Number of independent directions in which the grasp holds the object"""


def soft_synergies(synergies: Array, joint_stiffness: Array, synergy_stiffness: Array) -> LinearHand:
    """Return SynGrasp's hand: springs K_q to ``q_ref = S z``, and K_z between z and its command.

    Its inputs are the commands of z.
    """
    return LinearHand(**native_soft_synergies(synergies, joint_stiffness, synergy_stiffness))
