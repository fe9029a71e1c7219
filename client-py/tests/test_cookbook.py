"""The cookbook's grips lift, and its page has their numbers."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import palmares

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

from palmares.skills.cookbook import (  # noqa: E402
    COOKBOOK,
    KINDS,
    GripMover,
    kind_of,
    most_room,
    pick,
    room,
    target_of,
)
from palmares.skills.motion import UP, RunOverError  # noqa: E402
from tests.short_task import short_grasp  # noqa: E402

ROOT = Path(__file__).parents[2]
HANDS = [hand for hand in COOKBOOK if hand != "softhand_skin"]


@pytest.fixture(scope="module")
def book() -> ModuleType:
    spec = importlib.util.spec_from_file_location("cookbook", ROOT / "client-py/benchmarks/cookbook.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["cookbook"] = module
    spec.loader.exec_module(module)
    return module


def test_every_built_in_hand_has_grips_for_its_motors() -> None:
    motors = {hand.name: len(hand.motors) for hand in sim.welcome().hands}
    assert set(COOKBOOK) == set(motors)
    for hand, grips in COOKBOOK.items():
        assert set(grips) <= set(KINDS)
        assert {"ball", "box", "cylinder"} <= set(grips), hand
        for kind, grip in grips.items():
            assert len(grip.opened) == len(grip.closed) == motors[hand], (hand, kind)
            assert all(0.0 <= sigma <= 1.0 for sigma in (*grip.opened, *grip.closed)), (hand, kind)


@pytest.mark.parametrize("hand", HANDS)
def test_a_hand_lifts_what_its_grips_are_for(hand: str, book: ModuleType, tmp_path: Path) -> None:
    kinds = [kind for kind in KINDS if kind in COOKBOOK[hand]]
    # Two kinds of a hand, other ones for the next hand; the benchmark plays all of them in five scenes.
    first = 2 * HANDS.index(hand)
    with palmares.Client("local") as client:
        for kind in {kinds[first % len(kinds)], kinds[(first + 1) % len(kinds)]}:
            task = book.task_of(kind, tmp_path)
            assert book.lift(client, task, hand, kind, seed=2).lifted, kind


def test_the_first_lines_of_the_guide_lift() -> None:
    code = re.findall(r"```python\n(.*?)```", (ROOT / "docs/teams.md").read_text(), re.DOTALL)
    (lines,) = [block for block in code if "pick(mover" in block]
    with palmares.Client("local") as client:
        scope: dict[str, object] = {"client": client}
        before = "import palmares\n"
        exec(before + lines, scope)
        mover = scope["mover"]
        assert isinstance(mover, GripMover)
        mover.wait(0.5)
        assert mover.obs.truth is not None
        assert (mover.obs.truth.positions[:, 2] > 0.25).sum() == 1


def test_the_lines_of_the_guide_without_a_mover_lift() -> None:
    code = re.findall(r"```python\n(.*?)```", (ROOT / "docs/teams.md").read_text(), re.DOTALL)
    (lines,) = [block for block in code if "in_hand(target)" in block]
    with palmares.Client("local") as client:
        scope: dict[str, object] = {"client": client, "palmares": palmares}
        exec(lines, scope)
        obs = scope["obs"]
        assert isinstance(obs, palmares.Observation)
        assert [event.kind for event in obs.events] == ["lifted"]


def test_the_page_has_the_numbers_of_the_source(book: ModuleType, tmp_path: Path) -> None:
    text = book.DOCUMENT.read_text()
    chapters = dict(re.findall(r"^## (\S+)\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL))
    assert set(chapters) == set(COOKBOOK) - set(book.ALIKE)
    for hand, chapter in chapters.items():
        rows = {
            row[0].strip("`"): row[1:]
            for row in (line[2:-2].split(" | ") for line in chapter.splitlines() if line.startswith("| `"))
        }
        assert list(rows) == list(COOKBOOK[hand]), hand
        assert (ROOT / f"docs/pictures/cookbook/{hand}.png").exists()
        for kind, row in rows.items():
            assert row[:-2] == book.numbers(hand, kind, tmp_path), (hand, kind)
            done, played = map(int, row[-1].split(" of "))
            assert done >= played - played // 5, (hand, kind)


def test_a_part_is_found_where_it_is() -> None:
    with palmares.Client("local") as client:
        obs = client.reset("pan", "softhand", seed=1)
        knob, _ = target_of(client.scene, obs, "knob")
        assert obs.truth is not None
        assert knob.middle == pytest.approx(obs.truth.object("lid").xyz + 0.052 * UP, abs=1e-3)
        handle, yaw_rad = target_of(client.scene, obs, "handle")
        axis = handle.middle - obs.truth.object("pan").xyz
        assert np.arctan2(axis[1], axis[0]) == pytest.approx(yaw_rad, abs=0.02)
        with pytest.raises(KeyError, match="object 'pan' has no sphere"):
            target_of(client.scene, obs, "knob", "pan")
        with pytest.raises(ValueError, match="wanted one of ball, ball_in_box"):
            target_of(client.scene, obs, "mug")
        with pytest.raises(KeyError, match="there are: pan, lid"):
            target_of(client.scene, obs, "box", "mug")


def test_kinds_of_whole_objects() -> None:
    kinds = {}
    with palmares.Client("local") as client:
        for seed in (1, 2, 3, 5, 8):
            client.reset("grasp", "softhand", seed=seed)
            kinds[client.scene.free[0].name] = kind_of(client.scene.free[0])
            client.abandon()
    assert kinds == {
        "006_mustard_bottle": "bottle",
        "013_apple": "box",
        "054_softball": "ball",
        "005_tomato_soup_can": "cylinder",
        "061_foam_brick": "box",
    }


def test_the_room_of_a_hand_ends_at_walls_and_other_balls() -> None:
    grip = COOKBOOK["softhand"]["ball_in_box"]
    with palmares.Client("local") as client:
        obs = client.reset("balls", "softhand", seed=1)
        box = client.scene.region("box_a")
        ball, _ = target_of(client.scene, obs, "ball", "ball_3")
        none = np.zeros((0, 3))
        free_m = room(grip, ball, 0.0, none, box)
        beside = ball.middle + 0.05 * UP
        assert room(grip, ball, 0.0, beside[None], box) < min(free_m, 0.0)
        chosen = most_room(client.scene, obs, grip, box)
        assert chosen is not None
        assert most_room(client.scene, obs, grip, client.scene.region("box_b")) is None


def test_without_a_grip_all_motors_have_the_same_command() -> None:
    with palmares.Client("local") as client:
        mover = GripMover(client, client.reset("grasp", "pinch", seed=2))
        mover.to(0.1, sigma=0.3)
        assert [motor.command for motor in mover.obs.hand.actuators] == pytest.approx([0.3, 0.3])


def test_a_run_that_ends_ends_a_pick(tmp_path: Path) -> None:
    with palmares.Client("local") as client:
        mover = GripMover(client, client.reset(short_grasp(tmp_path, 0.5), "softhand", seed=2))
        target, yaw_rad = target_of(client.scene, mover.obs, "ball")
        with pytest.raises(RunOverError, match="time_limit"):
            pick(mover, COOKBOOK["softhand"]["ball"], target, yaw_rad)
