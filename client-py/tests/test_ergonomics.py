"""Output for people: text and tables of observations, scenes and results, warnings, progress bars."""

from __future__ import annotations

import io
import subprocess
import sys
import time
import warnings
from html.parser import HTMLParser
from typing import Any

import gymnasium
import numpy as np
import pytest

import palmares
import palmares.gym
from palmares.clipping import ClippedActionWarning
from palmares.sim import progress
from tests.fake_server import FakeServer

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

STILL = palmares.twist([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
FAST = palmares.twist([3.0, 4.0, 0.0], [0.0, 0.0, 0.0])


class Cells(HTMLParser):
    """Collects the text of a table, and checks that every element is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.cells: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:  # noqa: ARG002
        """Push an open element."""
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        """Pop the element."""
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        """Collect the text."""
        self.cells.append(data)


def test_observations_scenes_and_results_print_as_text_and_tables() -> None:
    with palmares.Client("local") as client:
        obs = client.reset("balls", "softhand", seed=1)
        obs = client.step(base=STILL, hand=[0.5], repeat=30)
        result = client.stop()
        expected: dict[str, tuple[Any, list[str]]] = {
            "Observation of tick 30 (0.30 s), score 0": (obs, ["base", "ball_0", "wrist", "contacts"]),
            "Scene of 10 objects, 3 fixed bodies, 2 regions": (client.scene, ["ball_9", "region box_b"]),
            "Result of balls with softhand: score 0, practice": (result, ["ended", "state hash"]),
        }
    for title, (shown, labels) in expected.items():
        lines = str(shown).splitlines()
        assert lines[0] == f"<{title}>"
        assert max(map(len, lines)) < 140
        for label in labels:
            assert any(line.startswith(f"  {label} ") for line in lines), (label, lines)
        table = Cells()
        table.feed(shown._repr_html_())
        assert not table.open
        assert table.cells[0] == title
        assert set(labels) <= set(table.cells)
    assert "goal: (0.450, -0.250, 0.000) to (0.950, 0.250, 0.300) m" in str(client.scene)
    assert "sphere, 100 × 100 × 100 mm, 216 g" in str(client.scene)


def test_a_table_escapes_html() -> None:
    from palmares import views

    assert "<b>" not in views.html("<b>", [("<b>", "a & b")])
    assert "a &amp; b" in views.html("x", [("y", "a & b")])


@pytest.mark.parametrize("url", ["local", "server"])
def test_only_the_first_clipped_action_warns(url: str) -> None:
    with FakeServer() as server, palmares.Client("local" if url == "local" else server.url) as client:
        client.reset("balls", "softhand", seed=1)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            client.step(base=STILL, hand=[1.0])
            client.step(hand=[0.0])
        if url == "server":  # The fake one applies actions as they are.
            return
        with pytest.warns(ClippedActionWarning, match=r"hand = \(1.5\) was clipped to \(1\)") as warned:
            client.step(base=FAST, hand=[1.5])
        assert warned[0].filename == __file__
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            client.step(base=FAST, hand=[2.0])


def test_a_field_warns_though_another_one_has_warned_and_again_in_the_next_run() -> None:
    far = palmares.pose([0.0, 0.0, 750.0], [0.0, 1.0, 0.0, 0.0])
    with palmares.Client("local") as client:
        for _ in range(2):
            client.reset("balls", "softhand", seed=1)
            with pytest.warns(ClippedActionWarning, match=r"hand = \(1\.0001\) was clipped to \(1\)"):
                client.step(hand=[1.0001])
            with pytest.warns(ClippedActionWarning, match=r"base.position = \(0, 0, 750\) was clipped"):
                client.step(base=far, hand=[1.0001])
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                client.step(base=far, hand=[1.0001])
            client.abandon()


def test_modules_are_there_after_a_plain_import() -> None:
    code = """
import palmares
assert palmares.skills.motion.Mover and palmares.skills.cookbook.COOKBOOK
assert palmares.rotation.rot_z and palmares.sim.World and palmares.gym and palmares.evaluate.evaluate
assert palmares.motion and palmares.analysis and palmares.server
try:
    palmares.skills.motoin
except AttributeError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "module 'palmares.skills' has no attribute 'motoin'\n"


def test_a_world_and_a_batch_warn_too() -> None:
    world = sim.World("balls", "softhand")
    with pytest.warns(
        ClippedActionWarning, match=r"base.linear = \(3, 4, 0\) was clipped to \(1.2, 1.6, 0\)"
    ):
        world.step(base=FAST)
    batch = sim.Batch("balls", "softhand", 2, threads=1)
    batch.reset([0, 1])
    actions = np.zeros((2, 7))
    actions[:, :3], actions[:, 6] = [1.2, 1.6, 0.0], 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        batch.step(actions, 1)
    actions[1, 3:6] = [0.0, 0.0, -6.0]
    message = r"actions\[1\]: angular = \(0, 0, -6\) was clipped to \(0, 0, -3\)"
    with pytest.warns(ClippedActionWarning, match=message) as warned:
        batch.step(actions, 1)
    assert warned[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        batch.step(actions, 1)


def test_environments_warn_of_actions_beyond_their_space_alone() -> None:
    flat = gymnasium.make("palmares/Grasp-SoftHand-v1").unwrapped
    batch = gymnasium.make_vec("palmares/Grasp-SoftHand-v1", num_envs=2, threads=1)
    flat.reset(seed=1)
    batch.reset(seed=1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        flat.step(np.ones(7))
        batch.step(np.ones((2, 7)))
    for env, action in ((flat, np.full(7, 1.5)), (batch, np.full((2, 7), 1.5))):
        with pytest.warns(ClippedActionWarning, match=r"action = \(1.5, .*was clipped to \(1, 1"):
            env.step(action)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            env.step(action)


def test_a_long_call_shows_a_bar_and_a_short_one_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    shown = Terminal()
    monkeypatch.setattr(sys, "stderr", shown)
    with progress.progress(10, "tick", "step") as report:
        report(3)
    assert shown.getvalue() == ""
    monkeypatch.setattr(progress, "DELAY_S", 0.01)
    with progress.progress(10, "tick", "step") as report:
        report(3)
        time.sleep(0.02)
        report(7)
        report(10)
    assert "step:" in shown.getvalue()
    assert "7/10" in shown.getvalue()
    file = io.StringIO()
    monkeypatch.setattr(sys, "stderr", file)
    with progress.progress(10, "tick", "step") as report:
        time.sleep(0.02)
        report(7)
    assert file.getvalue() == ""


def test_the_engine_reports_its_progress() -> None:
    from palmares import _native

    batch = _native.Batch("balls", "softhand", 6, "truth", "none", 1, "twist", None)
    reported: list[int] = []
    batch.reset(list(range(6)), [True] * 6, reported.append)
    assert reported == [2, 4, 6]
    reported.clear()
    batch.step(np.zeros((6, 7)), 100, [True] * 6, reported.append)
    assert reported == sorted(reported)
    assert reported[-1] == 100
    before = batch.state_hashes()

    def refuse(_: int) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        batch.step(np.zeros((6, 7)), 100_000, [True] * 6, refuse)
    assert batch.state_hashes() != before
