"""Worlds that fail: Python reports cause, time and remedies."""

from __future__ import annotations

import pickle
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import palmares
import palmares.gym
from palmares import sim
from palmares.errors import RunLostError, error_of
from palmares.messages import Result
from tests.fake_server import FakeServer
from tests.real_server import RealServer, needs_server

PINCH = Path(__file__).parents[2] / "models/hands/pinch"
# Limits of a competition that the hand below exceeds.
BOUND = (
    "joint_torque_nm",
    "moment_arm",
    "tendon_stiffness",
    "tendon_force",
    "motor_scaling",
    "motor_speed_per_s",
    "motor_power_w",
)
WORDS = "the world failed ({fault}) in tick {tick}, step "


@pytest.fixture
def billion(tmp_path: Path) -> str:
    """Write a hand on which every world fails: 1e9 for force, stiffness, winding and speed."""
    folder = tmp_path / "billion"
    folder.mkdir()
    urdf = re.sub(r"(<offset>)[^<]*", r"\g<1>0", (PINCH / "hand.urdf").read_text())
    toml = (PINCH / "hand.toml").read_text().replace('"pinch"', '"billion"', 1)
    toml = re.sub(r"(?m)^(scaling|speed_limit|stiffness|force_limit) = \S+", r"\1 = 1e9", toml)
    toml = re.sub(r"(?m)^offset = \S+", "offset = 0.0", toml)
    (folder / "hand.urdf").write_text(urdf)
    (folder / "hand.toml").write_text(toml)
    return str(folder)


def failure(step: Callable[[int], Any]) -> palmares.WorldFaultError:
    """Step until the world fails; return the error."""
    for k in range(500):
        try:
            step(k % 2)
        except palmares.WorldFaultError as error:
            return error
    pytest.fail("this world was computed")


def check_fault(error: palmares.WorldFaultError, result: Result, before: int) -> None:
    """Check error and result of a world that failed in the tick after `before`."""
    assert error.code == "internal"
    assert isinstance(error, palmares.InternalError)
    assert not error.fatal
    begins = WORDS.format(fault=error.fault, tick=before + 1)
    assert begins in str(error)
    assert sim.FAULTS[error.fault] in str(error)
    assert (result.reason, result.status, result.fault) == ("world_fault", "voided", error.fault)
    assert result.voided
    assert result.note is not None
    assert result.note.startswith(begins)
    assert sim.FAULTS[error.fault] in result.note
    assert result.note in str(result)


def test_every_fault_has_words() -> None:
    assert set(sim.FAULTS) == {"not_finite", "out_of_bounds", "unsolvable", "work_exhausted", "crashed"}
    assert all("; " in words for words in sim.FAULTS.values())


def test_a_world_reports_the_cause_of_its_failure(billion: str) -> None:
    world, ticks = sim.World("grasp", billion, seed=1), [0]

    def step(sigma: int) -> None:
        ticks[0] = world.tick
        world.step(hand=[sigma, sigma])

    error = failure(step)
    check_fault(error, world.result(), ticks[0])
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), again.fault, str(again)) == (type(error), error.fault, str(error))
    with pytest.raises(palmares.WrongStateError, match="over"):
        world.step()
    sound = sim.World("grasp", "pinch", seed=1)
    assert (sound.result().fault, sound.result().note) == (None, None)


def test_a_batch_reports_the_causes_of_failures(billion: str) -> None:
    batch = sim.Batch("grasp", billion, 2, threads=1)
    batch.reset([1, 2])
    for k in range(500):
        actions = np.zeros((2, batch.action_len))
        actions[:, 6:] = k % 2
        if batch.step(actions, 1).truncated.all():
            break
    for k in range(2):
        result = batch.result(k)
        assert result is not None
        assert (result["status"], result["reason"]) == ("voided", "world_fault")
        assert result["note"].startswith(WORDS.format(fault=result["fault"], tick=batch.ticks[k]))
        assert sim.FAULTS[result["fault"]] in result["note"]
    pinch = sim.Batch("grasp", "pinch", 1)
    pinch.reset([1])
    limit_s = sim.World("grasp", "pinch", seed=1).run.time_limit_s
    pinch.step(np.zeros((1, pinch.action_len)), round(limit_s / pinch.tick_s) + 1)
    sound = pinch.result(0)
    assert sound is not None
    assert (sound["fault"], sound["note"]) == (None, None)


