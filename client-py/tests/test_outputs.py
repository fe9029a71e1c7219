"""A long command tries its files first, and prints its table whatever happens."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

from palmares.outputs import output_file, output_folder, shown

# Says that it has played, and then destroys the folder of the table.
CONTROLLER = """
import pathlib, shutil
HERE = pathlib.Path(__file__).parent
def run(client, seed):
    (HERE / "played").touch()
    shutil.rmtree(HERE / "tables", ignore_errors=True)
    client.reset("balls", "softhand", seed=seed)
    client.step(hand=[0.5], repeat=3)
    return client.stop()
"""
NOWHERE = "/proc/none/x.md" if Path("/proc").exists() else "nul:/x.md"


def run(folder: Path, *arguments: str, **variables: str) -> subprocess.CompletedProcess[bytes]:
    environment = {**os.environ, **variables}
    return subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=environment, capture_output=True, check=False
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "controller.py").write_text(CONTROLLER)
    return tmp_path


EVALUATE = ("-m", "palmares", "evaluate", "controller.py", "--seeds", "1-2", "--jobs", "1", "--quiet")


@pytest.mark.parametrize("option", ["--markdown", "--replays"])
def test_a_file_that_cannot_be_written_is_refused_before_the_first_run(option: str, folder: Path) -> None:
    done = run(folder, *EVALUATE, option, NOWHERE)
    assert done.returncode == 2
    assert f"argument {option}" in done.stderr.decode()
    assert "cannot be written" in done.stderr.decode()
    assert not (folder / "played").exists()


def test_the_table_is_printed_also_if_its_file_cannot_be_written_in_the_end(folder: Path) -> None:
    (folder / "tables").mkdir()
    done = run(folder, *EVALUATE, "--markdown", "tables/table.md")
    assert done.returncode == 1
    assert b"controller.py  balls" in done.stdout
    assert b"tables/table.md" in done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_the_table_is_printed_also_if_standard_output_is_full(folder: Path) -> None:
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run(
            [sys.executable, *EVALUATE], cwd=folder, stdout=full, stderr=subprocess.PIPE, check=False
        )
    assert done.returncode == 1
    assert b"controller.py  balls" in done.stderr


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_every_terminal_shows_a_table_and_an_observation(encoding: str, folder: Path) -> None:
    table = run(folder, *EVALUATE, PYTHONIOENCODING=encoding)
    assert table.returncode == 0, table.stderr
    assert ("0.00 … 0.00" if encoding == "cp1252" else "0.00 ... 0.00") in table.stdout.decode(encoding)
    code = (
        "import palmares; c = palmares.Client('local'); obs = c.reset('grasp', 'softhand', seed=1);"
        "print(obs, repr(obs.hand), c.scene, c.describe_hand('softhand'));"
        "print(palmares.PalmaresError('reset(…)'))"
    )
    said = run(folder, "-c", code, PYTHONIOENCODING=encoding)
    assert said.returncode == 0, said.stderr
    assert "sigma 0.000 of 0.000 commanded" in said.stdout.decode(encoding)


def test_the_demo_tries_the_place_of_its_replay_first(tmp_path: Path) -> None:
    # The program would fail, but is not started.
    done = run(tmp_path, "-m", "palmares", "demo", "--program", "/bin/false", "--replay", NOWHERE)
    assert done.returncode == 2
    assert "argument --replay" in done.stderr.decode()
    assert "name another place" in done.stderr.decode()


def test_a_file_that_is_there_stays_as_it_is_and_a_new_one_is_not_made(tmp_path: Path) -> None:
    old, new = tmp_path / "old.md", tmp_path / "new.md"
    old.write_text("mine")
    assert output_file(str(old)) == old
    assert output_file(str(new)) == new
    assert output_folder(str(tmp_path / "a/b")) == tmp_path / "a/b"
    assert old.read_text() == "mine"
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["a", "b", "old.md"]
    with pytest.raises(argparse.ArgumentTypeError, match=r"cannot be written: .*; name another place"):
        output_folder(str(old))


def test_a_text_is_shown_as_it_is_where_it_can_be(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal:
        encoding: str | None = "utf-8"

    monkeypatch.setattr(sys, "stdout", Terminal())
    assert shown("σ … 蟹") == "σ … 蟹"
    Terminal.encoding = "ascii"
    assert shown("σ … 90° 蟹") == "sigma ... 90 deg ?"
    Terminal.encoding = None
    assert shown("σ") == "σ"


def test_the_help_of_the_program_lists_its_commands_in_python(tmp_path: Path) -> None:
    from palmares.program import COMMANDS

    said = run(tmp_path, "-m", "palmares", "--help").stdout.decode()
    for command in COMMANDS:
        assert f"\n  palmares {command} " in said, command
