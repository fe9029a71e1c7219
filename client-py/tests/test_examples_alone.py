"""Every example as a copy in another folder, with only the package installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parent.parent / "src/palmares/examples").glob("[!_]*.py"))
# These play in their own process, with the compiled part of the package.
LEARNERS = [path for path in EXAMPLES if path.stem.startswith(("train_", "mppi_"))]


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    # Hide the packages of the development environment.
    missing = folder / "missing"
    missing.mkdir(exist_ok=True)
    for name in ("mcap", "gymnasium", "stable_baselines3"):
        (missing / f"{name}.py").write_text(f"raise ModuleNotFoundError({name!r})")
    environment = {**os.environ, "PYTHONPATH": str(missing)}
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_a_copied_example_explains_itself(example: Path, tmp_path: Path) -> None:
    if example in LEARNERS:
        pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")
    shutil.copy(example, tmp_path)
    done = run(tmp_path, example.name, "--help")
    assert done.returncode == 0, done.stderr
    assert "usage: " in done.stdout
    assert "no server" not in done.stdout + done.stderr
    options = [line for line in done.stdout.splitlines() if line.startswith("  -")]
    assert len(options) >= 3, done.stdout


@pytest.mark.parametrize(
    "example", [path for path in EXAMPLES if path not in LEARNERS], ids=lambda path: path.stem
)
def test_a_missing_server_is_reported_in_one_line(example: Path, tmp_path: Path) -> None:
    shutil.copy(example, tmp_path)
    if example.stem == "leaderboard_from_replays":
        done = run(tmp_path, example.name, str(tmp_path), "--key", "00" * 32)
        assert done.stderr == "this needs the package mcap: pip install mcap\n"
    else:
        done = run(tmp_path, example.name, "--url", "http://127.0.0.1:9")
        assert done.stderr.startswith("no server at http://127.0.0.1:9"), done.stderr
        assert done.stderr.count("\n") == 1, done.stderr
    assert done.returncode == 1


def test_a_missing_library_is_reported_in_one_line(tmp_path: Path) -> None:
    pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")
    shutil.copy(next(path for path in LEARNERS if path.stem == "train_lift_sb3"), tmp_path)
    done = run(tmp_path, "train_lift_sb3.py")
    assert done.stderr == "this needs stable-baselines3: pip install 'palmares[learn]'\n"
    assert done.returncode == 1
