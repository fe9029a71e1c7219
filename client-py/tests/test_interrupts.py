"""Ctrl-C, cut connections and resumed sessions: no tick is lost, none is added.

`PALMARES_INTERRUPTS` is the number of random ones, by default few.
"""

from __future__ import annotations

import logging
import os
import random
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest

import palmares
from palmares import sim
from palmares.errors import InUseError
from tests.fake_server import FakeServer
from tests.interrupting import alarms, at_line
from tests.real_server import RealServer, needs_server

COUNT = int(os.environ.get("PALMARES_INTERRUPTS", "40"))
# Every line with many interrupts, else each seventh.
STRIDE = 1 if COUNT >= 1000 else 7


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with RealServer(tmp_path_factory.mktemp("data")) as server:
        yield server.url


@pytest.fixture(params=["local", pytest.param("server", marks=needs_server)])
def where(request: pytest.FixtureRequest) -> str:
    return "local" if request.param == "local" else str(request.getfixturevalue("url"))


@pytest.fixture
def fake() -> Iterator[FakeServer]:
    with FakeServer() as server:
        yield server


def undisturbed(moves: list[tuple[float, int]]) -> palmares.Result:
    """Return the result of a run with these commands and repeats."""
    with palmares.Client("local") as client:
        client.reset("balls", "softhand", seed=1)
        for sigma, ticks in moves:
            client.step(hand=[sigma], repeat=ticks)
        return client.stop()


def same(found: palmares.Result, wanted: palmares.Result) -> None:
    assert (found.ticks, found.state_hash, found.score) == (wanted.ticks, wanted.state_hash, wanted.score)


def test_a_step_interrupted_at_any_line_is_made_once(where: str) -> None:
    moves: list[tuple[float, int]] = []
    with palmares.Client(where) as client:
        client.reset("balls", "softhand", seed=1)
        for line in range(1, 10_000, STRIDE):
            before = client.tick
            assert before is not None
            sigma = line % 100 / 100
            interrupted = at_line(line, partial(client.step, hand=[sigma], repeat=2))
            now = client.latest()
            assert now.tick in (before, before + 2)
            if now.tick > before:
                moves.append((sigma, 2))
                assert now.hand.actuators[0].command == sigma
            if not interrupted:
                break
        assert 30 < line < 5_000, "the number of lines of a step"
        assert len(moves) > line // STRIDE // 2
        same(client.stop(), undisturbed(moves))


def test_reset_and_stop_interrupted_at_any_line_are_made_once(where: str) -> None:
    with palmares.Client(where) as client:
        runs = set()
        for line in range(1, 10_000, 2 * STRIDE):
            at_line(line, lambda: client.reset("balls", "softhand", seed=1))
            obs = client.latest() if client.tick is not None else client.reset("balls", "softhand", seed=1)
            assert obs.tick == 0
            assert client.scene.free[0].name == "ball_0"
            runs.add(obs.run_id)
            client.step(hand=[0.5])
            interrupted = at_line(line, client.stop)
            result = client.stop() if interrupted and client.result is None else client.result
            if client.tick is not None:
                result = client.stop()
            assert result is not None
            assert (result.run_id, result.ticks) == (obs.run_id, 1)
            if line > 40 and not interrupted:
                break
        assert len(runs) == 1 + line // (2 * STRIDE)


@pytest.mark.parametrize("draws", range(2))
def test_a_second_interrupt_while_the_first_is_mended(where: str, draws: int) -> None:
    draw, moves = random.Random(draws), []
    with palmares.Client(where) as client:
        client.reset("balls", "softhand", seed=1)
        for k in range(6):
            before = client.tick
            sigma = draw.random()
            at_line(draw.randrange(30, 120), partial(client.step, hand=[sigma], repeat=3))
            while at_line(draw.randrange(1, 400), client.latest) and k % 3:
                pass
            if client.latest().tick != before:
                moves.append((sigma, 3))
        same(client.stop(), undisturbed(moves))


def cut(client: palmares.Client, wait_s: float) -> threading.Timer:
    timer = threading.Timer(wait_s, client._link.abort)
    timer.start()
    return timer


