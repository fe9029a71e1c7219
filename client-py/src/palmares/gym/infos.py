"""The content of infos, in single and in vector environments."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from palmares.messages import Result
from palmares.wire import Event

RESULT = (
    "status",
    "score",
    "in_goal",
    "outside",
    "reason",
    "fault",
    "note",
    "ticks",
    "sim_time_s",
    "state_hash",
)
"""Entries of ``info["result"]``, those of `palmares.sim.Batch.result`; see `palmares.Result`"""


def result_of(result: Result) -> dict[str, Any]:
    """Return a run's result as ``info["result"]`` has it."""
    return {name: getattr(result, name) for name in RESULT}


def events_of(events: Iterable[tuple[int, str, int | None]]) -> list[Event]:
    """Return events of a `palmares.sim.Batch` as ``info["events"]`` has them."""
    return [Event(tick=tick, kind=kind, object=at) for tick, kind, at in events]


def row_of(infos: dict[str, Any], k: int) -> dict[str, Any]:
    """Return the info of one environment out of those of a vector environment."""
    row: dict[str, Any] = {}
    for name, values in infos.items():
        if name.startswith("_") or not infos[f"_{name}"][k]:
            continue
        if isinstance(values, dict):
            row[name] = row_of(values, k)
        else:
            value = values[k]
            row[name] = value.item() if isinstance(value, np.generic) else value
    return row


def refuse_options(options: dict[str, Any] | None, known: tuple[str, ...]) -> None:
    """Check the options of a reset.

    Raises:
        ValueError: One of them is unknown.

    """
    for name in options or {}:
        if name not in known:
            wanted = " or ".join(map(repr, known))
            raise ValueError(
                f"options: found {name!r}; wanted {wanted}: task, hand and training are arguments of make"
            )
