"""The newest observation of a world that runs in real time."""

from __future__ import annotations

import threading

from palmares.messages import Observation

# Events kept of observations nobody looked at; a run has dozens.
MOST_EVENTS = 1000


class Stream:
    """Holds one observation, the newest. A slow controller misses observations, never events.

    The heartbeat's thread may put while the controller's takes.

    Attributes:
        skipped: Observations that a newer one replaced before anybody took them.

    """

    def __init__(self) -> None:
        self.skipped = 0
        self._lock = threading.Lock()
        self._newest: Observation | None = None
        self._run_id: str | None = None

    def open(self, run_id: str) -> None:
        """Listen to this run from now on."""
        with self._lock:
            self._run_id, self._newest, self.skipped = run_id, None, 0

    def close(self) -> None:
        """Listen no more; `skipped` stays."""
        with self._lock:
            self._run_id = self._newest = None

    def put(self, obs: Observation) -> None:
        """Take note of an observation that came."""
        with self._lock:
            if obs.run_id != self._run_id:
                return  # What was still on its way when another run was opened.
            if self._newest is not None:
                self.skipped += 1
                if self._newest.events:
                    obs.events = (self._newest.events + obs.events)[-MOST_EVENTS:]
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
