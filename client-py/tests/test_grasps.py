"""Grasps by the thousand: where they are sampled, what a file has, and that it can be proven."""

from __future__ import annotations

import base64
import io
import itertools
import json
import math
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from palmares.analysis import Contact, force_closure, form_closure, quality
from palmares.grasps import FATES, STEPS_MS, GraspFile, examples, make, processes, replay
from palmares.grasps.hand import reach_of
from palmares.grasps.sample import FREE_M, candidates, near
from palmares.grasps.scene import Pose, poses_at_rest, subjects_of, write_scene
from palmares.grasps.surface import bounds, chords, points_on
from palmares.program import grasps as program
from palmares.rotation import matrix_of
from palmares.scene import SceneBody, ScenePart
from palmares.sim import Recording, World
from palmares.wire import Shape

ROOT = Path(__file__).parents[2]
H5PY = pytest.importorskip("h5py")


def part(shape: Shape, position: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> ScenePart:
    turned = (0.0, 0.0, math.sin(0.3), math.cos(0.3))
    return ScenePart(position=position, quat_xyzw=turned, shape=shape)


CUBE = [(x, y, z) for x in (-0.03, 0.03) for y in (-0.02, 0.02) for z in (-0.01, 0.01)]
SHAPES = {
    "sphere": (Shape(type="sphere", radius=0.03), 4 * math.pi * 0.03**2),
    "capsule": (Shape(type="capsule", radius=0.02, half_length=0.04), 2 * math.pi * 0.02 * (0.08 + 0.04)),
    "cylinder": (Shape(type="cylinder", radius=0.02, half_length=0.04), 2 * math.pi * 0.02 * (0.08 + 0.02)),
    "box": (Shape(type="box", half_extents=(0.03, 0.02, 0.01)), 8 * (0.0006 + 0.0003 + 0.0002)),
    "hull": (Shape(type="hull", points=CUBE), 8 * (0.0006 + 0.0003 + 0.0002)),
}
"""Each shape with its area, m²"""


def distance(shape: Shape, local: Any) -> Any:
    """Return how far points (n, 3) in the frame of a shape are from its surface, m."""
    half = shape.half_length or 0.0
    if shape.type in ("sphere", "capsule"):
        axis = np.clip(local[:, 2], -half, half)
        return np.linalg.norm(local - np.outer(axis, [0, 0, 1]), axis=1) - (shape.radius or 0.0)
    if shape.type == "cylinder":
        flat = np.linalg.norm(local[:, :2], axis=1) - (shape.radius or 0.0)
        return np.maximum(flat, np.abs(local[:, 2]) - half)
    return (np.abs(local) - np.array([0.03, 0.02, 0.01])).max(axis=1)


@pytest.mark.parametrize("kind", SHAPES)
def test_points_are_on_the_surface_and_evenly_spread(kind: str) -> None:
    shape, area = SHAPES[kind]
    one = part(shape, (0.1, -0.05, 0.02))
    points, normals = points_on([one], np.random.default_rng(1), 4000)
    assert len(points) == 4000
    local, turned = (points - one.xyz) @ one.rotation, normals @ one.rotation
    assert np.abs(distance(shape, local)).max() < 1e-12
    assert np.abs(distance(shape, local + 1e-3 * turned) - 1e-3).max() < 1e-4, "normals point outward"
    assert np.abs(np.linalg.norm(normals, axis=1) - 1.0).max() < 1e-12
    # Evenly: the part of the points with z above 0 is a half, and each octant of a box has an eighth.
    upper = np.mean(local[:, 2] > 0)
    assert abs(upper - 0.5) < 4 * 0.5 / math.sqrt(4000)
    if kind in ("box", "hull"):
        share = np.mean(np.abs(turned[:, 2]) > 0.5)
        assert abs(share - 8 * 0.0006 / area) < 4 * 0.5 / math.sqrt(4000)


def test_a_hull_and_a_box_of_the_same_corners_have_the_same_bounds_and_points() -> None:
    box, hull = part(SHAPES["box"][0]), part(SHAPES["hull"][0])
    for one, other in zip(bounds([box]), bounds([hull]), strict=True):
        assert np.abs(one - other).max() < 1e-15
    drawn = [points_on([it], np.random.default_rng(3), 100) for it in (box, hull)]
    assert np.abs(drawn[0][0] - drawn[1][0]).max() < 1e-12
    assert np.abs(drawn[0][1] - drawn[1][1]).max() < 1e-12


def test_points_inside_another_part_are_no_surface() -> None:
    ball = Shape(type="sphere", radius=0.03)
    parts = [part(ball), part(ball, (0.03, 0.0, 0.0)), part(ball)]
    points, _ = points_on(parts, np.random.default_rng(2), 1000)
    away = [np.linalg.norm(points - it.xyz, axis=1) for it in parts]
    assert min(it.min() for it in away) > 0.03 - 1e-9
    # The third is the first once more: each point is there once.
    left = np.mean(points[:, 0] < 0.015)
    assert abs(left - 0.5) < 4 * 0.5 / math.sqrt(1000)


def test_chords_end_on_the_surface_and_are_no_longer_than_the_hand_opens() -> None:
    one = part(SHAPES["box"][0])
    first, second = chords([one], np.random.default_rng(1), 200, 0.03)
    assert len(first) > 50
    assert np.linalg.norm(second - first, axis=1).max() <= 0.03
    for ends in (first, second):
        assert np.abs(distance(one.shape, ends @ one.rotation)).max() < 1e-12


def test_what_a_sampler_knows_of_hands() -> None:
    pinch, softhand = reach_of("pinch"), reach_of("softhand")
    assert np.abs(np.abs(pinch.across) - [0.0, 1.0, 0.0]).max() < 1e-6, "two fingers close along y"
    assert np.abs(pinch.fingers - [0.0, 0.0, 1.0]).max() < 1e-6
    assert pinch.one_sided < 0.01
    assert softhand.palm[0] > 0.99, "the palm of the SoftHand faces x"
    assert softhand.one_sided > 0.8
    assert softhand.fingers[2] > 0.9
    with pytest.raises(ValueError, match=r"opened: found \[0.1\]; wanted 2 numbers from 0 to 1"):
        reach_of("pinch", [0.1])


def test_the_lowest_point_of_a_hand_is_that_of_its_shapes() -> None:
    reach = reach_of("pinch")
    down = matrix_of([1.0, 0.0, 0.0, 0.0])
    world = World("grasp", "pinch", seed=1)
    # Lowered to 1 mm above the table it touches nothing, 1 mm into it it does.
    for height, touches in ((0.001, False), (-0.001, True)):
        world.reset(1)
        place = [0.3, 0.3, height - float(reach.lowest(down)), 1.0, 0, 0, 0, 0, 0, 0, 0, 0, 0]
        world.set_state(base=place)
        world.step(base=(place[:3], place[3:7]), hand=reach.opened)
        rows = world.contacts()
        bodies = rows["bodies"][: int(rows["count"])]
        assert bool(((bodies[:, 0] >= 0) & (bodies[:, 1] == -1)).any()) == touches, height


@pytest.fixture(scope="module")
def brick(tmp_path_factory: pytest.TempPathFactory) -> tuple[SceneBody, list[Pose]]:
    folder = tmp_path_factory.mktemp("brick")
    poses = poses_at_rest(subjects_of(BRICK)[0], "pinch", folder, 8)
    return World(str(folder), "pinch", seed=1).scene.free[0], poses


def test_a_box_rests_on_each_of_its_sides(brick: tuple[SceneBody, list[Pose]]) -> None:
    _, poses = brick
    upward = np.abs(np.array([pose.rotation[2] for pose in poses])).round(3)
    assert len({tuple(row) for row in upward}) >= 2
    assert all(abs(row.max() - 1.0) < 1e-3 for row in upward), "an axis is vertical"
    assert [pose.share for pose in poses] == sorted((pose.share for pose in poses), reverse=True)


def test_scenes_have_the_rules_of_the_task_grasp(brick: tuple[SceneBody, list[Pose]], tmp_path: Path) -> None:
    body, poses = brick
    write_scene(tmp_path, subjects_of(BRICK)[0], body, poses[0], reach_of("pinch"))
    ours = tomllib.loads((tmp_path / "task.toml").read_text())
    theirs = tomllib.loads((ROOT / "tasks/grasp/task.toml").read_text())
    for name in ("rules", "ground", "furniture", "tick_s", "step_s", "time_limit_s"):
        assert ours[name] == theirs[name], name
    world = World(str(tmp_path), "pinch", seed=1)
    assert np.abs(world.scene.free[0].xyz - poses[0].position).max() < 1e-4, "it is at rest there"


def test_sampled_hands_are_free_of_the_table(brick: tuple[SceneBody, list[Pose]]) -> None:
    body, poses = brick
    reach = reach_of("softhand")
    generator = np.random.default_rng(5)
    tries = candidates(reach, body, poses[0], generator, 100)
    around = near(reach, tries, range(100), generator)
    for some in (tries, around):
        assert len(some) == 100
        for position, quat in zip(some.position, some.quat, strict=True):
            assert position[2] + float(reach.lowest(matrix_of(quat))) >= FREE_M - 1e-9
    moved = np.linalg.norm(around.position - tries.position, axis=1)
    assert 0.001 < np.median(moved) < 0.1


BRICK = "061_foam_brick"
ONE = ["056_tennis_ball"]
SMALL: dict[str, Any] = {"tries": 12, "poses": 1, "drawn_hands": 0}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("made") / "grasps.h5"
    make("yale_t42", ONE, path, pool=processes(1), **SMALL)
    return path


def arrays(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = {}
    with H5PY.File(path) as file:
        file.visititems(lambda name, it: found.update({name: it[:]}) if hasattr(it, "dtype") else None)
    return found


def test_an_independent_reader_reads_the_file(made: Path) -> None:
    with H5PY.File(made) as file:
        assert file.attrs["schema"] == "palmares-grasps-1"
        assert list(file.attrs["fates"]) == list(FATES)
        assert list(file.attrs["steps_ms"]) == list(STEPS_MS)
        assert list(file["objects"]) == ONE
        pose = file["objects/056_tennis_ball/pose_0"]
        assert pose["tries/base"].shape == (12, 7)
        assert pose["tries/base"].attrs["unit"] == "m, quaternion x y z w"
        kept = pose["kept/row"][:]
        assert len(kept) > 0
        assert {FATES[it] for it in pose["tries/fate"][:][kept]} == {"kept"}
        ends = pose["kept/contact_start"][:]
        assert ends[-1] == len(pose["kept/contact_position"])
        radius = 0.0325
        for first, last in itertools.pairwise(ends):
            away = np.linalg.norm(pose["kept/contact_position"][first:last], axis=1)
            assert len(away) >= 2
            assert np.abs(away - radius).max() < 2e-3, "contacts are on the ball"
            along = np.sum(
                pose["kept/contact_position"][first:last] * pose["kept/contact_normal"][first:last], 1
            )
            assert along.max() < 0.0, "normals point into it"


def test_a_file_is_a_function_of_its_arguments(made: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.h5"
    with pytest.raises(RuntimeError, match="lost"):
        make("yale_t42", ONE, again, pool=_lost, **SMALL)  # After the poses at rest.
    make("yale_t42", ONE, again, pool=processes(2), **SMALL)
    one, other = arrays(made), arrays(again)
    assert one.keys() == other.keys()
    assert all(np.array_equal(one[name], other[name], equal_nan=False) for name in one)


def _lost(function: Any, items: Any) -> Any:
    for item in items:
        if hasattr(item, "tries"):
            raise RuntimeError("lost")
        yield function(item)


def test_kept_grasps_are_played_again_to_their_states(made: Path, tmp_path: Path) -> None:
    with GraspFile(made) as file:
        kept = file.kept(ONE[0], 0)
        (first, *_) = np.flatnonzero(kept.survived[:, 0]).tolist()
        found = replay(file, ONE[0], 0, first, tmp_path, write=True)
        assert found.same
        assert found.outcome.points >= 7.0
        with pytest.raises(ValueError, match=r"found grasp 999; wanted 0 to"):
            replay(file, ONE[0], 0, 999, tmp_path)
    recording = Recording(tmp_path / "run.mcap")
    assert recording.score == pytest.approx(found.outcome.points)
    words = [sys.executable, "-m", "palmares", "verify", str(tmp_path / "run.mcap"), "--task", str(tmp_path)]
    assert subprocess.run(words, capture_output=True, check=False).returncode == 0


def test_the_program_shows_checks_and_draws_a_file(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert program.main(["show", str(made)]) == 0
    assert "056_tennis_ball" in capsys.readouterr().out
    assert program.main(["check", str(made), "--sample", "2"]) == 0
    assert "2 of 2 grasps end in the state of the file" in capsys.readouterr().out
    page = tmp_path / "page.html"
    assert program.main(["page", str(made), "--out", str(page)]) == 0
    pictures = re.findall('src="data:image/png;base64,([^"]+)"', page.read_text())
    assert pictures
    for picture in pictures:
        pixels = np.array(Image.open(io.BytesIO(base64.b64decode(picture))))
        assert pixels.shape == (240, 320, 3)
        assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 100, "hand, ball and table"
    assert program.main(["dataset", str(made), "--sample", "1", "--out", str(tmp_path / "runs")]) == 0
    assert json.loads((tmp_path / "runs/meta/info.json").read_text())["total_episodes"] == 1
    with H5PY.File(made) as file:
        hashes = file["objects/056_tennis_ball/pose_0/kept/state_hash"][:]
    changed = tmp_path / "changed.h5"
    changed.write_bytes(made.read_bytes())
    with H5PY.File(changed, "a") as file:
        file["objects/056_tennis_ball/pose_0/kept/state_hash"][...] = np.full(len(hashes), b"0" * 16)
    assert program.main(["check", str(changed), "--sample", "1"]) == 1


def test_the_program_says_what_is_wrong(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = tmp_path / "text.h5"
    text.write_text("no HDF5")
    other = tmp_path / "other.h5"
    with H5PY.File(other, "w") as file:
        file.attrs["schema"] = "something"
    for words, message in (
        (["pinch", "025_mugg", "--out", str(tmp_path / "a.h5")], "found '025_mugg'; wanted a name of"),
        (["pinch", "--out", str(tmp_path / "a.h5")], "objects: found none"),
        (["nothing", "025_mug", "--out", str(tmp_path / "a.h5")], "nothing"),
        (["show", str(tmp_path / "none.h5")], "there is no such file"),
        (["show", str(text)], "text.h5"),
        (["show", str(other)], "found schema 'something'; wanted palmares-grasps-1"),
        (["yale_t42", *ONE, "--tries", "13", "--out", str(made)], "it was begun with tries 12, not 13"),
        (
            ["pinch", *ONE, "--tries", "12", "--out", str(made)],
            "it was begun with hand yale_t42, not pinch",
        ),
        (
            ["replay", str(made), "025_mug", "--out", str(tmp_path / "r")],
            "found object '025_mug'; wanted one of",
        ),
    ):
        assert program.main(words) == 1, words
        assert message in capsys.readouterr().err, words


def test_objects_of_ones_own(tmp_path: Path) -> None:
    task = tmp_path / "mine"
    task.mkdir()
    (task / "task.toml").write_text(
        '[[objects.own]]\nname = "bar"\nsource = "this test"\nmass = 0.05\nfriction = 0.8\n'
        'parts = [{ shape = "box", size = [0.03, 0.03, 0.1] }]\n'
    )
    path = tmp_path / "bar.h5"
    make("yale_t42", [str(task)], path, tries=4, poses=1, drawn_hands=0, pool=processes(1))
    with GraspFile(path) as file:
        assert file.objects == ["bar"]
        assert len(file.tries("bar", 0).fate) == 4
    (task / "task.toml").write_text('name = "none"\n')
    with pytest.raises(ValueError, match=r"has no \[\[objects.own\]\]"):
        subjects_of(str(task))


def test_tries_as_arrays_for_learning(made: Path) -> None:
    data = examples([made], points=64)
    assert data.points.shape == (1, 64, 6)
    assert data.hand.shape == (12, 9)
    assert np.abs(np.linalg.norm(data.points[0, :, :3], axis=1) - 0.0325).max() < 1e-3
    first, second = data.hand[:, 3:6], data.hand[:, 6:9]
    assert np.abs(np.sum(first * second, axis=1)).max() < 1e-6
    assert 0 < data.kept.sum() < 12
    with GraspFile(made) as file:
        kept, pose = file.kept(ONE[0], 0), (file.poses(ONE[0]) or [])[0]
        base = file.tries(ONE[0], 0).base
    back = (base[:, :3] - pose.position) @ pose.rotation
    assert np.abs(data.hand[:, :3] - back).max() < 1e-6
    assert data.kept[kept.row].all()


def test_a_network_learns_from_the_tries(made: Path, tmp_path: Path) -> None:
    pytest.importorskip("torch")
    from palmares.examples.train_grasp_success import auc, parsed, train

    other = tmp_path / "brick.h5"
    make("yale_t42", [BRICK], other, pool=processes(1), **SMALL)
    with pytest.raises(ValueError, match="found one object, 056_tennis_ball; wanted at least two"):
        train(parsed([str(made)]))
    words = [str(made), str(other), "--epochs", "2", "--policy", str(tmp_path / "success.pt")]
    assert set(train(parsed(words))) == {"known", "unseen"}
    assert (tmp_path / "success.pt").stat().st_size > 0
    assert auc(np.array([0.1, 0.4, 0.35, 0.8]), np.array([0, 0, 1, 1])) == 0.75


def test_closure_and_quality_of_a_textbooks_contacts() -> None:
    pair = [Contact("", (0, y, 0), (0, -y, 0), model="soft_finger") for y in (-0.03, 0.03)]
    assert force_closure(pair).closed
    assert not form_closure(pair).closed
    hard = [Contact("", it.point, it.normal) for it in pair]
    assert not force_closure(hard).closed, "nothing resists a moment about their line"
    assert quality(pair).epsilon > 0.1
    with pytest.raises(ValueError, match="contacts: found none"):
        quality([])
    with pytest.raises(ValueError, match=r"contacts\[0\]: found link 'palm'"):
        force_closure([Contact("palm", (0, 0, 0), (0, 0, 1))])
