"""``palmares verify --ray`` on a real Ray cluster of this machine, of which a worker is killed.

Needs ``pip install 'palmares[ray]'``, which the development packages do not have.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ray = pytest.importorskip("ray", reason="Ray is not installed: pip install 'palmares[ray]'")
sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

PROGRAM = [sys.executable, "-m", "palmares", "verify", "--json"]
ENVIRONMENT = {**os.environ, "PALMARES_PYTHON": sys.executable, "RAY_USAGE_STATS_ENABLED": "0"}


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    from ray.cluster_utils import Cluster

    node = {"num_cpus": 2, "include_dashboard": False, "object_store_memory": 100 << 20}
    made = Cluster(initialize_head=True, head_node_args=node)
    yield made.address
    made.shutdown()


@pytest.fixture(scope="module")
def season(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with sound replays, one of another engine's making and a cut one."""
    folder = tmp_path_factory.mktemp("season")
    for seed in range(1, 9):
        world = sim.World("balls", "softhand", seed)
        world.step(hand=0.3, repeat=1500)
        world.save_replay(folder / f"run_{seed}.mcap")
    (folder / "deeper").mkdir()
    whole = (folder / "run_1.mcap").read_bytes()
    (folder / "deeper/cut.mcap").write_bytes(whole[: len(whole) // 2])
    return folder


def lines(text: str) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    found = [json.loads(line) for line in text.splitlines()]
    return found[:-1], found[-1]["summary"]


def workers() -> list[int]:
    """Return the processes that verify a replay for Ray."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if (process / "cmdline").read_bytes().startswith(b"ray::check_replay"):
                found.append(int(process.name))
    return found


def test_a_cluster_gives_the_same_verdicts_also_when_a_worker_is_killed(cluster: str, season: Path) -> None:
    here = subprocess.run([*PROGRAM, season], capture_output=True, text=True, env=ENVIRONMENT, check=False)
    with subprocess.Popen(
        [*PROGRAM, f"--ray={cluster}", season],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
    ) as verifying:
        killed = 0
        while killed < 2 and verifying.poll() is None:
            for worker in workers()[:1]:
                # Its replay is being verified now: the process has this name during the task only.
                with contextlib.suppress(ProcessLookupError):
                    os.kill(worker, signal.SIGKILL)
                    killed += 1
            time.sleep(0.2)
        out, err = verifying.communicate()
    assert killed == 2, err
    expected, summary = lines(here.stdout)
    found, of_cluster = lines(out)
    assert found == expected, err
    assert [line["verdict"] for line in found] == ["refused", *["verified"] * 8]
    assert (verifying.returncode, here.returncode) == (1, 1)
    del summary["elapsed_s"], of_cluster["elapsed_s"]
    assert of_cluster == summary
    assert "9 of 9 replays in" in err


def test_another_build_is_refused(cluster: str) -> None:
    command = [
        sys.executable,
        "-m",
        "palmares.program.verify_season",
        "--build",
        "0.0.1",
        "--address",
        cluster,
    ]
    done = subprocess.run(command, input="", capture_output=True, text=True, env=ENVIRONMENT, check=False)
    assert done.returncode == 1
    assert "not 0.0.1: install the same version" in json.loads(done.stdout)["failed"]
