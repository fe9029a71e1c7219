"""The newest observation of a real-time run."""

from __future__ import annotations

import threading
from typing import Any

from palmares.messages import Observation

# Most events kept from unread observations; a run has dozens.
MAX_EVENTS = 1000


class Stream:
    """Holds the newest observation. A slow controller misses observations, never events.

    `put` and `take` may be called from different threads: the heartbeat's and the controller's.

    Attributes:
        skipped: Observations that newer ones replaced before they were taken.

    """

    def __init__(self) -> None:
        self.skipped = 0
        self._lock = threading.Lock()
        self._newest: Observation | None = None
        self._run_id: str | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Return everything but the lock, for pickle."""
        return {name: value for name, value in self.__dict__.items() if name != "_lock"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Continue with a lock of its own."""
        self.__dict__.update(state)
        self._lock = threading.Lock()

    def open(self, run_id: str) -> None:
        """Accept observations of this run from now on."""
        with self._lock:
            self._run_id, self._newest, self.skipped = run_id, None, 0

    def close(self) -> None:
        """Accept no more observations; `skipped` stays."""
        with self._lock:
            self._run_id = self._newest = None

    def put(self, obs: Observation) -> None:
        """Store a received observation."""
        with self._lock:
            if obs.run_id != self._run_id:
                return  # It belongs to an earlier run.
            if self._newest is not None:
                self.skipped += 1
                # Later ticks than those of a run that has gone back are played again.
                earlier = [event for event in self._newest.events if event.tick < obs.tick or not obs.resumed]
                obs.events = (earlier + obs.events)[-MAX_EVENTS:]
                obs.resumed |= self._newest.resumed
            self._newest = obs

    def take(self) -> Observation | None:
        """Return the newest observation, once."""
        with self._lock:
            obs, self._newest = self._newest, None
        return obs

    @property
    def over(self) -> bool:
        """Whether the newest observation says that the run is over."""
        with self._lock:
            return self._newest is not None and self._newest.done
