"""Vector environments say and do what single ones do."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import palmares.gym
from tests.fake_server import FakeServer
from tests.short_task import short_grasp

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

NAME = "palmares/Grasp-Pinch-v1"
# A step of the short task, ticks; a run has three.
STEP = 40
REST = np.array([0.0] * 6 + [-1.0, -1.0])


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the path of a task whose runs have three steps."""
    return short_grasp(tmp_path_factory.mktemp("short"), 3 * STEP * 0.01)


def described(infos: dict[str, Any]) -> dict[str, Any]:
    """Return the type and the mask of each entry that an environment has."""
    found: dict[str, Any] = {}
    for name, values in infos.items():
        mask = values if name.startswith("_") else infos[f"_{name}"]
        if not mask.any():
            continue
        if isinstance(values, dict):
            found[name] = described(values)
        elif name.startswith("_"):
            found[name] = values.tolist()
        else:
            found[name] = values.dtype, values.shape
    return found


@pytest.mark.parametrize("most", [None, 2])
@pytest.mark.parametrize("mode", AutoresetMode)
def test_infos_are_those_of_single_environments(short: str, mode: AutoresetMode, most: int | None) -> None:
    options: dict[str, Any] = {"task": short, "ticks": STEP, "shaping": True, "randomise": ["hand"]}
    name, rest = "palmares/Grasp-SoftHand-v1", np.array([0.0] * 6 + [-1.0])
    native = gymnasium.make_vec(name, 2, max_episode_steps=most, threads=1, autoreset_mode=mode, **options)
    single = gymnasium.make_vec(
        name, 2, "sync", {"autoreset_mode": mode}, max_episode_steps=most or 100, **options
    )
    assert isinstance(single, SyncVectorEnv)
    assert native.metadata["autoreset_mode"] is mode
    assert native.metadata["render_fps"] == single.envs[0].metadata["render_fps"]
    assert described(native.reset(seed=4)[1]) == described(single.reset(seed=4)[1])
    for k in range(4):
        actions = np.tile(rest, (2, 1))
        left, right = native.step(actions), single.step(actions)
        assert [list(flags) for flags in left[2:4]] == [list(flags) for flags in right[2:4]]
        expected = right[4]
        if mode is AutoresetMode.SAME_STEP and "final_info" in expected:
            # The native one keeps the entries of an episode's last step.
            expected = expected["final_info"] | expected
            assert described(left[4]["final_info"]) == described(expected["final_info"])
            for name in ("tick", "score", "is_success", "events", "shaping", "result"):
                if f"_{name}" in expected:
                    expected[f"_{name}"] = np.array([True, True])
        assert described(left[4]) == described(expected), k
        over = left[2] | left[3]
        if mode is AutoresetMode.DISABLED and over.any():
            native.reset(options={"reset_mask": over})
            single.reset(options={"reset_mask": over.copy()})


def test_values_are_those_of_a_single_environment(short: str) -> None:
    options: dict[str, Any] = {"task": short, "ticks": STEP, "max_episode_steps": 3, "shaping": "info"}
    many, one = gymnasium.make_vec(NAME, num_envs=2, **options), gymnasium.make(NAME, **options)
    many.reset(seed=6)
    one.reset(seed=7)
    for _ in range(3):
        *left, infos = many.step(np.tile(REST, (2, 1)))
        *right, info = one.step(REST)
        assert [values[1] for values in left[1:]] == right[1:]
        row = palmares.gym.infos.row_of(infos, 1)
        assert row == info
        assert {name: type(value) for name, value in row.items()} == {
            name: type(value) for name, value in info.items()
        }
    assert info["result"]["reason"] == "time_limit"


