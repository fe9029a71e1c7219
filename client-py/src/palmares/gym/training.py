"""Arguments of environments for learners, as `palmares.sim` takes them."""

from __future__ import annotations

import warnings
from typing import Any, Literal, TypeAlias

from palmares.training import Training

Shaping: TypeAlias = bool | Literal["info"]
"""``True``: the shaped part is in the reward and in ``info["shaping"]``. ``"info"``: only in the info."""


def shaping_of(shaping: Shaping | Literal["apart"]) -> Shaping:
    """Return the argument `shaping`; ``"apart"``, the old name of ``"info"``, warns.

    Raises:
        ValueError: It is neither a bool nor ``"info"``.

    """
    if shaping == "apart":
        warnings.warn(
            'shaping="apart" is called shaping="info" now; the next version refuses "apart"',
            DeprecationWarning,
            stacklevel=3,
        )
        return "info"
    if shaping not in (True, False, "info"):
        raise ValueError(f"shaping: found {shaping!r}; wanted True, False or 'info'")
    return shaping


def training_of(shaping: Shaping, **options: Any) -> Training | None:
    """Return the options for learners; ``None`` if there are none, which a server can play, too.

    Args:
        shaping: The argument of the environment.
        options: The other arguments of `Training`.

    """
    training = Training(shaping=bool(shaping), **options)
    return training if training.shaping or training.varies else None
