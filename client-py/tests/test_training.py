"""Shaped rewards, randomised runs and curricula, which never change scored runs."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import palmares
from palmares.arrays import Array
from palmares.examples import grasp_softhand
from palmares.gym import FlatEnv
from palmares.training import QUANTITIES, Training
from tests.fake_server import FakeServer
from tests.real_server import PROGRAM, needs_server

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

SHAPED = Training(shaping=True, discount=0.97)


def down(count: int, motors: int = 1) -> Array:
    """Return the action (count, 6 + motors) that sends the hands down and half closes them."""
    action = np.zeros((count, 6 + motors))
    action[:, 2], action[:, 6:] = -0.4, 0.5
    return action


class Shaped(palmares.Client):
    """A client that sums up the shaped parts, discounted per step."""

    def reset(self, *args: object, **options: object) -> palmares.Observation:
        """Open a run and set the sum to zero."""
        obs = super().reset(*args, **options)  # type: ignore[arg-type]
        assert self.world is not None
        assert self.world.potential is not None
        self.first = sum(self.world.potential.values())
        self.returned, self.weight, self.steps = 0.0, 1.0, 0
        return obs

    def step(self, *args: object, **options: object) -> palmares.Observation:
        """Step and add the shaped part."""
        obs = super().step(*args, **options)  # type: ignore[arg-type]
        assert self.world is not None
        assert self.world.shaping is not None
        self.returned += self.weight * self.world.shaping
        self.weight *= 0.97
        self.steps += 1
        return obs


def test_the_sum_of_shaping_depends_on_the_first_state_alone() -> None:
    """Play a whole run that ends complete: the example lifts the object and holds it through the shake."""
    with Shaped("local", training=SHAPED) as client:
        grasp_softhand.run(client, 1)
        assert client.world is not None
        assert client.world.potential is not None
        assert client.result is not None
        assert (client.result.reason, client.world.potential["lift"]) == ("complete", 0.0)
        assert client.steps > 100
        assert client.returned == pytest.approx(-client.first, abs=1e-12)
        assert client.first > 0.01


def test_a_run_is_the_same_with_and_without_shaping(tmp_path: Path) -> None:
    plain = sim.Batch("balls", "softhand", 3, threads=1)
    shaped = sim.Batch("balls", "softhand", 3, threads=1, training=SHAPED)
    for batch in (plain, shaped):
        batch.reset(range(3))
    assert plain.potential is None
    before = sum(shaped.potential.values())
    for _ in range(12):
        a, b = plain.step(down(3)), shaped.step(down(3))
        assert a.shaping is None
        np.testing.assert_array_equal(a.rewards, b.rewards)
        now = sum(shaped.potential.values())
        np.testing.assert_allclose(b.shaping, 0.97 * now - before, rtol=0, atol=1e-12)
        before = now
    assert plain.state_hashes() == shaped.state_hashes()
    assert shaped.potential["distance"].min() > 0.05
    world = sim.World("balls", "softhand", 1, training=SHAPED)
    base = palmares.twist([0.0, 0.0, -0.4], [0.0, 0.0, 0.0])
    for _ in range(12):
        world.step(base=base, hand=[0.5], repeat=10)
    assert world.state_hash() == plain.state_hashes()[1]
    assert {name: values[1] for name, values in shaped.potential.items()} == world.potential
    assert world.shaping == b.shaping[1]
    assert not world.varied
    world.result()
    world.save_replay(tmp_path / "shaped.mcap")
    if PROGRAM is not None:
        subprocess.run([PROGRAM, "verify", tmp_path / "shaped.mcap"], check=True, capture_output=True)


def test_shaping_goes_on_from_a_snapshot_as_before() -> None:
    batch = sim.Batch("grasp", "softhand", 1, threads=1, training=SHAPED)
    world = sim.World("grasp", "softhand", 0, training=SHAPED)
    batch.reset([0])
    for _ in range(5):
        batch.step(down(1))
        world.step(base=palmares.twist([0.0, 0.0, -0.4], [0.0, 0.0, 0.0]), hand=[0.5], repeat=10)
    kept, there = batch.snapshot(0), batch.potential
    expected = batch.step(down(1)).shaping
    batch.step(down(1))
    batch.restore(0, kept)
    assert {name: value[0] for name, value in batch.potential.items()} == {k: v[0] for k, v in there.items()}
    assert batch.step(down(1)).shaping == expected
    fork = world.fork()
    fork.step(base=palmares.twist([0.0, 0.0, -0.4], [0.0, 0.0, 0.0]), hand=[0.5], repeat=10)
    assert fork.shaping == expected[0] != world.shaping


@needs_server
def test_a_replay_of_a_randomised_run_is_refused(tmp_path: Path) -> None:
    world = sim.World("grasp", "softhand", 3, training=Training(randomise=["mass"]))
    world.step(repeat=5)
    result = world.result()
    assert (world.varied, result.status) == (True, "training")
    assert "randomised" in repr(world)
    with pytest.raises(ValueError, match="none of the task's: it has no replay"):
        world.save_replay(tmp_path / "x.mcap")
    assert not (tmp_path / "x.mcap").exists()
    own = sim.World("grasp", "softhand", 3)
    with pytest.raises(ValueError, match="another task"):
        own.restore(world.snapshot())
    with pytest.raises(ValueError, match="another task"):
        own.restore(bytes(world.snapshot()))


def test_a_randomised_run_is_a_function_of_seed_and_options() -> None:
    def opened(threads: int, seeds: list[int], training: Training) -> tuple[list[str], dict[str, Array]]:
        batch = sim.Batch("balls", "softhand", len(seeds), threads=threads, noise="real", training=training)
        observations = batch.reset(seeds)
        for _ in range(3):
            batch.step(down(len(seeds)))
        return batch.state_hashes(), observations

    everything = Training(randomise=True, fraction=0.5)
    hashes, fields = opened(1, [4, 5, 6], everything)
    again, _ = opened(2, [6, 5, 4], everything)
    assert hashes == again[::-1]
    assert len(set(hashes)) == 3
    assert (fields["object_mass"][:, :5] > 0.1).all()
    assert (fields["object_mass"][:, 5:] == 0.0).all()
    assert (fields["object_kind"][:, 5:] == -1.0).all()
    assert not fields["objects"][:, 5:].any()
    assert len(np.unique(fields["object_mass"][:, :5])) == 15
    named, _ = opened(1, [4, 5, 6], Training(randomise=QUANTITIES, fraction=0.5))
    assert named == hashes
    plain, _ = opened(1, [4, 5, 6], Training())
    assert not set(plain) & set(hashes)


def test_the_shaped_part_is_in_the_info_and_in_the_reward_if_wanted() -> None:
    def stepped(shaping: Any) -> tuple[float, float]:
        env = FlatEnv("grasp", "pinch", shaping=shaping)
        env.reset(seed=1)
        _, reward, _, _, info = env.step(np.array([0.0, 0.0, -0.5, 0.0, 0.0, 0.0, 0.0, 0.0]))
        return reward, info["shaping"]

    added, only_in_info = stepped(True), stepped("info")
    assert added[1] == only_in_info[1] != 0.0
    assert added[0] == only_in_info[0] + added[1]
    with pytest.warns(DeprecationWarning, match='shaping="info"'):
        assert stepped("apart") == only_in_info
    with pytest.raises(ValueError, match="wanted True, False or 'info'"):
        stepped("other")


def test_a_curriculum_holds_from_the_next_reset_on() -> None:
    batch = sim.Batch("balls", "softhand", 2, threads=1, training=Training(fraction=0.1))
    there = [int((batch.reset([0, 1])["object_kind"][0] >= 0.0).sum())]
    for fraction in (0.25, 0.7, 1.0):
        batch.fraction = fraction
        batch.step(down(2))
        there.append(int((batch.observe()["object_kind"][0] >= 0.0).sum()))
        there.append(int((batch.reset([0, 1])["object_kind"][0] >= 0.0).sum()))
    assert there == [1, 1, 3, 3, 7, 7, 10]
    plain = sim.Batch("balls", "softhand", 2, threads=1)
    plain.reset([0, 1])
    assert batch.state_hashes() == plain.state_hashes()
    with pytest.raises(ValueError, match="fraction: found 0"):
        batch.fraction = 0.0
    assert batch.fraction == 1.0


def test_tasks_declare_options_for_learners_as_documented(tmp_path: Path) -> None:
    docs = Path(__file__).parents[2] / "docs"
    task, training = (
        re.findall(r"```toml\n(.*?)```", (docs / name).read_text(), re.DOTALL)[0]
        for name in ("tasks.md", "training.md")
    )
    (tmp_path / "task.toml").write_text(task)
    for make in (sim.World, lambda *args, **more: sim.Batch(*args, 1, **more)):
        with pytest.raises(ValueError, match=r"randomise: .* there is no \[training.randomise\] in it"):
            make(str(tmp_path), "softhand", training=Training(randomise=True))
        with pytest.raises(ValueError, match=r"has no \[training.rewards\] in its task.toml"):
            make(str(tmp_path), "softhand", training=SHAPED)
    (tmp_path / "task.toml").write_text(task + training)
    world = sim.World(str(tmp_path), "softhand", training=Training(shaping=True, randomise=True))
    assert world.varied
    assert world.potential is not None
    world.step()
    assert world.shaping is not None
    # The task has one object, so a fraction keeps it.
    assert not sim.World(str(tmp_path), "softhand", training=Training(fraction=0.5)).varied
    with pytest.raises(ValueError, match="needs all of them"):
        sim.World("pan", "softhand", training=Training(fraction=0.5))


def test_invalid_options_are_refused() -> None:
    with FakeServer() as server, pytest.raises(ValueError, match="servers do not offer it"):
        palmares.Client(server.url, training=Training(shaping=True))
    for wrong, message in (
        ({"discount": 1.5}, "discount: found 1.5"),
        ({"fraction": 0.0}, "fraction: found 0.0"),
        ({"fraction": 1.1}, "fraction: found 1.1"),
        ({"randomise": "mass"}, "a sequence of names"),
        ({"randomise": ["masses"]}, "mass, friction, size"),
    ):
        with pytest.raises(ValueError, match=message):
            Training(**wrong)
    with pytest.raises(ValueError, match="shelf` declares in"):
        sim.World("shelf", "softhand", training=Training(randomise=["object_poses"]))
    with pytest.raises(ValueError, match='noise="real"'):
        sim.Batch("balls", "softhand", 1, training=Training(randomise=["sensor_noise"]))
