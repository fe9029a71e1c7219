"""Every channel of a hand has the same name, shape and unit in messages, arrays, replays and for viewers."""

from __future__ import annotations

import io
import json
import shutil
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
import pytest
from gymnasium import spaces
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from websockets.sync.client import connect
from websockets.typing import Subprotocol

import palmares
from palmares.channels import array_of, depth_of
from palmares.gym import BatchEnv, FlatEnv, PalmaresEnv
from palmares.sim import Batch, World
from palmares.wire import ChannelInfo
from tests.real_server import RealServer, needs_server

pytestmark = needs_server

HAND = "every_channel"
SHAPES = {
    "base": (13,),
    "motors": (4, 4),
    "wrist": (6,),
    "encoders": (3,),
    "touch": (38, 3),
    "acceleration": (3,),
}
UNITS = {
    "base": ["m", "", "m/s", "rad/s"],
    "motors": ["", "", "1/s", "tendon"],
    "wrist": ["N", "N·m"],
    "encoders": ["rad"],
    "touch": ["N"],
    "acceleration": ["m/s²"],
}
TASK: dict[str, Any] = {"task": "grasp", "ticks": 3}
SEED = 4


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the ReFlex, which has encoders, touch and a camera, with an accelerometer."""
    folder = tmp_path_factory.mktemp("hands") / HAND
    shutil.copytree(Path(__file__).parents[2] / "models/hands/reflex", folder)
    settings = folder / "hand.toml"
    link = palmares.sim.describe_hand("reflex")["links"][0]["name"]
    sensor = f'\n[sensors.accelerometer]\nlink = "{link}"\nrange = 40.0\nnoise = 0.05\nbias = 0.02\n'
    text = settings.read_text().replace('name = "reflex"', f'name = "{HAND}"', 1)
    settings.write_text(text + sensor)
    return folder


@pytest.fixture(scope="module")
def url(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with RealServer(tmp_path_factory.mktemp("data"), "--hand", str(folder)) as server:
        yield server.url


def units(channels: list[ChannelInfo]) -> dict[str, list[str]]:
    return {channel.name: [column.unit for column in channel.columns] for channel in channels}


def shapes(space: spaces.Space[Any]) -> dict[str, tuple[int, ...]]:
    found = {name: cast(tuple[int, ...], box.shape) for name, box in cast(spaces.Dict, space).items()}
    assert found.pop("time_left") == (1,)
    return found


def played(env: PalmaresEnv | FlatEnv) -> dict[str, Any]:
    env.reset(seed=SEED)
    flat = isinstance(env, FlatEnv)
    still: Any = (
        np.concatenate([np.zeros(6), -np.ones(4)]) if flat else {"twist": np.zeros(6), "hand": np.zeros(4)}
    )
    obs = cast(dict[str, Any], env.step(still)[0])
    assert env.observation_space.contains(cast(Any, obs))
    return obs


@pytest.mark.parametrize("noise", ["none", "real"])
def test_every_channel_is_the_same_everywhere(url: str, folder: Path, noise: Literal["none", "real"]) -> None:
    own: Any = {"sensing": "sensors", "noise": noise}
    rows: list[dict[str, Any]] = []
    run_id = ""
    for encoding in ("json", "msgpack"):
        with palmares.Client(url, encoding=cast(Any, encoding)) as client:
            hand = client.welcome.hand(HAND)
            assert {channel.name: tuple(channel.shape) for channel in hand.channels} == SHAPES
            assert units(hand.channels) == UNITS
            specs = {
                field.name.split(".")[1].removesuffix("[]")
                for field in client.welcome.specs.observation
                if field.name.startswith("hand.")
            }
            assert specs == {channel.key for channel in hand.channels}
            client.reset("grasp", HAND, seed=SEED, **own)
            obs = client.step(
                base=palmares.twist([0.0] * 3, [0.0] * 3), hand=[0.0] * 4, repeat=3, cameras=["wrist"]
            )
            rows.append({channel.name: array_of(channel, obs.hand) for channel in hand.channels})
            rows[-1]["depth_wrist"] = np.nan_to_num(obs.cameras["wrist"].depth)
            assert depth_of(hand.cameras[0]).shape == list(rows[-1]["depth_wrist"].shape)
            run_id = client.stop().run_id
    for channel in SHAPES:
        assert rows[0][channel].shape == SHAPES[channel]
    single: list[PalmaresEnv | FlatEnv] = [
        PalmaresEnv(url, hand=HAND, cameras=["wrist"], **TASK, **own),
        PalmaresEnv(None, hand=str(folder), cameras=["wrist"], **TASK, **own),
        FlatEnv("grasp", str(folder), ticks=3, cameras=["wrist"], **own),
    ]
    for env in single:
        found = shapes(env.observation_space)
        assert found.pop("depth_wrist") == rows[0]["depth_wrist"].shape
        assert found == SHAPES
        rows.append(played(env))
        env.close()
    many = BatchEnv(hand=str(folder), num_envs=2, **TASK, **own)
    assert shapes(many.single_observation_space) == SHAPES
    batch = Batch("grasp", str(folder), 2, **own)
    assert {name: shape for name, shape in batch.fields.items() if name != "time_left"} == SHAPES
    batch.reset([SEED, 1])
    last = batch.step(np.zeros((2, 10)), 3).observations
    rows.append({name: values[0] for name, values in last.items()})
    for row in rows[1:]:
        for name in SHAPES:
            np.testing.assert_array_equal(row[name], rows[0][name], err_msg=name)
    check_replay(url, run_id)


def check_replay(url: str, run_id: str) -> None:
    """Telemetry has each channel in fields of its own or in the row of readings."""
    with urllib.request.urlopen(f"{url}/v1/runs/{run_id}/replay") as response:
        reader = make_reader(io.BytesIO(response.read()), decoder_factories=[DecoderFactory()])
    about = {record.name: record.metadata for record in reader.iter_metadata()}
    readings = json.loads(about["palmares.hand"]["readings"])
    assert [(one["name"], tuple(one["shape"])) for one in readings] == [
        ("wrist", (6,)),
        ("acceleration", (3,)),
    ]
    for channel in readings:
        assert [column["unit"] for column in channel["columns"]] == UNITS[channel["name"]]
    telemetry = [message for _, _, _, message in reader.iter_decoded_messages("/telemetry")]
    last = telemetry[-1]
    assert len(last.readings) == sum(int(np.prod(channel["shape"])) for channel in readings)
    assert (len(last.position), len(last.q), len(last.touch)) == (4, 7, 114)
    # Force at the wrist: the hand's weight. The accelerometer at rest: gravity.
    mass = palmares.sim.describe_hand("reflex")["mass"]
    assert np.linalg.norm(last.readings[:3]) == pytest.approx(9.81 * mass, rel=0.05)
    assert np.linalg.norm(last.readings[6:]) == pytest.approx(9.81, rel=0.01)


def test_viewers_get_the_same_channels(url: str) -> None:
    watch = url.replace("http", "ws") + "/v1/watch"
    with (
        palmares.Client(url) as client,
        connect(watch, subprotocols=[Subprotocol("palmares.v1.json")]) as socket,
    ):
        client.reset("grasp", HAND, seed=SEED)
        wanted = {"op": "subscribe", "id": 1, "featured": True, "overlays": ["telemetry"]}
        socket.send(json.dumps(wanted))
        scene: dict[str, Any] = {}
        telemetry: dict[str, Any] = {}
        for _ in range(200):
            client.step(repeat=10)
            try:
                message = json.loads(socket.recv(timeout=0.05))
            except TimeoutError:
                continue
            scene = message if message["op"] == "scene" else scene
            telemetry = message.get("telemetry", telemetry)
            if scene and telemetry:
                break
        known = {channel.name: channel for channel in client.welcome.hand(HAND).channels}
        for channel in scene["readings"]:
            assert known[channel["name"]].shape == channel["shape"]
            assert [column["unit"] for column in channel["columns"]] == UNITS[channel["name"]]
        count = sum(int(np.prod(channel["shape"])) for channel in scene["readings"])
        assert len(telemetry["readings"]) == count == 9


def test_a_world_reads_what_a_batch_reads_with_the_truth(folder: Path) -> None:
    world = World("grasp", str(folder), SEED)
    batch = Batch("grasp", str(folder), 1)
    rows = batch.reset([SEED])
    hand = palmares.sim.welcome(own_hands=[str(folder)]).hands[-1]
    obs = world.observe()
    for channel in hand.channels:
        np.testing.assert_array_equal(array_of(channel, obs.hand), rows[channel.name][0])
