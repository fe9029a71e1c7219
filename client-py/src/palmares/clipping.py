"""A warning when an action is clipped."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from palmares.arrays import Array
from palmares.wire import Action


class ClippedActionWarning(UserWarning):
    """A number of an action was beyond its limit, and was clipped."""


class Clipping:
    """Compares actions as asked for with how they were applied; warns the first time they differ."""

    def __init__(self) -> None:
        self._asked: Action | None = None
        self._from_tick = 0
        self._told = False

    @property
    def is_muted(self) -> bool:
        """Whether there will be no warning any more."""
        return self._told

    def mute(self) -> None:
        """Warn of nothing: who asks looks after the limits."""
        self._told, self._asked = True, None

    def ask(self, action: Action, from_tick: int = 0) -> None:
        """Remember an action that observations show from a tick on."""
        if not self._told:
            self._asked, self._from_tick = action, from_tick

    def see(self, applied: Action, tick: int, stacklevel: int) -> None:
        """Warn if the action that was applied in a tick differs from the one that was asked for."""
        if self._asked is None or tick < self._from_tick:
            return
        asked, self._asked = self._asked, None
        for field, wanted, was in _numbers(asked, applied):
            if any(abs(a - b) > 1e-12 for a, b in zip(wanted, was, strict=True)):
                self.warn(field, wanted, was, stacklevel + 1)
                return

    def see_unit(self, actions: Array, stacklevel: int) -> None:
        """Warn if an entry of actions (…, n) is beyond [−1, 1]."""
        if self._told or not np.any(np.abs(actions) > 1.0):
            return
        rows = actions.reshape(-1, actions.shape[-1])
        row = rows[np.abs(rows).max(axis=1) > 1.0][0]
        self.warn("action", row.tolist(), row.clip(-1.0, 1.0).tolist(), stacklevel + 1)

    def warn(self, field: str, wanted: Sequence[float], was: Sequence[float], stacklevel: int) -> None:
        """Warn that a field was clipped, once."""
        if self._told:
            return
        self._told = True
        warnings.warn(
            f"{field} = {_short(wanted)} was clipped to {_short(was)}. Further clipping is not told; "
            "`applied_action` of an observation has what was applied, `welcome.specs` the limits",
            ClippedActionWarning,
            stacklevel=stacklevel + 1,
        )


def _numbers(asked: Action, applied: Action) -> list[tuple[str, Sequence[float], Sequence[float]]]:
    """Return what both have of the fields that are clipped."""
    pairs: list[tuple[str, Sequence[float] | None, Sequence[float] | None]] = [
        ("hand", asked.hand, applied.hand)
    ]
    if asked.base is not None and applied.base is not None:
        for name in ("position", "linear", "angular"):
            pairs.append((f"base.{name}", getattr(asked.base, name), getattr(applied.base, name)))
    return [(field, wanted, was) for field, wanted, was in pairs if wanted is not None and was is not None]


def _short(numbers: Sequence[float]) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in numbers) + ")"