def test_attributes_are_those_of_all() -> None:
    envs: Any = gymnasium.make_vec("palmares/Balls-SoftHand-v1", num_envs=2, fraction=0.2)
    assert envs.get_attr("fraction") == envs.call("fraction") == (0.2, 0.2)
    assert len(envs.call("reset", seed=1)) == 2
    envs.set_attr("fraction", [0.3, 0.3])
    observations, _ = envs.reset(seed=1)
    assert (observations["object_kind"] >= 0.0).sum(axis=1).tolist() == [3, 3]
    with pytest.raises(ValueError, match="wanted one value for all 2"):
        envs.set_attr("fraction", [0.3, 0.4])
    for name in ("call", "get_attr"):
        with pytest.raises(AttributeError, match="colour"):
            getattr(envs, name)("colour")
    with pytest.raises(AttributeError, match="colour"):
        envs.set_attr("colour", 1)
    with pytest.raises(TypeError, match="argument 'url': unknown, or for a single"):
        gymnasium.make_vec(NAME, num_envs=2, url="local")
    with pytest.raises(ValueError, match="max_episode_steps: found 0"):
        gymnasium.make_vec(NAME, num_envs=2, max_episode_steps=0)


def test_longer_steps_and_late_actions_are_those_of_the_worlds() -> None:
    options: dict[str, Any] = {"step_ms": 5, "action_delay": (3, 3), "action_noise": 0.01}
    many: Any = gymnasium.make_vec(NAME, num_envs=2, **options)
    one: Any = gymnasium.make(NAME, **options)
    plain: Any = gymnasium.make_vec(NAME, num_envs=2)
    for envs, seed in ((many, 1), (one, 2), (plain, 1)):
        envs.reset(seed=seed)
    action = np.array([0.2] * 6 + [0.5] * 2)
    for envs in (many, plain):
        envs.step(np.tile(action, (2, 1)))
    one.step(action)
    assert many.batch.state_hashes()[1] == one.unwrapped.world.state_hash()
    assert many.batch.state_hashes()[1] != plain.batch.state_hashes()[1]
    assert many.batch.training.step_ms == 5


def test_an_unknown_option_of_a_reset_is_refused() -> None:
    envs, env = gymnasium.make_vec(NAME, num_envs=2), gymnasium.make(NAME)
    with pytest.raises(ValueError, match="options: found 'pose'; wanted 'reset_mask' or 'parameters'"):
        envs.reset(options={"pose": 1})
    with pytest.raises(ValueError, match="options: found 'pose'; wanted 'parameters'"):
        env.reset(options={"pose": 1})
    env.reset(options={})


def test_pictures_are_the_same() -> None:
    options: dict[str, Any] = {
        "render_mode": "rgb_array",
        "render_camera": sim.View.looking((0.5, -0.4, 0.6), at=(0.0, 0.0, 0.2)),
        "render_size": (64, 48),
    }
    many: Any = gymnasium.make_vec(NAME, num_envs=2, **options)
    one: Any = gymnasium.make(NAME, **options)
    many.reset(seed=1)
    one.reset(seed=2)
    first, second = many.render()
    assert first.shape == second.shape == (48, 64, 3)
    assert (second == one.render()).all()
    assert (first != second).any()
    assert (many.call("render")[1] == second).all()
    options["render_camera"] = "nowhere"
    for make in (gymnasium.make, gymnasium.make_vec):
        with pytest.raises(
            ValueError, match="render_camera: found 'nowhere'; wanted one of top, table, film, or a View"
        ):
            make(NAME, **options)


def test_images_are_fields_of_observations() -> None:
    options: dict[str, Any] = {"cameras": ["table", "top.rgb"]}
    many, one = gymnasium.make_vec(NAME, num_envs=2, **options), gymnasium.make(NAME, **options)
    assert many.single_observation_space == one.observation_space
    found, alone = many.reset(seed=1)[0], one.reset(seed=2)[0]
    for _ in range(2):
        assert many.observation_space.contains(found)
        assert one.observation_space.contains(alone)
        assert (found["rgb_top"][1] == alone["rgb_top"]).all()
        assert (found["depth_table"][1] == alone["depth_table"]).all()
        found, alone = many.step(np.tile(REST, (2, 1)))[0], one.step(REST)[0]
    with pytest.raises(ValueError, match=r"cameras: found 'table.heat'; wanted some of top, top.rgb"):
        gymnasium.make_vec(NAME, num_envs=2, cameras=["table.heat"])
    with pytest.raises(ValueError, match="wanted noise='none'"):
        gymnasium.make_vec(NAME, num_envs=2, noise="real", **options)


