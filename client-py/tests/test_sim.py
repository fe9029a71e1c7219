"""The engine in this process: the same bits as through a server, for every way to play."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import palmares
from palmares import Training
from palmares.arrays import Array
from tests.real_server import PROGRAM, RealServer, needs_server
from tests.short_task import short_grasp

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

PAIRS = list(itertools.product(["balls", "shelf", "grasp"], ["softhand", "reflex"]))
# Episodes of the test that compares all ways to play; `PALMARES_EPISODES=1000` plays many.
EPISODES = int(os.environ.get("PALMARES_EPISODES", "12"))
# Ticks under each action of an episode.
TICKS = [1, 7, 20, 40, 3, 30, 60, 15]


def actions(seed: int, motors: int) -> Array:
    """Return random actions (8, 6 + motors) that go down among the objects; some beyond the limits."""
    rng = np.random.default_rng(seed)
    drawn = rng.normal(0.0, 0.3, (len(TICKS), 6 + motors))
    drawn[:, 2] -= 0.2
    drawn[:, 6:] = rng.uniform(-0.1, 1.1, (len(TICKS), motors))
    return drawn


def play(world: Any, chosen: Array) -> palmares.Observation:
    """Play an episode with a `World` or a `Client`."""
    for action, ticks in zip(chosen, TICKS, strict=True):
        obs: palmares.Observation = world.step(
            base=palmares.twist(action[:3], action[3:6]), hand=action[6:], repeat=ticks
        )
    return obs


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with RealServer(tmp_path_factory.mktemp("data")) as server:
        yield server.url


@needs_server
def test_socket_world_batch_and_verification_come_to_one_hash(url: str, tmp_path: Path) -> None:
    assert PROGRAM is not None
    with palmares.Client(url) as client:
        for (task, hand), first in zip(
            PAIRS, range(0, EPISODES, max(1, EPISODES // len(PAIRS))), strict=False
        ):
            seeds = range(first, min(first + max(1, EPISODES // len(PAIRS)), EPISODES))
            motors = len(client.welcome.hand(hand).motors)
            chosen = [actions(seed, motors) for seed in seeds]
            worlds = [sim.World(task, hand, seed) for seed in seeds]
            ends = [play(world, one) for world, one in zip(worlds, chosen, strict=True)]
            hashes = [world.state_hash() for world in worlds]
            for threads in (1, 2):
                batch = sim.Batch(task, hand, len(seeds), threads=threads)
                batch.reset(seeds)
                for step, ticks in enumerate(TICKS):
                    stepped = batch.step([one[step] for one in chosen], ticks)
                assert batch.state_hashes() == hashes, (task, hand, threads)
                assert list(batch.scores) == [obs.score for obs in ends]
                found = stepped.observations
                for k, obs in enumerate(ends):
                    assert obs.truth is not None
                    assert np.array_equal(found["objects"][k, :, :3], obs.truth.positions)
                    assert np.array_equal(found["joints"][k, 0], obs.truth.joints.position)
                    assert np.array_equal(found["base"][k, :3], obs.hand.base.xyz)
            files = []
            for seed, world, one, end in zip(seeds, worlds, chosen, ends, strict=True):
                client.reset(task, hand, seed=seed)
                through = play(client, one)
                assert (through.events, through.score) == (end.events, end.score)
                result, expected = world.result(), client.stop()
                assert result.state_hash == expected.state_hash, (task, hand, seed)
                assert (result.score, result.events) == (expected.score, expected.events)
                files.append(tmp_path / f"{task}_{hand}_{seed}.mcap")
                world.save_replay(files[-1], team="pytest")
            done = subprocess.run(
                [PROGRAM, "verify", "--json", *files], capture_output=True, text=True, check=False
            )
            verdicts = [json.loads(line) for line in done.stdout.splitlines()]
            assert [verdict["verdict"] for verdict in verdicts] == ["verified"] * len(seeds), done.stdout
            assert [verdict["score"] for verdict in verdicts] == [world.score for world in worlds]


@needs_server
def test_an_effort_is_the_same_in_every_way_to_play(url: str, tmp_path: Path) -> None:
    assert PROGRAM is not None
    still = palmares.twist([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    world, batch = sim.World("grasp", "softhand", seed=4), sim.Batch("grasp", "softhand", 1)
    batch.reset([4])
    tensions = []
    with palmares.Client(url) as client:
        client.reset("grasp", "softhand", seed=4)
        for effort in (None, 0.25, None, 1.0):
            for _ in range(4):
                local = world.step(base=still, hand=1.0, repeat=100, effort=effort)
                remote = client.step(base=still, hand=1.0, repeat=100, effort=effort)
            stepped = batch.step([[0.0] * 6 + [1.0]], 400, effort=None if effort is None else [[effort]])
            tensions.append(local.hand.actuators[0].tension)
            assert remote.hand == local.hand
            assert stepped.observations["motors"][0, 0, 3] == tensions[-1]
            assert remote.applied_action == local.applied_action
        result = client.stop()
    assert local.applied_action.effort == [1.0]
    assert tensions[1] == pytest.approx(tensions[2], rel=1e-3)
    assert tensions[1] < 0.35 * tensions[0]
    assert tensions[3] > 2.0 * tensions[2]
    assert batch.state_hashes() == [world.state_hash()]
    assert world.result().state_hash == result.state_hash
    world.save_replay(tmp_path / "effort.mcap")
    subprocess.run([PROGRAM, "verify", tmp_path / "effort.mcap"], check=True, capture_output=True)
    with pytest.raises(ValueError, match="effort: found shape"):
        batch.step([[0.0] * 7], 1, effort=[0.5])
    world.reset(seed=4)
    with pytest.warns(palmares.ClippedActionWarning, match="effort"):
        world.step(effort=1.5)


def test_a_world_goes_on_from_where_it_was_kept() -> None:
    world = sim.World("balls", "softhand", seed=3, noise="real")
    chosen = actions(3, 1)
    play(world, chosen)
    kept, here = world.snapshot(), world.observe()
    fork = world.fork()
    end = play(world, chosen)
    assert play(fork, chosen) == end
    assert fork.state_hash() == world.state_hash()
    other = sim.World("balls", "softhand", seed=3, noise="real")
    for again in (kept, bytes(kept), pickle.loads(pickle.dumps(kept)), sim.Snapshot(bytes(kept))):
        for one in (world, other):
            assert one.restore(again).hand == here.hand
            assert play(one, chosen).hand == end.hand
            assert one.state_hash() == fork.state_hash()
    assert len(bytes(kept)) <= 30_000
    another = sim.World("balls", "softhand", seed=4, noise="real")
    another.restore(kept)
    assert play(another, chosen).hand == end.hand
    assert another.state_hash() == fork.state_hash()
    with pytest.raises(ValueError, match="no snapshot of this version"):
        world.restore(bytes(kept)[:-1])


def test_a_replay_has_pushes_and_snapshots(tmp_path: Path) -> None:
    world = sim.World("grasp", "reflex", seed=2)
    world.step(hand=[0.5] * 4, repeat=30)
    kept = world.snapshot()
    world.perturb("base", force=[0.0, 0.0, 5.0], duration_s=0.2)
    world.step(repeat=40)
    pushed = world.state_hash()
    world.restore(kept)
    world.step(repeat=40)
    assert world.state_hash() != pushed
    world.restore(kept)
    world.perturb("base", force=[0.0, 0.0, 5.0], duration_s=0.2)
    world.step(repeat=40)
    assert world.state_hash() == pushed
    world.save_replay(tmp_path / "pushed.mcap")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["pushed.mcap"]
    if PROGRAM is not None:
        subprocess.run([PROGRAM, "verify", tmp_path / "pushed.mcap"], check=True, capture_output=True)
    world.restore(bytes(kept))
    with pytest.raises(ValueError, match="went on from the bytes"):
        world.save_replay(tmp_path / "no.mcap")
    with pytest.raises(OSError, match="missing"):
        sim.World("grasp", "reflex").save_replay("/proc/missing/x.mcap")


def test_a_batch_resets_and_steps_the_masked_worlds() -> None:
    batch = sim.Batch("grasp", "softhand", 4, sensing="sensors")
    with pytest.raises(ValueError, match="world 0 has no run yet"):
        batch.step(np.zeros((4, 7)))
    first = batch.reset([5, 6, 7, 5])
    assert set(first) == {"base", "motors", "wrist", "time_left"}
    hashes = batch.state_hashes()
    assert hashes[0] == hashes[3] != hashes[1]
    moved = batch.step(np.full((4, 7), 0.2), 5, mask=[True, False, True, False])
    assert batch.ticks == [5, 0, 5, 0]
    assert batch.state_hashes()[1] == hashes[1]
    assert np.all(moved.rewards == 0.0)
    kept = batch.snapshot(0)
    batch.reset([5, 0, 0, 0], mask=[True, False, False, False])
    assert (batch.ticks, batch.seeds) == ([0, 0, 5, 0], [5, 6, 7, 5])
    assert batch.state_hashes()[0] == hashes[0]
    batch.restore(3, kept)
    assert batch.ticks[3] == 5
    batch.restore(1, kept)
    assert (batch.ticks[1], batch.seeds[1]) == (5, 5)
    assert batch.state_hashes()[1] == batch.state_hashes()[3]


def test_a_world_that_does_not_move_has_no_reward() -> None:
    batch = sim.Batch("grasp", "softhand", 2, training=Training(shaping=True), threads=1)
    batch.reset([1, 2])
    down = np.zeros((2, 7))
    down[:, 2] = -0.3
    first = batch.step(down, 10)
    assert first.shaping is not None
    assert np.all(first.shaping != 0.0)
    stepped = batch.step(down, 10, mask=[True, False])
    assert stepped.shaping is not None
    assert (stepped.shaping != 0.0).tolist() == [True, False]
    assert stepped.rewards[1] == 0.0


def test_a_run_in_a_batch_ends_with_its_count(tmp_path: Path) -> None:
    short = short_grasp(tmp_path, 3.0)
    batch = sim.Batch(short, "softhand", 2)
    batch.reset([1, 2])
    world = sim.World(short, "softhand", 2)
    limit = round(world.run.time_limit_s / world.run.tick_s)
    assert limit == 300
    stepped = batch.step(np.zeros((2, 7)), limit + 50)
    assert list(stepped.truncated) == [True, True]
    assert batch.ticks == [limit, limit] or min(batch.ticks) >= limit
    world.step(base=palmares.twist([0, 0, 0], [0, 0, 0]), hand=[0.0], repeat=limit + 50)
    expected, found = world.result(), batch.result(1)
    assert found is not None
    assert (found["score"], found["reason"], found["state_hash"]) == (
        expected.score,
        "time_limit",
        expected.state_hash,
    )
    again = batch.step(np.zeros((2, 7)), 5)
    assert list(again.rewards) == [0.0, 0.0]
    assert batch.result(1) == found
    with pytest.raises(palmares.WrongStateError):
        world.step()


@pytest.mark.parametrize("seed", range(8))
def test_bad_input_is_refused_and_changes_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = sim.World("balls", "softhand", 1)
    batch = sim.Batch("balls", "softhand", 2)
    batch.reset([1, 1])
    before = world.state_hash()
    odd: list[Any] = [
        None, "", "x", -1, 2**63, 2**53, 1e308, float("nan"), float("inf"), [], [[]], [1, [2]], {}, b"\xff",
        np.zeros((2, 2)), np.array([None]), [float("nan")] * 7, object(), True, 3 + 4j,
    ]  # fmt: skip
    refused = (ValueError, TypeError, OverflowError, palmares.PalmaresError)

    def pick() -> Any:
        return odd[rng.integers(len(odd))]

    calls: list[Callable[[], Any]] = [
        lambda: sim.World(pick(), pick(), pick()),
        lambda: sim.World("balls", "softhand", pick(), noise=pick()),
        lambda: sim.World("balls", pick(), 1),
        lambda: sim.Batch("balls", "softhand", pick(), threads=pick()),
        lambda: sim.Snapshot(pick()),
        lambda: world.restore(pick()),
        lambda: world.step(base=pick(), hand=[float("nan")]),
        lambda: world.step(hand=[pick(), pick()]),
        lambda: world.step(repeat=-1),
        lambda: world.step(cameras=["none.such"]),
        lambda: world.perturb("no such link", pick(), pick()),
        lambda: batch.step(pick()),
        lambda: batch.step(np.full((2, 7), np.nan)),
        lambda: batch.step(np.zeros((2, 7)), 0),
        lambda: batch.reset(pick()),
        lambda: batch.reset([1, 2**53]),
        lambda: batch.reset([1, 2], mask=[True]),
        lambda: batch.snapshot(2),
        lambda: batch.restore(0, pick()),
    ]
    for call in calls:
        with contextlib.suppress(*refused):  # Some of what is picked is valid by chance.
            call()
    assert world.state_hash() == before == batch.state_hashes()[0]


LONG = """
import signal, sys
import numpy as np
from palmares import sim
# A shell makes background processes ignore Ctrl-C; undo that.
signal.signal(signal.SIGINT, signal.default_int_handler)
world = sim.World("balls", "softhand", 1)
batch = sim.Batch("balls", "softhand", 4)
batch.reset(range(4))
calls = {
    "world": lambda: world.step(hand=[1.0], repeat=2**31),
    "batch": lambda: batch.step(np.zeros((4, 7)), 2**31),
    "reset": lambda: sim.Batch("shelf", "softhand", 100_000).reset(range(100_000)),
}
try:
    print("ready", flush=True)
    calls[sys.argv[1]]()
except KeyboardInterrupt:
    print("interrupted", world.tick, max(batch.ticks), flush=True)
else:
    print("ran on", flush=True)
"""


@pytest.mark.parametrize("call", ["world", "batch", "reset"])
def test_ctrl_c_ends_a_long_call(call: str) -> None:
    command = [sys.executable, "-c", LONG, call]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "ready\n"
        child.send_signal(signal.SIGINT)
        assert child.stdout.readline().startswith("interrupted")
