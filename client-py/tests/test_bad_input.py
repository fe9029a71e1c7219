"""Bad input to the engine: an exception, never a panic, and no change of the state.

`PALMARES_EXAMPLES=10000 pytest tests/test_bad_input.py` tries many, others every time.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import palmares
from palmares.training import QUANTITIES

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

pytestmark = pytest.mark.filterwarnings("ignore")

EXAMPLES = os.environ.get("PALMARES_EXAMPLES")
settings.register_profile(
    "palmares",
    max_examples=int(EXAMPLES or 60),
    derandomize=EXAMPLES is None,
    database=None,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
settings.load_profile("palmares")

# A panic of the compiled part is neither one of these nor an `Exception`.
REFUSED = (ValueError, TypeError, OverflowError, palmares.PalmaresError)
HANDS = Path(__file__).parents[2] / "models/hands"
TASKS = Path(__file__).parents[2] / "tasks"

numbers = st.one_of(
    st.floats(),
    st.integers(),
    st.sampled_from([0.0, -0.0, 5e-324, 1e308, float("nan"), float("inf"), 2**63, -1]),
)
odd = st.recursive(
    st.one_of(
        st.none(), st.booleans(), numbers, st.text(max_size=8), st.binary(max_size=8), st.complex_numbers()
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=8), st.dictionaries(st.text(max_size=4), inner, max_size=3)
    ),
    max_leaves=10,
)
arrays = hnp.arrays(
    st.one_of(hnp.floating_dtypes(), hnp.integer_dtypes(), hnp.boolean_dtypes(), hnp.complex_number_dtypes()),
    hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=8),
)
anything = st.one_of(odd, arrays)
# Actions of the right shape, mostly finite, which reach the engine itself.
actions = hnp.arrays(np.float64, (2, 8), elements=st.floats(allow_nan=False, allow_infinity=False))
GRASP = sim.World("grasp", "pinch", 1)
SNAPSHOT = bytes(GRASP.snapshot())


@pytest.fixture(scope="module")
def world() -> Any:
    made = sim.World("grasp", "pinch", 1)
    made.step(hand=[0.2, 0.2], repeat=5)
    return made


@pytest.fixture(scope="module")
def batch() -> Any:
    made = sim.Batch("grasp", "pinch", 2)
    made.reset([1, 2])
    return made


@contextlib.contextmanager
def refused_or_done(thing: Any) -> Iterator[None]:
    """Expect the block to succeed, or to be refused without a change."""
    hashes = getattr(thing, "state_hashes", None) or thing.state_hash
    before, kept = hashes(), thing.snapshot(*([0] if hasattr(thing, "count") else []))
    try:
        yield
    except REFUSED:
        assert hashes() == before
    else:
        # The world can continue and be restored.
        thing.restore(*([0, kept] if hasattr(thing, "count") else [kept]))


@given(anything, anything, st.one_of(st.integers(-(2**70), 30), st.integers(2**32, 2**70), odd))
def test_actions_of_a_world(world: Any, base: Any, hand: Any, repeat: Any) -> None:
    with refused_or_done(world):
        world.step(base, hand, repeat)


@given(numbers, numbers, st.sampled_from(["pose", "twist"]))
def test_numbers_of_a_world(world: Any, one: Any, two: Any, kind: str) -> None:
    with refused_or_done(world):
        if kind == "pose":
            base = palmares.pose([one, 0.0, two], [two, 0.0, one, 1.0])
        else:
            base = palmares.twist([one, two, 0.0], [0.0, one, two])
        world.step(base, [two, one], 3)


@given(
    anything,
    st.one_of(st.integers(-(2**70), 30), st.integers(2**32, 2**70), odd),
    st.one_of(st.none(), anything),
)
def test_actions_of_a_batch(batch: Any, action: Any, ticks: Any, mask: Any) -> None:
    with refused_or_done(batch):
        batch.step(action, ticks, mask)


@given(actions)
def test_finite_actions_of_a_batch(batch: Any, action: Any) -> None:
    batch.reset([1, 2])
    batch.step(action, 3)
    batch.reset([1, 2])


@given(anything, st.one_of(st.none(), anything))
def test_seeds_of_a_batch(batch: Any, seeds: Any, mask: Any) -> None:
    with contextlib.suppress(*REFUSED):
        batch.reset(seeds, mask)
    batch.reset([1, 2])


@given(st.one_of(st.just("grasp"), odd), st.one_of(st.just("pinch"), odd), odd, odd, odd)
def test_arguments_of_a_world(task: Any, hand: Any, seed: Any, sensing: Any, noise: Any) -> None:
    with contextlib.suppress(*REFUSED):
        sim.World(task, hand, seed, sensing=sensing, noise=noise)


@given(st.one_of(st.integers(-(2**70), 3), st.integers(100_001, 2**70), odd), odd)
def test_arguments_of_a_batch(count: Any, threads: Any) -> None:
    with contextlib.suppress(*REFUSED):
        sim.Batch("grasp", "pinch", count, threads=threads)


@given(odd, anything, anything, st.one_of(numbers, odd))
@example("palm", [1e308] * 3, [1e308] * 3, 1.0)
@example("palm", [1e6, 0.0, 0.0], [0.0, 0.0, 1e6], 1.0)
def test_pushes(world: Any, link: Any, force: Any, torque: Any, duration_s: Any) -> None:
    with refused_or_done(world):
        world.perturb(link, force, torque, duration_s)
        world.step(repeat=5)


@given(st.one_of(st.integers(-2, 2), odd), anything, anything, st.one_of(numbers, odd))
@example(0, [1e308] * 3, [1e308] * 3, 1.0)
@example(0, [200.0, 0.0, 0.0], [0.0, 0.0, 20.0], 60.0)
def test_pushes_on_objects(world: Any, index: Any, force: Any, torque: Any, duration_s: Any) -> None:
    with refused_or_done(world):
        world.push_object(index, force, torque, duration_s)
        world.step(repeat=5)


@given(st.lists(st.text(max_size=12), max_size=3))
def test_cameras(world: Any, cameras: list[str]) -> None:
    with refused_or_done(world):
        world.observe(cameras=cameras)


@given(st.binary(max_size=200))
def test_bytes_as_requests(world: Any, request: bytes) -> None:
    world._native.answer(request)


@given(st.binary(max_size=400))
def test_bytes_as_snapshots(world: Any, batch: Any, data: bytes) -> None:
    for thing in ((world,), (batch, 0)):
        with refused_or_done(thing[0]), pytest.raises(ValueError, match="snapshot"):
            thing[0].restore(*thing[1:], data)


@given(st.data())
def test_broken_snapshots(world: Any, data: st.DataObject) -> None:
    # The digest detects damage, but not forgery.
    broken = bytearray(SNAPSHOT)
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(broken) - 1))
        kind = data.draw(st.sampled_from(["flip", "cut", "insert", "fill"]))
        if kind == "flip":
            broken[at] ^= 1 << data.draw(st.integers(0, 7))
        elif kind == "cut":
            del broken[at : at + data.draw(st.integers(1, 64))]
        elif kind == "insert":
            broken[at:at] = data.draw(st.binary(min_size=1, max_size=64))
        else:
            broken[at : at + 8] = np.array(data.draw(st.floats())).tobytes()
        if not broken:
            break
    if bytes(broken) == SNAPSHOT:
        return
    with refused_or_done(world):
        world.restore(bytes(broken))
        world.step(repeat=3)
        world.result()


def broken(data: st.DataObject, text: bytes) -> bytes:
    """Return a text with up to three pieces replaced."""
    found = bytearray(text)
    for _ in range(data.draw(st.integers(0, 3))):
        at = data.draw(st.integers(0, len(found) - 1))
        words = [b"1e308", b"nan", b"-1", b"0", b"inf", b"[", b">", b"", b"1e-320", b"9" * 20, b'"', b"true"]
        found[at : at + data.draw(st.integers(0, 12))] = data.draw(
            st.one_of(st.binary(max_size=6), st.sampled_from(words))
        )
    return bytes(found)


@given(st.data())
def test_broken_hands(data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as name:
        for file in ("hand.urdf", "hand.toml"):
            Path(name, file).write_bytes(broken(data, (HANDS / "pinch" / file).read_bytes()))
        with contextlib.suppress(*REFUSED):
            world = sim.World("grasp", name, 1)
            world.step(hand=[0.5] * len(world.observe().hand.actuators), repeat=3)


@given(st.data())
def test_broken_tasks(data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as name:
        Path(name, "task.toml").write_bytes(broken(data, (TASKS / "grasp/task.toml").read_bytes()))
        with contextlib.suppress(*REFUSED):
            sim.World(name, "pinch", 1).step(hand=[0.5, 0.5], repeat=3)


@given(odd, odd, st.one_of(st.booleans(), st.lists(st.sampled_from(QUANTITIES)), odd), odd)
def test_training_options(shaping: Any, discount: Any, randomise: Any, fraction: Any) -> None:
    with contextlib.suppress(*REFUSED):
        training = palmares.Training(shaping, discount, randomise, fraction)
        sim.World("balls", "pinch", 1, training=training).step(repeat=2)


@given(st.binary(max_size=300), st.sampled_from([".zip", ".urdf", ".toml", ".tar.gz", ""]))
def test_bytes_as_hands(data: bytes, suffix: str) -> None:
    with tempfile.NamedTemporaryFile(suffix=suffix) as file:
        file.write(data)
        file.flush()
        with pytest.raises(ValueError, match="hand: "):
            sim.describe_hand(file.name)


def test_a_list_of_hands_is_refused_with_the_remedy() -> None:
    with pytest.raises(ValueError, match=r"found .*; wanted one name or path: .* make a Batch for each hand"):
        sim.Batch("grasp", ["softhand", "reflex"], 2)
    with pytest.raises(ValueError, match=r"task: found \['grasp'\]; wanted one name or path"):
        sim.World(["grasp"], "softhand")
    assert sim.Batch("grasp", "softhand", 1).count == 1


def test_a_second_thread_gets_an_error() -> None:
    batch = sim.Batch("grasp", "softhand", 4, threads=1)
    batch.reset(range(4))
    first = threading.Thread(target=lambda: batch.step(np.zeros((4, 7)), 500))
    first.start()
    refused = ""
    while first.is_alive() and not refused:
        try:
            batch.step(np.zeros((4, 7)), 1)
        except RuntimeError as error:
            refused = str(error)
    first.join()
    assert "another thread is in a call of this batch: use it from one thread at a time" in refused