GO_ON = """
import pickle, sys
import numpy as np
env, action = pickle.load(open(sys.argv[1], "rb"))
for _ in range(3):
    outcome = env.step(action)
pickle.dump(outcome, open(sys.argv[2], "wb"))
"""


@pytest.mark.parametrize("count", [None, 3])
def test_a_checkpoint_goes_on_in_another_process(count: int | None, short: str, tmp_path: Path) -> None:
    options: dict[str, Any] = {"task": short, "ticks": STEP, "shaping": True, "max_episode_steps": 4}
    env: Any
    if count is None:
        env, action = gymnasium.make(NAME, **options).unwrapped, REST
    else:
        env, action = gymnasium.make_vec(NAME, num_envs=count, **options), np.tile(REST, (count, 1))
    env.reset(seed=1)
    env.step(action)
    with (tmp_path / "kept").open("wb") as file:
        pickle.dump((env, action), file)
    twin = copy.deepcopy(env)
    outcomes = [[there.step(action) for _ in range(2 if count is None else 3)] for there in (env, twin)]
    command = GO_ON.replace("range(3)", f"range({len(outcomes[0])})")
    subprocess.run([sys.executable, "-c", command, tmp_path / "kept", tmp_path / "went"], check=True)
    with (tmp_path / "went").open("rb") as file:
        elsewhere = pickle.load(file)
    for other in (outcomes[1][-1], elsewhere):
        for name, values in outcomes[0][-1][0].items():
            np.testing.assert_array_equal(values, other[0][name])
        np.testing.assert_array_equal(outcomes[0][-1][1], other[1])
    # Vector environments have begun another episode meanwhile.
    if count is not None:
        assert outcomes[0][-1][4]["_seed"].all()
        assert (outcomes[0][-1][4]["seed"] == elsewhere[4]["seed"]).all()


@pytest.mark.skipif(sys.platform != "linux", reason="fork() is not safe elsewhere")
def test_a_batch_steps_after_a_fork() -> None:
    """Its threads are not in the child, which must not wait for them."""
    program = """
import os, signal, warnings
import numpy as np
from palmares.sim import Batch
warnings.simplefilter("ignore")
batch = Batch("grasp", "pinch", 4, threads=2)
batch.reset(range(4))
child = os.fork()
batch.step(np.zeros((4, 8)), 5)
if child == 0:
    batch.reset(range(4))
    print(batch.ticks, flush=True)
    os._exit(0)
signal.alarm(50)
assert os.waitpid(child, 0)[1] == 0
print(batch.ticks, flush=True)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.stdout == "[0, 0, 0, 0]\n[5, 5, 5, 5]\n", done.stderr


def test_a_session_with_a_server_is_not_copied() -> None:
    with (
        FakeServer() as server,
        palmares.Client(server.url) as client,
        pytest.raises(TypeError, match="cannot be pickled or copied"),
    ):
        pickle.dumps(client)


@pytest.mark.parametrize("mode", [None, "sync"])
def test_a_row_of_a_batch_has_the_scenes_of_the_environment_with_its_seed(mode: str | None) -> None:
    def scenes(env: Any, seed: int) -> list[Any]:
        first = [env.reset(seed=seed)[1]["seed"]]
        return [*first, *(env.reset()[1]["seed"] for _ in range(2))]

    envs = gymnasium.make_vec(NAME, num_envs=3, vectorization_mode=mode)
    rows = np.array(scenes(envs, 10)).T.tolist()
    for k, row in enumerate(rows):
        env = gymnasium.make(NAME)
        assert scenes(env, 10 + k) == row
        env.close()
    envs.close()
    assert len({seed for row in rows for seed in row}) == 9, "each is another scene"