def test_random_interrupts_cuts_and_resumes_of_a_run(where: str) -> None:
    draw, moves = random.Random(COUNT), []
    with palmares.Client(where) as client, alarms() as alarm:
        client.reset("balls", "softhand", seed=1)
        longest, disturbed = 0.03, 0
        for _ in range(COUNT):
            move = draw.random(), draw.choice([1, 1, 3, 10, 30])
            before, cuts = client.tick, []
            assert before is not None
            kind = draw.choice(["interrupt", "cut", "both", "resume", "twice"])
            if kind == "resume":
                client._link.abort()
                disturbed += 1
            if kind in ("cut", "both"):
                cuts.append(cut(client, draw.uniform(0.0, longest)))
            step = partial(client.step, hand=[move[0]], repeat=move[1])
            began = time.monotonic()
            if kind in ("interrupt", "both", "twice"):
                disturbed += alarm(draw.uniform(0.0, longest), step)
            else:
                step()
                longest = max(1e-3, min(longest, 1.5 * (time.monotonic() - began)))
            while kind == "twice" and alarm(draw.uniform(0.0, longest), client.latest):
                kind = draw.choice(["twice", "once"])
            for timer in cuts:
                timer.join()
            now = client.latest()
            assert now.tick in (before, before + move[1])
            if now.tick == before:
                step()  # It was interrupted before it began.
            moves.append(move)
        print(f"{COUNT} steps, {disturbed} of them interrupted or on a new connection, and random cuts")
        assert disturbed > COUNT // 4
        same(client.stop(), undisturbed(moves))


def tick_of(played: sim.World | sim.Batch) -> int:
    return played.tick if isinstance(played, sim.World) else max(played.ticks)


