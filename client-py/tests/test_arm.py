"""A hand on an arm: joints from Python, in a world, a batch, an environment and on a server."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import palmares
from palmares.analysis import RobotArm
from palmares.examples import grasp_arm
from palmares.gym import BatchEnv, PalmaresEnv
from palmares.sim import Batch, World
from tests.real_server import RealServer, needs_server

TASK = grasp_arm.TASK


def test_kinematics_of_the_arm() -> None:
    arm = RobotArm(TASK)
    assert arm.joints[0] == "fr3_joint1"
    # All joints at 0: the flange looks down, 0.333 + 0.316 + 0.384 - 0.107 m up and 0.088 m before the foot.
    np.testing.assert_allclose(arm.base(np.zeros(7))[:3], [-0.55 + 0.088, 0.0, 0.926], atol=1e-12)
    q, h = arm.start, 1e-6
    differences = [(arm.base(q + h * e) - arm.base(q - h * e))[:3] / (2.0 * h) for e in np.eye(7)]
    np.testing.assert_allclose(arm.jacobian(q)[:3], np.transpose(differences), atol=1e-9)
    found = arm.inverse([0.05, 0.1, 0.4, 0.0, 1.0, 0.0, 0.0])
    assert found.is_there
    np.testing.assert_allclose(arm.base(found.q)[:3], [0.05, 0.1, 0.4], atol=1e-6)
    assert not arm.inverse([1.5, 0.0, 0.4]).is_there
    with pytest.raises(ValueError, match="has no arm"):
        RobotArm("grasp")


def test_batch_world_and_environments_have_the_same_joints() -> None:
    wanted = RobotArm(TASK).start + 0.1
    batch = Batch(TASK, "softhand", 2, base="joints", threads=1)
    batch.reset([5, 6])
    stepped = batch.step(np.tile([*wanted, 0.5], (2, 1)), ticks=80)
    np.testing.assert_allclose(stepped.observations["arm"][:, 0], [wanted, wanted], atol=5e-3)

    world = World(TASK, "softhand", seed=5)
    obs = world.step(base=palmares.joints(wanted), hand=0.5, repeat=80)
    assert world.state_hash() == batch.state_hashes()[0]
    assert obs.arm is not None
    np.testing.assert_array_equal(obs.arm.position, stepped.observations["arm"][0, 0])
    with pytest.raises(palmares.BadActionError, match="6 entries; the arm has 7 joints"):
        world.step(base=palmares.joints(wanted[:6]))
    with pytest.raises(ValueError, match='task "grasp" has no arm'):
        Batch("grasp", "softhand", 1, base="joints")

    envs = BatchEnv(TASK, "softhand", 2, threads=1)
    first_of_two, _ = envs.reset(seed=5)
    assert first_of_two["arm"].shape == (2, 2, 7)
    env = PalmaresEnv(None, task=TASK, hand="softhand")
    first, _ = env.reset(seed=5)
    assert env.observation_space.contains(first)
    env.close()


@needs_server
def test_the_example_grasps_by_joints_on_a_server(tmp_path: Path) -> None:
    with RealServer(tmp_path, "--task", TASK) as server, palmares.Client(server.url, team="arm") as client:
        assert [joint.name for joint in client.welcome.task("grasp_arm").arm][:1] == ["fr3_joint1"]
        summary = grasp_arm.run(client, 2)
    assert summary.score > 9.0, summary
