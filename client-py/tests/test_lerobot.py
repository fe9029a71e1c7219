"""Datasets in LeRobot's format: what its own loader needs, from recorded runs and from policies."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import palmares
from palmares.program import dataset as program
from palmares.sim import Recording, World, describe_hand

pq = pytest.importorskip("pyarrow.parquet")

from palmares import lerobot  # noqa: E402

PINCH = "palmares/Grasp-Pinch-v1"


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder, paths = tmp_path_factory.mktemp("runs"), []
    for seed, ticks in ((1, 103), (2, 60)):
        world = World("grasp", "pinch", seed=seed)
        world.step(base=([0.0, 0.1, 0.5], [0.0, 1.0, 0.0, 0.0]), hand=[0.5, 0.2], repeat=ticks)
        paths.append(folder / f"run_{seed}.mcap")
        world.save_replay(paths[-1])
    return paths


def test_recorded_runs_are_rows_of_state_and_action(runs: list[Path], tmp_path: Path) -> None:
    assert program.main([*map(str, runs), "--out", str(tmp_path / "set"), "--every", "10"]) == 0
    root = tmp_path / "set"
    info = json.loads((root / "meta/info.json").read_text())
    assert (info["codebase_version"], info["fps"], info["robot_type"]) == ("v3.0", 10, "pinch")
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (2, 11 + 6, 1)
    rows = pq.read_table(root / info["data_path"].format(chunk_index=0, file_index=0)).to_pydict()
    assert set(rows) == set(info["features"])
    assert rows["episode_index"] == [0] * 11 + [1] * 6
    assert rows["index"] == list(range(17))
    assert rows["timestamp"] == pytest.approx([k / 10 for k in [*range(11), *range(6)]])
    joints = [it["name"] for it in describe_hand("pinch")["coordinates"]]
    assert info["features"]["observation.state"]["names"][-len(joints) :] == joints
    # The numbers are those of the run, tick by tick.
    found = Recording(runs[0]).arrays()
    state = np.array(rows["observation.state"])
    at = np.arange(0, 103, 10)
    assert np.abs(state[:11, :7] - found["base"][at, :7]).max() < 1e-6
    assert np.abs(state[:11, 9:] - found["q"][at]).max() < 1e-6
    action = np.array(rows["action"])
    assert np.abs(action[:10, :7] - state[1:11, :7]).max() < 1e-6, "the pose one row later"
    assert np.abs(action[:, 7:] - [0.5, 0.2]).max() < 1e-6
    episodes = pq.read_table(root / "meta/episodes/chunk-000/file-000.parquet").to_pydict()
    assert episodes["dataset_to_index"] == [11, 17]
    assert episodes["tasks"] == [[palmares.sim.welcome().task("grasp").description]] * 2


def test_statistics_are_those_of_all_rows(runs: list[Path], tmp_path: Path) -> None:
    lerobot.of_replays(tmp_path, runs, every=7)
    stats = json.loads((tmp_path / "meta/stats.json").read_text())
    (path,) = (tmp_path / "data").rglob("*.parquet")
    rows: dict[str, Any] = pq.read_table(path).to_pydict()
    for name in ("observation.state", "action", "timestamp"):
        values = np.array(rows[name]).reshape(len(rows[name]), -1)
        assert stats[name]["count"] == [len(values)]
        for key, wanted in (("min", values.min(0)), ("max", values.max(0)), ("mean", values.mean(0))):
            assert np.abs(np.array(stats[name][key]) - wanted).max() < 1e-6, (name, key)
        assert np.abs(np.array(stats[name]["std"]) - values.std(0)).max() < 1e-6, name


def test_a_policys_episodes_have_pictures(tmp_path: Path) -> None:
    def policy(observations: dict[str, Any]) -> Any:
        return np.full((len(observations["base"]), 8), 0.25)

    options = {"max_episode_steps": 3, "cameras": ["top.rgb"]}
    assert lerobot.collect(tmp_path / "set", policy, PINCH, [5, 3], options=options) == 2
    info = json.loads((tmp_path / "set/meta/info.json").read_text())
    image = info["features"]["observation.images.top"]
    assert image == {"dtype": "image", "shape": [240, 320, 3], "names": ["height", "width", "channels"]}
    (path,) = (tmp_path / "set/data").rglob("*.parquet")
    rows = pq.read_table(path).to_pydict()
    assert rows["episode_index"] == [0] * 3 + [1] * 3
    picture = np.array(Image.open(io.BytesIO(rows["observation.images.top"][0]["bytes"])))
    world = World("grasp", "pinch", seed=5)
    assert (picture == world.pictures("top", None, "rgb")["rgb"]).all(), "of the first scene"
    assert np.abs(np.array(rows["action"]) - 0.25).max() < 1e-7


def test_what_cannot_be_written_is_refused(
    runs: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full/a.txt").write_text("mine")
    world = World("grasp", "yale_t42", seed=1)
    world.step(hand=[0.5, 0.5], repeat=10)
    world.save_replay(tmp_path / "other.mcap")
    one = str(runs[0])
    for words, message in (
        ([one, "--out", str(tmp_path / "full")], "it is not empty"),
        ([one, "--every", "0", "--out", str(tmp_path / "a")], "every: found 0; wanted"),
        (
            [one, str(tmp_path / "other.mcap"), "--out", str(tmp_path / "b")],
            "found a run of yale_t42; wanted one",
        ),
        ([str(tmp_path / "full/a.txt"), "--out", str(tmp_path / "c")], "palmares dataset: "),
    ):
        assert program.main(words) == 1, words
        assert message in capsys.readouterr().err, words
    rows = np.zeros((2, 3))
    frames = [lerobot.Frames("a", {"action": rows}, {}), lerobot.Frames("a", {"action": rows[:, :2]}, {})]
    with pytest.raises(ValueError, match="episode 1: found columns"):
        lerobot.write(tmp_path / "d", frames, 10)
    with pytest.raises(ValueError, match="episodes: found none"):
        lerobot.write(tmp_path / "e", [], 10)


def test_lerobots_own_loader_reads_it(runs: list[Path], tmp_path: Path) -> None:
    loader = pytest.importorskip("lerobot.datasets.lerobot_dataset", reason="lerobot is not installed")
    lerobot.of_replays(tmp_path / "set", runs, every=10)
    found = loader.LeRobotDataset("mine", root=tmp_path / "set", delta_timestamps={"action": [0.0, 0.1]})
    assert (len(found), found.num_episodes) == (17, 2)
    assert found[3]["action"].shape == (2, 9)
    assert found[16]["task"] == palmares.sim.welcome().task("grasp").description
