"""The last steps of a lockstep run, to be sent again when another host continues it from an earlier tick."""

from __future__ import annotations

from collections import deque

from palmares.wire import Action, StepRequest

# Ticks of steps that are kept. A run is continued at most 25 ticks before the last observation.
KEPT_TICKS = 100


class StepHistory:
    """The last steps of a lockstep run. Worlds are deterministic: the same steps lead to the same state.

    Attributes:
        behind: Tick of the server's world while steps must be sent again; ``None`` otherwise.

    """

    def __init__(self) -> None:
        self._steps: deque[tuple[int, int, Action]] = deque()
        """The tick before each step, the tick after it, and its action"""
        self.behind: int | None = None

    def clear(self) -> None:
        """Forget all steps: another run begins."""
        self._steps.clear()
        self.behind = None

    def made(self, tick: int, end: int, action: Action) -> None:
        """Add a step from `tick` to `end`."""
        steps = self._steps
        steps.append((tick, end, action))
        while end - steps[0][1] >= KEPT_TICKS:
            steps.popleft()

    def rewind(self, tick: int) -> bool:
        """Note that the server's world is at an earlier tick; return whether the steps since are known."""
        known = any(begin <= tick < end for begin, end, _ in self._steps)
        self.behind = tick if known else None
        return known

    def next(self, max_repeat: int) -> StepRequest | None:
        """Return the next step to send again, without images; ``None`` when the server has caught up."""
        if (tick := self.behind) is not None:
            for begin, end, action in self._steps:
                if begin <= tick < end:
                    return StepRequest(tick=tick, action=action, repeat=min(end - tick, max_repeat))
        self.behind = None
        return None
