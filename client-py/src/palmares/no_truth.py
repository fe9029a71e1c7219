"""The error for the full state in a run that has none."""

from __future__ import annotations


class NoTruthError(AttributeError):
    """The observation has no `truth`: its run has ``sensing="sensors"``."""

    def __init__(self) -> None:
        super().__init__(
            "this run has sensing='sensors', so its observations have no truth; they have hand, cameras "
            "and events. reset(…, sensing='truth') opens a run with it; obs.has_truth tells whether it has"
        )
