"""Recorded runs as arrays and figures."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import palmares

pytest.importorskip("palmares.sim", reason="the compiled part of the package is not there")
from palmares.sim import Recording, State, World

TICKS = 160


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[State], list[float]]:
    """Return a replay, and the states and scores of its run."""
    world = World("grasp", "softhand", seed=1)
    states, scores = [world.state()], [world.score]
    for tick in range(TICKS):
        world.step(base=palmares.twist((0.0, 0.0, -0.25), (0.0, 0.0, 0.0)), hand=[0.0 if tick < 110 else 1.0])
        states.append(world.state())
        scores.append(world.score)
    path = tmp_path_factory.mktemp("recording") / "run.mcap"
    world.save_replay(path, team="crabs")
    return path, states, scores


def test_arrays_are_the_states_of_the_run_bit_for_bit(played: tuple[Path, list[State], list[float]]) -> None:
    path, states, scores = played
    recording = Recording(path)
    assert (recording.task, recording.hand, recording.seed, recording.team) == (
        "grasp",
        "softhand",
        1,
        "crabs",
    )
    assert recording.ticks == TICKS
    arrays = recording.arrays()
    for name in ("base", "q", "joint_velocity", "motors", "objects", "tension"):
        assert (arrays[name] == np.stack([getattr(state, name) for state in states])).all(), name
    assert arrays["time"] == pytest.approx(np.arange(TICKS + 1) * recording.tick_s)
    assert arrays["score"].tolist() == scores
    names = recording.names
    for name, kind in (("finger_force", "fingers"), ("object_force", "objects"), ("command", "motors")):
        assert arrays[name].shape[:2] == (TICKS + 1, len(names[kind])), name
    assert arrays["command"][[0, 50, -1], 0].tolist() == [0.0, 0.0, 1.0]
    # The hand presses on the object, which presses back on the fingers.
    assert np.linalg.norm(arrays["object_force"], axis=-1).max() > 0.1
    assert np.linalg.norm(arrays["finger_force"], axis=-1).max() > 0.1
    arrays["q"][:] = 0.0
    assert recording.arrays()["q"].any()


def test_a_replay_is_read_from_bytes_and_shows_its_run(played: tuple[Path, list[State], list[float]]) -> None:
    path, _, _ = played
    recording = Recording(path.read_bytes())
    assert repr(recording).startswith("<Recording of grasp with softhand, seed 1: score ")
    assert f"{TICKS} ticks, 1.6 s, stopped" in repr(recording)
    assert recording.state_hash == Recording(path).state_hash


def test_damage_is_refused_with_its_reason(played: tuple[Path, list[State], list[float]]) -> None:
    data = bytearray(played[0].read_bytes())
    with pytest.raises(ValueError, match="not_a_replay"):
        Recording(b"no replay")
    with pytest.raises(ValueError, match="truncated"):
        Recording(bytes(data[: len(data) // 2]))
    with pytest.raises(FileNotFoundError):
        Recording("no_such.mcap")


def test_the_figure_has_a_row_for_each_quantity(played: tuple[Path, list[State], list[float]]) -> None:
    pytest.importorskip("matplotlib", reason="matplotlib is not installed")
    recording = Recording(played[0])
    figure = recording.plot()
    labels = [axis.get_ylabel() for axis in figure.axes]
    wanted = ["score", "motor σ", "tension, N", "force on\nfinger, N", "height of\nbase, m"]
    assert labels == wanted
    height = figure.axes[-1].lines[0]
    assert height.get_ydata() == pytest.approx(recording.arrays()["base"][:, 2])
    assert figure._repr_png_().startswith(b"\x89PNG")


def test_without_matplotlib_the_error_names_the_package(
    played: tuple[Path, list[State], list[float]],
) -> None:
    code = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "from palmares.sim import Recording\n"
        f"Recording({str(played[0])!r}).plot()"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert "plot() needs matplotlib: pip install 'palmares[plot]'" in ended.stderr
