"""Memory over resets, by the benchmark that does 100,000 of them."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

BENCHMARK = Path(__file__).parents[1] / "benchmarks/leaks.py"
# Bytes a reset: a quarter of the resets open a `World` of 35 kB, and what is read sways by about 2 MB.
LEAK = 4000.0


def grown(*options: str) -> float:
    """Return by how many bytes a process grows with every reset."""
    command = [sys.executable, str(BENCHMARK), "--resets", "1200", *options]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    found = re.search(r"(-?[\d.]+) bytes a reset", told)
    assert found is not None, told
    return float(found[1])


def test_nothing_is_left_of_a_run() -> None:
    assert grown() < LEAK


def test_it_would_be_noticed() -> None:
    assert grown("--hold") > LEAK
