"""What the info of an episode's end has, in single and in vector environments."""

from __future__ import annotations

from typing import Any

from palmares.messages import Result

RESULT = ("status", "score", "in_goal", "outside", "reason", "note", "ticks", "sim_time_s", "state_hash")
"""Fields of ``info["result"]`` beside ``fault``; see `palmares.Result`"""


def result_of(result: Result, fault: str | None) -> dict[str, Any]:
    """Return a run's result as ``info["result"]`` has it: that of `palmares.sim.Batch.result`."""
    return {name: getattr(result, name) for name in RESULT} | {"fault": fault}


def refuse_options(options: dict[str, Any] | None, known: tuple[str, ...] = ()) -> None:
    """Check the options of a reset.

    Raises:
        ValueError: One of them is unknown.

    """
    for name in options or {}:
        if name not in known:
            wanted = " or ".join(map(repr, known)) or "none: task, hand and training are arguments of make"
            raise ValueError(f"options: found {name!r}; wanted {wanted}")
