"""``palmares demo``."""

import json
import subprocess
import sys
from pathlib import Path

from tests.real_server import PROGRAM, needs_server


@needs_server
def test_it_plays_a_run_and_keeps_the_replay(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "palmares", "demo", "--task", "grasp", "--seed", "2", "--json"]
    done = subprocess.run(
        [*command, "--program", str(PROGRAM), "--replay", str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    outcome = json.loads(done.stdout)
    assert outcome["leaderboard"][0]["tasks"]["grasp"]["score"] == outcome["score"]
    assert Path(outcome["replay"]).stat().st_size > 0
    assert "/live" in done.stderr
    verified = subprocess.run([str(PROGRAM), "verify", outcome["replay"]], capture_output=True, check=False)
    assert verified.returncode == 0


def test_a_wrong_program_is_an_error(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "palmares", "demo", "--program", "/bin/false"]
    done = subprocess.run(
        [*command, "--replay", str(tmp_path)], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert done.returncode == 1
    assert "`/bin/false serve" in done.stderr
    assert "does not start" in done.stderr
