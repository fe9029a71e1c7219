"""Without Ray the error is one line with the command to install it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

INSTALL = "palmares.ray needs Ray: pip install 'palmares[ray]'"
TUNE = "this needs Ray Tune: pip install 'ray[tune]'"


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    (folder / "ray.py").write_text("raise ModuleNotFoundError('ray')")
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    command = [sys.executable, *arguments]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)


def test_the_package_names_the_remedy(tmp_path: Path) -> None:
    done = run(tmp_path, "-c", "import palmares, palmares.evaluate")
    assert (done.returncode, done.stderr) == (0, "")
    done = run(tmp_path, "-c", "import palmares.ray")
    assert done.stderr.splitlines()[-1] == f"ImportError: {INSTALL}"


def test_the_command_names_the_remedy(tmp_path: Path) -> None:
    done = run(tmp_path, "-m", "palmares", "evaluate", "any.py", "--quiet", "--ray")
    assert (done.returncode, done.stderr) == (1, f"palmares evaluate: {INSTALL}\n")


def test_the_example_names_the_remedy(tmp_path: Path) -> None:
    pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")
    done = run(tmp_path, "-m", "palmares.examples.train_grasp_tune")
    assert (done.returncode, done.stderr) == (1, f"{TUNE}\n")