def test_random_interrupts_of_long_steps_of_worlds() -> None:
    draw, made = random.Random(COUNT), []
    world, batch = sim.World("balls", "softhand", 1), sim.Batch("balls", "softhand", 2, threads=2)
    batch.reset([1, 2])
    actions = np.zeros((2, 7))
    interrupted = 0
    with alarms() as alarm:
        for _ in range(max(4, COUNT // 10)):
            sigma, ticks = draw.random(), draw.randrange(100, 400)
            actions[:, 6] = sigma
            calls: list[tuple[Any, Callable[[], object]]] = [
                (world, partial(world.step, hand=[sigma], repeat=ticks)),
                (batch, partial(batch.step, actions, ticks)),
            ]
            for played, call in calls:
                before = tick_of(played)
                interrupted += alarm(draw.uniform(0.0, 0.1), call)
                played.finish()
                assert tick_of(played) in (before, before + ticks)
                if tick_of(played) == before:
                    call()
            made.append((sigma, ticks))
    wanted, both = sim.World("balls", "softhand", 1), sim.Batch("balls", "softhand", 2, threads=1)
    both.reset([1, 2])
    for sigma, ticks in made:
        wanted.step(hand=[sigma], repeat=ticks)
        actions[:, 6] = sigma
        both.step(actions, ticks)
    assert interrupted > len(made) // 2
    assert world.state_hash() == wanted.state_hash()
    assert batch.state_hashes() == both.state_hashes()
    assert batch.scores.tolist() == both.scores.tolist()


def test_an_interrupted_step_of_a_world_goes_on_with_the_next_one() -> None:
    world, wanted = sim.World("balls", "softhand", 1), sim.World("balls", "softhand", 1)
    with alarms() as alarm:
        assert alarm(0.06, lambda: world.step(hand=[1.0], repeat=3000))
    assert world.unfinished is not None
    assert 0 < world.tick == 3000 - world.unfinished
    copy, dropped = world.fork(), world.fork()
    dropped.drop_step()
    tick = dropped.tick
    assert dropped.step(hand=[0.2]).tick == tick + 1
    assert world.step(hand=[0.2], repeat=5).tick == 3005
    wanted.step(hand=[1.0], repeat=3000)
    wanted.step(hand=[0.2], repeat=5)
    assert world.state_hash() == wanted.state_hash()
    finished = copy.finish()
    assert finished is not None
    assert finished.tick == 3000
    assert copy.finish() is None


def test_interrupted_environments_go_on_with_the_same_bits() -> None:
    from palmares.gym import BatchEnv, PalmaresEnv

    env, wanted = (PalmaresEnv(None, task="balls", hand="softhand", ticks=100) for _ in range(2))
    many, all_wanted = (BatchEnv("balls", "softhand", 2, ticks=400) for _ in range(2))
    action = {"twist": np.zeros(6), "hand": np.ones(1)}
    rows = np.full((2, 7), 0.1)
    env.reset(seed=1), wanted.reset(seed=1), many.reset(seed=1), all_wanted.reset(seed=1)
    with alarms() as alarm:
        for k in range(3):
            alarm(0.02 + 0.01 * k, lambda: env.step(action))
            alarm(0.06 + 0.01 * k, lambda: many.step(rows))
            env.client.latest()
            many.batch.finish()
            if env.client.tick == 100 * k:
                env.step(action)
            if max(many.batch.ticks) == 400 * k:
                many.step(rows)
            wanted.step(action), all_wanted.step(rows)
    worlds: list[Any] = [env.world, wanted.world]
    assert worlds[0].state_hash() == worlds[1].state_hash()
    assert many.batch.state_hashes() == all_wanted.batch.state_hashes()


def test_the_observation_of_an_interrupted_step_can_be_had(where: str) -> None:
    with palmares.Client(where) as client, palmares.Client("local") as wanted:
        client.reset("balls", "softhand", seed=1)
        wanted.reset("balls", "softhand", seed=1)
        while not at_line(60, lambda: client.step(hand=[0.7], repeat=5)):
            pytest.fail("the step has fewer lines")
        missed, obs = client.latest(), wanted.step(hand=[0.7], repeat=5)
        assert (missed.tick, missed.hand.actuators, missed.score) == (5, obs.hand.actuators, obs.score)
        assert missed.truth is not None
        assert obs.truth is not None
        assert np.array_equal(missed.truth.positions, obs.truth.positions)
        assert client.latest() is missed


def test_an_interrupted_run_can_be_stopped_and_another_opened(where: str) -> None:
    with palmares.Client(where) as client:
        for line in (40, 55, 70):
            client.reset("balls", "softhand", seed=1)
            at_line(line, lambda: client.step(hand=[0.7], repeat=5))
            assert client.stop().ticks in (0, 5)


@needs_server
def test_the_heartbeat_needs_no_lock_of_the_logging_module(url: str) -> None:
    # `logging` of Python 3.11 keeps its lock for ever after an interrupt between its `acquire` and its `try`.
    lock: Any = logging._lock  # type: ignore[attr-defined]
    with palmares.Client(url) as client:
        link: Any = client._session.link
        with lock:
            link.abort()
            beat = threading.Thread(target=link.beat, daemon=True)
            beat.start()
            beat.join(timeout=20.0)
            assert not beat.is_alive()
        assert link.resumed is not None


def test_a_forked_child_has_worlds_of_its_own() -> None:
    with palmares.Client("local") as client:
        client.reset("balls", "softhand", seed=1)
        client.step(hand=[0.5])
        child = os.fork()
        if child == 0:
            client.step(hand=[0.1], repeat=7)
            os._exit(client.latest().tick)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 8
        client.step(hand=[0.5])
        same(client.stop(), undisturbed([(0.5, 1)] * 2))


@needs_server
def test_a_forked_child_gets_an_error_and_leaves_the_parents_run_alone(url: str) -> None:
    with palmares.Client(url) as client:
        client.reset("balls", "softhand", seed=1)
        client.step(hand=[0.5])
        child = os.fork()
        if child == 0:
            said = 0
            for call in (lambda: client.step(hand=[0.1]), client.stop, client.time, client.latest):
                try:
                    call()
                except InUseError as error:
                    said += f"process {os.getppid()}" in str(error)
            client.close()
            os._exit(said)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 4
        client.step(hand=[0.5])
        same(client.stop(), undisturbed([(0.5, 1)] * 2))


def test_a_second_thread_gets_an_error(fake: FakeServer, monkeypatch: pytest.MonkeyPatch) -> None:
    reply, received, go_on = fake._reply, threading.Event(), threading.Event()

    def slow(request: dict[str, Any]) -> dict[str, Any]:
        if request["op"] == "step" and request["tick"] == 0:
            received.set()
            assert go_on.wait(10.0)
        return reply(request)

    monkeypatch.setattr(fake, "_reply", slow)
    with palmares.Client(fake.url) as client:
        client.reset("balls", "softhand")
        found: list[palmares.Observation] = []
        thread = threading.Thread(target=lambda: found.append(client.step(hand=[0.3], repeat=7)))
        thread.start()
        assert received.wait(10.0)
        for call in (lambda: client.step(hand=[0.9]), client.stop, client.time):
            with pytest.raises(InUseError, match="one thread at a time"):
                call()
        go_on.set()
        thread.join()
        assert [obs.tick for obs in found] == [7]
        assert client.step(hand=[0.9]).tick == 8
    assert [request["op"] for request in fake.requests][:4] == ["hello", "reset", "step", "step"]
