"""Films by the program of the package, with the ffmpeg of imageio-ffmpeg."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import palmares

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not there")


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """Return the replay of a short run."""
    world = sim.World("grasp", "pinch", seed=1)
    world.step(base=palmares.twist((0.0, 0.0, -0.2), (0.0, 0.0, 0.0)), hand=[0.5, 0.5], repeat=30)
    world.save_replay(tmp_path / "run.mcap")
    return tmp_path / "run.mcap"


def render(run: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Run ``palmares render``."""
    command = [sys.executable, "-m", "palmares", "render", str(run), *options]
    environment = {name: value for name, value in os.environ.items() if name != "PALMARES_PYTHON"}
    return subprocess.run(command, capture_output=True, text=True, check=False, env=environment)


def test_a_picture_is_that_of_the_world(run: Path, tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image", reason="Pillow is not installed")
    world = sim.World("grasp", "pinch", seed=1)
    world.step(base=palmares.twist((0.0, 0.0, -0.2), (0.0, 0.0, 0.0)), hand=[0.5, 0.5], repeat=30)
    ended = render(run, "--output", str(tmp_path / "end.png"), "--size", "96x64")
    assert ended.returncode == 0, ended.stderr
    drawn = world.pictures("film", (96, 64), "film")["film"]
    assert (np.asarray(image.open(tmp_path / "end.png")) == drawn).all()


def test_a_film_has_the_length_of_its_part_of_the_run(run: Path, tmp_path: Path) -> None:
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg", reason="imageio-ffmpeg is not installed")
    film = tmp_path / "run.mp4"
    ended = render(run, "-o", str(film), "--size", "96x64", "--fps", "50", "--speed", "0.5", "--to", "0.2")
    assert ended.returncode == 0, ended.stderr
    assert re.search(r"run\.mp4: 21 pictures of 96 × 64 pixels in ", ended.stdout)
    frames = imageio_ffmpeg.read_frames(str(film))
    facts = next(frames)
    assert facts["size"] == (96, 64)
    assert facts["fps"] == pytest.approx(50.0)
    assert sum(1 for _ in frames) == 21
    odd = render(run, "-o", str(film), "--size", "95x64")
    assert odd.returncode == 1
    assert "--size 95x64: an .mp4 needs an even width and an even height" in odd.stderr
