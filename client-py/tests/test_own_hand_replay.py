"""A replay of a world with a hand of one's own has the hand's files."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.real_server import PROGRAM, needs_server

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

PINCH = Path(__file__).parents[2] / "models/hands/pinch"


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """Return the folder of a hand that is heavier than the built-in one of its name."""
    folder = tmp_path / "own"
    shutil.copytree(PINCH, folder)
    urdf = (folder / "hand.urdf").read_text()
    assert '<mass value="' in urdf
    (folder / "hand.urdf").write_text(urdf.replace('<mass value="0.', '<mass value="1.', 1))
    return folder


@needs_server
def test_the_program_verifies_it_without_the_folder(own: Path, tmp_path: Path) -> None:
    assert PROGRAM is not None
    world = sim.World("grasp", str(own), seed=3)
    world.step(hand=[0.5, 0.5], repeat=30)
    world.save_replay(tmp_path / "own.mcap")
    shutil.rmtree(own)
    subprocess.run([PROGRAM, "verify", tmp_path / "own.mcap"], check=True, capture_output=True)


def test_files_that_have_changed_since_are_refused(own: Path, tmp_path: Path) -> None:
    world = sim.World("grasp", str(own), seed=3)
    world.step(repeat=2)
    shutil.copy(PINCH / "hand.urdf", own)
    with pytest.raises(ValueError, match="own: the packed files give another hand"):
        world.save_replay(tmp_path / "own.mcap")
    assert not (tmp_path / "own.mcap").exists()
