"""A copy of the task `grasp` with a short time limit, for tests of the end of a run."""

from __future__ import annotations

from pathlib import Path

GRASP = Path(__file__).parents[2] / "tasks/grasp/task.toml"


def short_grasp(folder: Path, limit_s: float) -> str:
    """Write the copy into a folder; return its path."""
    text = GRASP.read_text()
    changes = (
        ('name = "grasp"', 'name = "short-grasp"'),
        ("time_limit_s = 120.0", f"time_limit_s = {limit_s}"),
    )
    for old, new in changes:
        assert text.count(old) == 1
        text = text.replace(old, new)
    (folder / "task.toml").write_text(text)
    return str(folder)
