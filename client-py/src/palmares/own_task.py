"""Tasks of a user, named by their folder."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any


def read(task: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the contents of a task's folder or ``task.toml``; empty if there is none."""
    path = Path(task)
    try:
        with (path / "task.toml" if path.is_dir() else path).open("rb") as file:
            return tomllib.load(file)
    except (OSError, ValueError):
        return {}


def name_of(task: str | os.PathLike[str], known: Iterable[str]) -> str:
    """Return the name of a task on a server: one of the `known`, or the name in its ``task.toml``."""
    given = os.fspath(task)
    return given if given in known else str(read(given).get("name", given))
