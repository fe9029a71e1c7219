"""The output of a prompt or a notebook for every public type: never more than a few lines."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

import palmares
from palmares.views import LONGEST, Brief, Viewed

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not there")


def parts(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    """Yield a value and all that it consists of."""
    if isinstance(value, Mapping):
        for key, part in value.items():
            yield from parts(part, f"{path}[{key!r}]")
    elif isinstance(value, list | tuple):
        for k, part in enumerate(value):
            yield from parts(part, f"{path}[{k}]")
    elif type(value).__module__.startswith("palmares"):
        yield path, value
        fields: list[str] = list(getattr(type(value), "__struct_fields__", ()))
        if dataclasses.is_dataclass(value):
            fields = [field.name for field in dataclasses.fields(value)]
        for name in fields:
            yield from parts(getattr(value, name), f"{path}.{name}")


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return what sessions, worlds and their results consist of."""
    found: dict[str, Any] = {}
    folder: Path = tmp_path_factory.mktemp("reprs")
    with palmares.Client("local") as client:
        # The hand with the most joints, and the task with the most objects.
        obs = client.reset("balls", "allegro", seed=1, cameras=["box_a", "box_a.rgb"])
        found |= {"client": client, "welcome": client.welcome, "scene": client.scene, "first": obs}
        found["obs"] = client.step(hand=[0.5] * len(obs.hand.actuators), repeat=20, cameras=["box_a.bodies"])
        found["result"] = client.stop()
    world = sim.World("grasp", "softhand_skin", seed=1)
    world.step(base=palmares.twist((0.0, 0.0, -0.2), (0.0, 0.0, 0.0)), repeat=50)
    world.save_replay(folder / "run.mcap")
    batch = sim.Batch("grasp", "softhand", 2)
    batch.reset([1, 2])
    found |= {
        "world": world,
        "snapshot": world.snapshot(),
        "state": world.state(),
        "observation": world.observe(),
        "recording": sim.Recording(folder / "run.mcap"),
        "batch": batch,
        "stepped": batch.step(np.zeros((2, batch.action_len))),
        "states": batch.state(),
        "view": sim.View.looking((1.0, 0.0, 1.0), (0.0, 0.0, 0.0)),
        "identity": sim.identity(),
        "training": palmares.Training(),
        "hand": palmares.analysis.Hand("softhand"),
        "rest": palmares.analysis.Hand("softhand").rest([0.3]),
    }
    return {path: value for name, of in found.items() for path, value in parts(of, name)}


def test_no_repr_is_longer_than_a_few_lines(shown: dict[str, Any]) -> None:
    long = {path: len(repr(value)) for path, value in shown.items() if len(repr(value)) > LONGEST}
    assert not long
    kinds = {type(value).__name__ for value in shown.values()}
    wanted = {"Client", "Welcome", "Observation", "Truth", "Scene", "TaskInfo", "HandInfo", "Result", "World"}
    assert wanted | {"Batch", "Stepped", "State", "Recording", "Snapshot", "CameraImage", "Hand"} <= kinds


def test_every_message_and_every_result_has_a_short_repr() -> None:
    found = 0
    for module in (palmares.wire, palmares, sim, palmares.analysis, palmares.evaluate):
        for name in dir(module):
            kind = getattr(module, name)
            plain = isinstance(kind, type) and kind.__module__.startswith("palmares")
            if plain and (issubclass(kind, msgspec.Struct) or dataclasses.is_dataclass(kind)):
                found += 1
                small = ("Training", "Intrinsics", "Job")
                assert issubclass(kind, Brief | Viewed) or name in small, (module.__name__, name)
    assert found > 90


def test_print_shows_all_lines_and_notebooks_a_table_or_a_picture(shown: dict[str, Any]) -> None:
    obs = shown["obs"]
    assert repr(obs).splitlines()[0] == str(obs).splitlines()[0]
    count = len(str(obs).splitlines()) - len(repr(obs).splitlines()) + 1
    assert repr(obs).endswith(f"  … and {count} more lines: print() shows them")
    assert "ball_9" in str(obs)
    assert "ball_9" in obs._repr_html_()
    for path in ("world", "first._cameras[0]"):
        assert shown[path]._repr_png_().startswith(b"\x89PNG"), path


def test_a_brief_names_every_field_and_cuts_long_ones() -> None:
    class Found(Brief, msgspec.Struct):
        numbers: list[int]
        row: Any
        text: str
        data: bytes = b""

    found = Found(numbers=list(range(100)), row=np.zeros((3, 4)), text="a" * 100, data=b"12")
    assert repr(found) == f"Found(numbers=<100 of them>, row=<array 3×4>, text='{'a' * 58}…, data=<2 bytes>)"
    assert (
        repr(Found([1], np.zeros(()), "b")) == "Found(numbers=[1], row=<array ()>, text='b', data=<0 bytes>)"
    )


def test_the_description_of_a_hand_is_short_at_a_prompt_and_whole_in_print() -> None:
    hand = sim.describe_hand("softhand")
    assert repr(hand).startswith("<softhand: name, description, mass, links, ")
    assert len(repr(hand)) < 300
    assert str(hand) == str(dict(hand))
    assert json.loads(json.dumps(hand)) == hand
