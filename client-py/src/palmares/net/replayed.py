"""The last steps of a lockstep run, to be sent again when another host continues it from an earlier tick."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from palmares.wire import Action, StepRequest

# Ticks of steps that are kept. A run is continued at most 25 ticks before the last observation.
KEPT_TICKS = 100


class MadeStep(NamedTuple):
    """A step that was made."""

    tick: int
    """Tick before it."""
    end: int
    """Tick after it."""
    action: Action


class StepHistory:
    """The last steps of a lockstep run. Worlds are deterministic: the same steps lead to the same state."""

    def __init__(self) -> None:
        self._steps: deque[MadeStep] = deque()
        self._server_tick: int | None = None

    def clear(self) -> None:
        """Forget all steps: another run begins."""
        self._steps.clear()
        self._server_tick = None

    def made(self, tick: int, end: int, action: Action) -> None:
        """Add a step from `tick` to `end`."""
        steps = self._steps
        steps.append(MadeStep(tick, end, action))
        while end - steps[0].end >= KEPT_TICKS:
            steps.popleft()

    def rewind(self, tick: int) -> bool:
        """Note that the server's world is at an earlier tick; return whether the steps since are known."""
        known = any(step.tick <= tick < step.end for step in self._steps)
        self._server_tick = tick if known else None
        return known

    def reached(self, tick: int) -> None:
        """Note that the server's world is at `tick` after a repeated step."""
        self._server_tick = tick

    def give_up(self) -> None:
        """Send no further steps again."""
        self._server_tick = None

    def next(self, max_repeat: int) -> StepRequest | None:
        """Return the next step to send again, without images; ``None`` when the server has caught up."""
        tick = self._server_tick
        if tick is None:
            return None
        for step in self._steps:
            if step.tick <= tick < step.end:
                return StepRequest(tick=tick, action=step.action, repeat=min(step.end - tick, max_repeat))
        self._server_tick = None
        return None
