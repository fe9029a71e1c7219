"""Memory over many resets, measured by `benchmarks/leaks.py`."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

BENCHMARK = Path(__file__).parents[1] / "benchmarks/leaks.py"
# Limit, bytes per reset. A quarter of the resets open a `World` of 35 kB, so a leak grows by 8750 bytes per
# reset. The resident memory varies by about 2 MB: 1850 bytes per reset over 1200 resets, of which the first
# tenth does not count, and 3700 over 600.
LEAK = 4000.0


def growth(*options: str) -> float:
    """Return the growth of a process, bytes per reset."""
    command = [sys.executable, str(BENCHMARK), *options]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    found = re.search(r"(-?[\d.]+) bytes a reset", printed)
    assert found is not None, printed
    return float(found[1])


def test_nothing_is_left_of_a_run() -> None:
    assert growth("--resets", "1200") < LEAK


def test_a_leak_is_noticed() -> None:
    assert growth("--resets", "600", "--hold") > LEAK
