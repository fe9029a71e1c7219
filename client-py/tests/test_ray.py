"""Evaluation and worlds on a real Ray cluster of two nodes on this machine, of which one is killed.

Needs ``pip install 'palmares[ray]'``, which the development packages do not have.
"""

from __future__ import annotations

import contextlib
import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import palmares
from palmares.evaluate import ControllerError, Played, Report, evaluate, processes
from palmares.program.evaluate import main

ray = pytest.importorskip("ray", reason="Ray is not installed: pip install 'palmares[ray]'")
sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

import palmares.ray  # noqa: E402
from palmares.ray import parcel  # noqa: E402

HANDS = Path(__file__).parents[2] / "models/hands"
TASKS = Path(__file__).parents[2] / "tasks"
IDLE = """
def run(client, seed, task="grasp", hand="softhand"):
    client.reset(task, hand, seed=seed)
    client.step(repeat=3)
    return client.stop()
"""
# A controller with modules in its folder, one of them imported late.
PARTED = """
import os
from parts import ticks
from parts.more import *
def run(client, seed, task, hand):
    from late import MORE
    for path in (__file__, task, hand):
        assert not os.path.abspath(path).startswith({forbidden!r}), path
    client.reset(task, hand, seed=seed)
    client.step(repeat=ticks.FEW + MORE)
    return client.stop()
"""
# Runs on a node wait for runs on the other node; those on the node to be killed wait for its end.
HELD = """
import os, pathlib, time
NODES = pathlib.Path({folder!r})
def run(client, seed):
    client.reset("grasp", "softhand", seed=seed)
    if {doomed!r}:
        import ray
        node = ray.get_runtime_context().get_node_id()
        (NODES / f"{{seed}} {{node}}").touch()
        while not (NODES / "killed").exists():
            if node != {doomed!r} and any({doomed!r} in path.name for path in NODES.iterdir()):
                break
            time.sleep(0.01)
    client.step(hand=0.5, repeat=20)
    return client.stop()
"""

Nodes = dict[str, Any]


def written(path: Path, text: str) -> str:
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    return str(path)


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    from ray.cluster_utils import Cluster

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        made = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, **NODE})
        made.add_node(num_cpus=1, **NODE)
        ray.init(made.address, logging_level="WARNING", log_to_driver=False)
        yield made
        ray.shutdown()
        made.shutdown()


NODE = {"include_dashboard": False, "object_store_memory": 100 << 20}


def runs_of(report: Report) -> list[tuple[str, str, int, float, str, str | None]]:
    runs = [run for row in report.rows for run in row.runs]
    return [(run.task, run.hand, run.seed, run.score, run.state_hash, run.error) for run in runs]


@pytest.mark.usefixtures("cluster")
def test_files_of_a_controller_are_sent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here = tmp_path / "here"
    written(here / "parted.py", PARTED.format(forbidden=str(here)))
    written(here / "late.py", "MORE = 2")
    written(here / "other.py", "raise RuntimeError('no module imports this')")
    written(here / "parts/__init__.py", "")
    written(here / "parts/ticks.py", "from . import few\nFEW = few.FEW")
    written(here / "parts/few.py", "FEW = 3")
    written(here / "parts/more.py", "")
    shutil.copytree(HANDS / "pinch", here / "own")
    shutil.copytree(TASKS / "grasp", here / "task")
    (here / "own/notes.txt").write_text("not part of it")
    monkeypatch.chdir(here)
    packed = parcel.of_controller("parted.py")
    assert packed is not None
    assert sorted(packed.files) == [
        "late.py", "parted.py", "parts/__init__.py", "parts/few.py", "parts/more.py", "parts/ticks.py",
    ]  # fmt: skip
    hand = parcel.of_files("own")
    assert hand is not None
    assert sorted(hand.files) == ["hand.toml", "hand.urdf"]
    report = palmares.ray.evaluate("parted.py", "task", ["own", "own/hand.urdf"], range(1, 5), progress=False)
    (here / "parted.py").write_text(PARTED.format(forbidden="/nowhere"))
    expected = evaluate("parted.py", "task", ["own", "own/hand.urdf"], range(1, 5), pool=processes(1))
    assert runs_of(report) == runs_of(expected)
    assert [row.failed for row in report.rows] == [0, 0]


def test_a_lost_node_changes_nothing(cluster: Any, tmp_path: Path) -> None:
    doomed = cluster.add_node(num_cpus=1, **NODE)
    folder = tmp_path / "nodes"
    folder.mkdir()
    text = HELD.format(folder=str(folder), doomed=doomed.node_id)
    controller = written(tmp_path / "held.py", text)

    def on_played(played: Played) -> None:
        assert played.error is None
        if not (folder / "killed").exists():
            cluster.remove_node(doomed, allow_graceful=False)
            (folder / "killed").touch()

    found = evaluate(controller, seeds=range(1, 9), pool=palmares.ray.pool(), on_played=on_played)
    began = [path.name.split() for path in folder.iterdir() if path.name != "killed"]
    lost = [seed for seed, node in began if node == doomed.node_id]
    assert len(lost) == 1
    assert sorted(seed for seed, _ in began) == sorted([*map(str, range(1, 9)), *lost])
    written(tmp_path / "held.py", HELD.format(folder="", doomed=""))
    assert runs_of(found) == runs_of(evaluate(controller, seeds=range(1, 9), pool=processes(2)))