def test_environments_report_the_cause(billion: str) -> None:
    env = palmares.gym.PalmaresEnv("local", task="grasp", hand=billion, ticks=1)
    env.reset(seed=1)
    for k in range(500):
        action = {"twist": np.zeros(6), "hand": np.full(2, float(k % 2))}
        observation, _, terminated, truncated, info = env.step(action)
        if truncated:
            break
    assert not terminated
    assert env.observation_space.contains(observation)
    alone = info["result"]
    assert (alone["status"], alone["reason"]) == ("voided", "world_fault")
    assert alone["fault"] in alone["note"]
    assert info["tick"] == alone["ticks"]
    env.reset(seed=1)
    env.close()
    many = palmares.gym.BatchEnv("grasp", billion, 2, ticks=1, threads=1)
    many.reset(seed=1)
    infos: dict[str, Any] = {}
    for k in range(500):
        actions = np.zeros((2, 8))
        actions[:, 6:] = 2.0 * (k % 2) - 1.0
        *_, infos = many.step(actions)
        if "result" in infos:
            break
    result = infos["result"]
    failed = int(np.flatnonzero(result["_reason"])[0])
    assert result["reason"][failed] == "world_fault"
    assert result["fault"][failed] in result["note"][failed]
    assert alone == {name: result[name][0] for name in alone}


def test_a_local_client_reports_the_cause(billion: str) -> None:
    with palmares.Client("local") as client:
        client.reset("grasp", billion, seed=1)
        error = failure(lambda sigma: client.step(hand=[sigma, sigma]))
        before = client.tick
        assert before is not None
        check_fault(error, client.stop(), before)
        assert client.reset("grasp", "pinch", seed=1).tick == 0


@needs_server
def test_a_server_reports_the_cause_in_lockstep_and_in_real_time(billion: str, tmp_path: Path) -> None:
    limits = tmp_path / "limits.toml"
    limits.write_text('mode = "practice"\n[hand_limits]\n' + "".join(f"{figure} = inf\n" for figure in BOUND))
    arguments = ["--config", str(limits), "--hand", billion]
    with RealServer(tmp_path / "data", *arguments) as server, palmares.Client(server.url) as client:
        client.reset("grasp", "billion", seed=1)
        error = failure(lambda sigma: client.step(hand=[sigma, sigma]))
        before = client.tick
        assert before is not None
        check_fault(error, client.stop(), before)
        client.reset("grasp", "billion", seed=1, mode="realtime")
        for obs in client.observations():
            if not obs.done:
                client.act(hand=[obs.tick % 2] * 2)
        assert (obs.truncated, obs.reason) == (True, "world_fault")
        result = client.stop()
        assert result.fault is not None
        assert result.note is not None
        assert f"({result.fault})" in result.note


def test_faults_of_another_server_are_kept() -> None:
    with FakeServer() as server, palmares.Client(server.url) as client:
        client.reset("balls", "softhand")
        message = "the world failed (melted) in tick 1, step 3: it is too warm; try ice"
        server.replies.append({"op": "error", "code": "internal", "message": message, "fault": "melted"})
        with pytest.raises(palmares.WorldFaultError, match="try ice") as raised:
            client.step()
        assert raised.value.fault == "melted"
        server.replies.append({"op": "error", "code": "internal", "message": "no"})
        with pytest.raises(palmares.InternalError) as plain:
            client.step()
        assert not isinstance(plain.value, palmares.WorldFaultError)
    assert isinstance(error_of("internal", "", fault="unsolvable"), palmares.WorldFaultError)


@pytest.mark.parametrize("given_back", [True, False])
def test_the_error_of_a_lost_run_has_its_note(given_back: bool) -> None:
    note = "the world failed (unsolvable)" + ("" if given_back else ". Its time is not given back: why")
    result = Result(
        run_id="r", task="t", hand="h", status="voided", score=0.0, in_goal=0, outside=0,
        reason="world_fault", ticks=3, sim_time_s=0.03, state_hash="0", note=note, task_hash="",
        mode="lockstep", missed_ticks=0, late_ticks=0, late_max_s=0.0, dropped_obs=0, events=[],
    )  # fmt: skip
    text = str(RunLostError.of("r", result))
    assert note in text
    assert ("and its time is given back" in text) == given_back
