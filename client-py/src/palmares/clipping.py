"""A warning the first time that a field of an action is clipped in a run."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from palmares.arrays import Array
from palmares.wire import Action


class ClippedActionWarning(UserWarning):
    """A number of an action was beyond its limit, and was clipped."""


class HeldHandWarning(UserWarning):
    """No action came for `Limits.hold_ticks`: the server stopped the hand of a real-time run."""


class Clipping:
    """Compares requested with applied actions; warns the first time that they differ in a field."""

    def __init__(self) -> None:
        self._requested: Action | None = None
        self._from_tick = 0
        self._hold_ticks: int | None = None
        self._muted = False
        self._warned: set[str] = set()

    @property
    def is_muted(self) -> bool:
        """Whether no further warning comes."""
        return self._muted

    def mute(self) -> None:
        """Disable warnings: the caller clips."""
        self._muted, self._requested = True, None

    def begin(self) -> None:
        """Begin another run, which warns again."""
        self._requested = None
        self._warned.clear()

    def has_warned(self, field: str) -> bool:
        """Whether a clipped field gives no further warning in this run."""
        return self._muted or field in self._warned

    def request(self, action: Action, from_tick: int = 0, hold_ticks: int | None = None) -> None:
        """Keep a requested action; observations show it from `from_tick` on, for `hold_ticks` more."""
        if not self._muted:
            self._requested, self._from_tick, self._hold_ticks = action, from_tick, hold_ticks

    def compare(self, applied: Action, tick: int, stacklevel: int) -> None:
        """Warn if the action applied in a tick differs from the requested one."""
        if self._requested is None or tick < self._from_tick:
            return
        requested, self._requested = self._requested, None
        if self._hold_ticks is not None and tick > self._from_tick + self._hold_ticks:
            self._warn_of_hold(tick, stacklevel + 1)
            return
        for field, wanted, was in _numbers(requested, applied):
            if any(abs(a - b) > 1e-12 for a, b in zip(wanted, was, strict=True)):
                self.warn(field, wanted, was, stacklevel + 1)

    def _warn_of_hold(self, tick: int, stacklevel: int) -> None:
        if self.has_warned("held"):
            return
        self._warned.add("held")
        warnings.warn(
            f"the hand was stopped in tick {tick} or before: no action came for more than {self._hold_ticks} "
            f"ticks after that of tick {self._from_tick} (`welcome.limits.hold_ticks`). Send one more often; "
            "`missed_ticks` of the result counts ticks without a new action. This warning comes once a run",
            HeldHandWarning,
            stacklevel=stacklevel + 1,
        )

    def check_unit(self, actions: Array, stacklevel: int) -> None:
        """Warn if an entry of actions (…, n) is outside [−1, 1]."""
        if self.has_warned("action") or not np.any(np.abs(actions) > 1.0):
            return
        rows = actions.reshape(-1, actions.shape[-1])
        row = rows[np.abs(rows).max(axis=1) > 1.0][0]
        self.warn("action", row.tolist(), row.clip(-1.0, 1.0).tolist(), stacklevel + 1)

    def warn(
        self, field: str, wanted: Sequence[float], was: Sequence[float], stacklevel: int, where: str = ""
    ) -> None:
        """Warn that a field was clipped, once; `where` is written before its name."""
        if self.has_warned(field):
            return
        self._warned.add(field)
        # Python shows the same text from the same line once: this one has numbers.
        warnings.warn(
            f"{where}{field} = {_short(wanted)} was clipped to {_short(was)}. This warning comes once a "
            "field and run; `applied_action` of an observation has the applied action, `welcome.specs` the "
            "limits",
            ClippedActionWarning,
            stacklevel=stacklevel + 1,
        )


def _numbers(requested: Action, applied: Action) -> list[tuple[str, Sequence[float], Sequence[float]]]:
    """Return the fields that both actions have and the server clips: name, requested, applied."""
    pairs: list[tuple[str, Sequence[float] | None, Sequence[float] | None]] = [
        ("hand", requested.hand, applied.hand),
        ("effort", requested.effort, applied.effort),
    ]
    if requested.base is not None and applied.base is not None:
        for name in ("position", "linear", "angular", "joints"):
            pairs.append((f"base.{name}", getattr(requested.base, name), getattr(applied.base, name)))
    return [(field, wanted, was) for field, wanted, was in pairs if wanted is not None and was is not None]


def _short(numbers: Sequence[float]) -> str:
    # Seven digits: a number a little beyond its limit must not read as the limit.
    return "(" + ", ".join(f"{x:.7g}" for x in numbers) + ")"
