"""Tasks of one's own, which are given by the folder they lie in."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any


def read(task: str | os.PathLike[str]) -> dict[str, Any]:
    """Return what the ``task.toml`` of this folder, or this file, says; nothing if there is none."""
    path = Path(task)
    try:
        with (path / "task.toml" if path.is_dir() else path).open("rb") as file:
            return tomllib.load(file)
    except (OSError, ValueError):
        return {}


def name_of(task: str | os.PathLike[str], known: Iterable[str]) -> str:
    """Return the name by which a server knows a task: one of the `known`, or what its folder tells."""
    given = os.fspath(task)
    return given if given in known else str(read(given).get("name", given))
