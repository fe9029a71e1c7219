"""Tasks of a user, by their paths."""

import re
import shutil
import subprocess
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import palmares
import palmares.gym
from palmares import own_task
from palmares.evaluate import evaluate, processes
from palmares.examples import pan_softhand, peg_softhand
from palmares.sim import Batch, World
from tests.real_server import PROGRAM, RealServer, needs_server

DOCUMENT = Path(__file__).parents[2] / "docs/tasks.md"
CUBE = Path(__file__).parents[2] / "tasks/tests/cube.toml"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    own = tmp_path / "cube"
    own.mkdir()
    shutil.copy(CUBE, own / "task.toml")
    return own


def test_a_world_takes_the_path_of_a_task(folder: Path) -> None:
    world = World(str(folder), "pinch", seed=2)
    assert world.run.task == "cube"
    assert [body.name for body in world.scene.free] == ["cube", "post"]
    world.step(hand=[0.5, 0.2], repeat=20)
    result = world.result()
    assert result.score == 0.0
    assert len(result.task_hash) == 64
    again = World(str(folder / "task.toml"), "pinch", seed=2)
    again.step(hand=[0.5, 0.2], repeat=20)
    assert again.result().state_hash == result.state_hash


def test_a_batch_takes_it_too(folder: Path) -> None:
    batch = Batch(str(folder), "pinch", 2, threads=1)
    found = batch.reset([1, 2])
    assert found["objects"].shape == (2, 2, 13)
    assert not np.array_equal(found["objects"][0], found["objects"][1])


def test_environments_take_it_too(folder: Path) -> None:
    many = gymnasium.make_vec("palmares/Balls-Pinch-v1", num_envs=2, task=str(folder), threads=1)
    observations, _ = many.reset(seed=3)
    for env in (
        gymnasium.make("palmares/Balls-Pinch-v1", task=str(folder)),
        palmares.gym.FlatEnv(str(folder), "pinch"),
        palmares.gym.PalmaresEnv("local", task=str(folder), hand="pinch", objects=2),
    ):
        found, _ = env.reset(seed=3)
        assert env.observation_space == many.single_observation_space
        assert np.array_equal(found["objects"], observations["objects"][0])
    with pytest.raises(ValueError, match=r"\"no-such/\" is neither a task of the program .* nor a folder"):
        gymnasium.make("palmares/Balls-Pinch-v1", task="no-such/")


@needs_server
def test_the_folder_of_a_task_plays_on_a_server_and_locally(folder: Path, tmp_path: Path) -> None:
    controller = tmp_path / "push.py"
    controller.write_text(
        "def run(client, seed):\n"
        f"    client.reset({str(folder)!r}, 'pinch', seed=seed)\n"
        "    client.step(hand=[0.5, 0.5], repeat=5)\n"
        "    return client.stop()\n"
    )
    with RealServer(tmp_path / "data", "--task", str(folder)) as server:
        env = gymnasium.make("palmares/Balls-Pinch-v1", task=str(folder), url=server.url)
        found, _ = env.reset(seed=2)
        assert found["objects"].shape == (2, 13)
        env.close()
        there = evaluate(str(controller), seeds=[2], url=server.url, pool=processes(1)).rows[0]
        here = evaluate(str(controller), seeds=[2], pool=processes(1)).rows[0]
        assert (there.failed, here.failed) == (0, 0)
        assert there.runs[0].state_hash == here.runs[0].state_hash
        row = evaluate(str(controller), str(folder), seeds=[2], url=server.url, pool=processes(1)).rows[0]
        assert (row.task, row.failed) == ("cube", 0)
        with palmares.Client(server.url) as client, pytest.raises(palmares.UnknownTaskError):
            client.reset(str(tmp_path), "pinch")


def test_the_name_of_a_task_is_that_in_its_file(folder: Path) -> None:
    assert own_task.name_of(folder, ["balls"]) == "cube"
    assert own_task.name_of(folder / "task.toml", ["balls"]) == "cube"
    assert own_task.name_of("balls", ["balls"]) == "balls"
    assert own_task.name_of(str(folder.parent), ["balls"]) == str(folder.parent)


@needs_server
def test_a_client_without_a_server_takes_it_and_its_replay_verifies_with_the_folder(
    folder: Path, tmp_path: Path
) -> None:
    with palmares.Client("local") as client:
        client.reset(str(folder), "pinch", seed=2)
        assert client.run.task == "cube"
        assert client.welcome.tasks[-1].name == "cube"
        client.step(hand=[0.5, 0.2], repeat=20)
        assert client.stop().task_hash == client.welcome.tasks[-1].hash
        client.save_replay(tmp_path / "run.mcap")
    verify = [str(PROGRAM), "verify", str(tmp_path / "run.mcap")]
    assert subprocess.run([*verify, "--task", str(folder)], check=False).returncode == 0
    refused = subprocess.run(verify, check=False, capture_output=True, text=True)
    assert refused.returncode == 1
    assert "other_task" in refused.stdout


def test_errors_of_a_users_task(folder: Path) -> None:
    with pytest.raises(ValueError, match="neither a task of the program"):
        World("no-such-task", "pinch")
    text = (folder / "task.toml").read_text()
    (folder / "task.toml").write_text(text.replace("mass = 0.2", "mass = -0.2"))
    with pytest.raises(ValueError, match=r"objects\.own `cube`: mass: -0\.2 kg"):
        World(str(folder), "pinch")
    with palmares.Client("local") as client, pytest.raises(palmares.UnknownTaskError, match=r"-0\.2 kg"):
        client.reset(str(folder), "pinch")


# The SoftHand has 20 N: it does not hold the pan of 0.95 kg level by its handle, the fourth goal.
@pytest.mark.parametrize(("example", "score", "goals"), [(pan_softhand, 8.0, 3), (peg_softhand, 10.0, 4)])
def test_the_examples_reach_their_goals(example: object, score: float, goals: int) -> None:
    with palmares.Client("local") as client:
        summary = example.run(client, 1)  # type: ignore[attr-defined]
    assert summary.score == score
    assert len(summary.goals) == goals
    # The page has the score over 20 scenes; it is the same in each.
    name = example.__name__.rpartition(".")[2]  # type: ignore[attr-defined]
    (row, *_) = re.findall(rf"^\| `{name}\.py` \|.*$", (DOCUMENT).read_text(), re.MULTILINE)
    assert f"each {score:g} of 10 points" in row
