"""The arguments of environments for learners, as `palmares.sim` takes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypeAlias

from palmares.training import Training

Shaping: TypeAlias = bool | Literal["apart"]
"""``True``: part of the reward, and in ``info["shaping"]``. ``"apart"``: in ``info["shaping"]`` alone."""


def training_of(
    shaping: Shaping, discount: float | None, randomise: bool | Sequence[str], fraction: float
) -> Training | None:
    """Return what is asked for; ``None`` for nothing, which a server has, too."""
    if shaping not in (True, False, "apart"):
        raise ValueError(f"shaping: found {shaping!r}; wanted True, False or 'apart'")
    asked = Training(shaping=bool(shaping), discount=discount, randomise=randomise, fraction=fraction)
    return asked if asked.shaping or asked.varies else None
