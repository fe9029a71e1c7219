"""The bridges without their packages: the command that installs them is printed."""

from __future__ import annotations

import subprocess
import sys

import pytest


@pytest.mark.parametrize(("command", "package"), [("foxglove", "foxglove"), ("ros2", "cyclonedds")])
def test_a_missing_package_is_named(command: str, package: str) -> None:
    program = (
        f"import sys; sys.modules[{package!r}] = None; sys.argv = ['palmares', {command!r}]; "
        "from palmares.program import main; sys.exit(main())"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert f"pip install 'palmares[{command}]'" in done.stderr, done.stderr
