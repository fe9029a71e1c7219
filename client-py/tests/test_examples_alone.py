"""Every example as somebody has it who copied that one file: beside it nothing but the package."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("*.py"))


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    # As if the packages of the development environment were not there.
    missing = folder / "missing"
    missing.mkdir(exist_ok=True)
    for name in ("mcap", "gymnasium"):
        (missing / f"{name}.py").write_text(f"raise ModuleNotFoundError({name!r})")
    environment = {**os.environ, "PYTHONPATH": str(missing)}
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_a_copied_example_explains_itself(example: Path, tmp_path: Path) -> None:
    shutil.copy(example, tmp_path)
    told = run(tmp_path, example.name, "--help")
    assert told.returncode == 0, told.stderr
    assert "usage: " in told.stdout
    assert "no server" not in told.stdout + told.stderr
    options = [line for line in told.stdout.splitlines() if line.startswith("  -")]
    assert len(options) >= 3, told.stdout


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_without_a_server_it_says_so_in_a_line(example: Path, tmp_path: Path) -> None:
    shutil.copy(example, tmp_path)
    if example.stem == "leaderboard_from_replays":
        told = run(tmp_path, example.name, str(tmp_path), "--key", "00" * 32)
        assert told.stderr == "this needs the package mcap: pip install mcap\n"
    else:
        told = run(tmp_path, example.name, "--url", "http://127.0.0.1:9")
        assert told.stderr.startswith("no server at http://127.0.0.1:9"), told.stderr
        assert told.stderr.count("\n") == 1, told.stderr
    assert told.returncode == 1