@pytest.mark.usefixtures("cluster")
def test_a_run_that_ends_every_worker_has_failed(tmp_path: Path) -> None:
    text = IDLE.replace("    client.step", "    seed == 2 and __import__('os')._exit(3)\n    client.step")
    controller = written(tmp_path / "dies.py", text)
    report = palmares.ray.evaluate(controller, "grasp", seeds=[1, 2, 3], progress=False, max_retries=1)
    (row,) = report.rows
    assert [run.error is None for run in row.runs] == [True, False, True]
    assert row.runs[1].error is not None
    assert row.runs[1].error.startswith("its worker was lost: The worker died unexpectedly")


@pytest.mark.usefixtures("cluster")
def test_another_build_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("palmares.ray.runs.build", lambda: "0.0.1, build 1234")
    controller = written(tmp_path / "idle.py", IDLE)
    with pytest.raises(ControllerError, match=r"not 0.0.1, build 1234: install the same wheel everywhere"):
        palmares.ray.evaluate(controller, "grasp", seeds=[1, 2], progress=False)


@pytest.mark.usefixtures("cluster")
def test_the_command_plays_on_a_cluster(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    controller, folder = written(tmp_path / "idle.py", IDLE), tmp_path / "replays"
    code = main([controller, "--seeds", "3", "--quiet", "--json", "--replays", str(folder), "--ray"])
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert (code, row["failed"], row["controller"]) == (0, 0, controller)
    assert {run["replay"] for run in row["runs"]} == {str(path) for path in folder.iterdir()}
    assert [path.stat().st_size > 1000 for path in folder.iterdir()] == [True] * 3


def closing(width: int) -> Callable[[dict[str, Any]], Any]:
    """Return a policy that counts its calls, which shows a copy that is used twice."""
    calls = [0]

    def policy(observations: dict[str, Any]) -> Any:
        calls[0] += 1
        actions = np.zeros((len(observations["base"]), width))
        actions[:, 6:] = min(1.0, 0.1 * calls[0])
        return actions

    return policy


@pytest.mark.usefixtures("cluster")
def test_rollouts_are_those_of_a_batch_here() -> None:
    seeds = [7, 3, 5, 1, 2]
    report = palmares.ray.rollouts(
        closing(8), "grasp", "pinch", seeds, worlds=2, ticks=500, name="closing", progress=False
    )
    batch = sim.Batch("grasp", "pinch", 5)
    observations, policy = batch.reset(sorted(seeds)), closing(8)
    while not batch.done.all():
        observations = batch.step(policy(observations), 500, ~batch.done).observations
    (row,) = report.rows
    assert (row.controller, row.failed) == ("closing", 0)
    expected = [batch.result(k) for k in range(5)]
    assert [run.state_hash for run in row.runs] == [result["state_hash"] for result in expected if result]
    assert [run.score for run in row.runs] == list(batch.scores)


@pytest.mark.usefixtures("cluster")
def test_an_actor_with_worlds_comes_back_without_runs() -> None:
    first, second = palmares.ray.batches(2, "grasp", "pinch", worlds=2)
    ray.get([first.reset.remote([1, 2]), second.reset.remote([3, 4])])
    actions = np.full((2, 8), 0.1)
    stepped = ray.get([actor.step.remote(actions, 5) for actor in (first, second)])
    assert [one.rewards.shape for one in stepped] == [(2,), (2,)]
    hashes = ray.get(first.state_hashes.remote())
    kept = ray.get(first.snapshot.remote(0))
    ray.kill(first, no_restart=False)

    def step_until_it_fails() -> None:
        while True:  # The actor may take a step or two before it is ended.
            with contextlib.suppress(ray.exceptions.ActorUnavailableError):
                ray.get(first.step.remote(actions, 5))

    with pytest.raises(ValueError, match="world 0 has no run yet: call reset first"):
        step_until_it_fails()
    ray.get(first.reset.remote([1, 2]))
    ray.get(first.step.remote(actions, 5))
    assert ray.get(first.state_hashes.remote()) == hashes
    ray.get(first.restore.remote(0, kept))
    assert ray.get(first.state_hashes.remote()) == hashes


def test_rllib_finds_the_environments() -> None:
    missing = "Ray Tune is not installed: pip install 'ray[tune]'"
    pytest.importorskip("ray.tune", reason=missing, exc_type=ImportError)
    import gymnasium
    from ray.tune.registry import ENV_CREATOR, _global_registry

    ids = palmares.ray.register_envs()
    assert ids == [name for name in gymnasium.registry if name.startswith("palmares/")]
    env = _global_registry.get(ENV_CREATOR, ids[-1])({"ticks": 20})
    assert isinstance(env.observation_space, gymnasium.spaces.Box)
    observation, _ = env.reset(seed=3)
    assert observation in env.observation_space
    observation, *_ = env.step(env.action_space.sample())
    assert observation in env.observation_space
    env = _global_registry.get(ENV_CREATOR, ids[-1])({"flatten": False, "sensing": "sensors"})
    assert set(env.reset(seed=3)[0]) == {"base", "motors", "wrist", "time_left"}


@pytest.mark.usefixtures("cluster")
def test_tune_searches_a_grasp(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    missing = "Ray Tune is not installed: pip install 'ray[tune]'"
    pytest.importorskip("ray.tune", reason=missing, exc_type=ImportError)
    from palmares.examples.train_grasp_tune import main as search

    words = ["--samples", "3", "--seeds", "2", "--unseen", "2", "--folder", str(tmp_path)]
    assert search(words) == 0
    printed = capfd.readouterr().out
    assert "Trial status: 3 TERMINATED" in printed
    assert "in 2 other scenes: " in printed
