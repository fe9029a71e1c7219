"""Control ticks per second of many worlds in one process, and the share of Python and observations.

    python throughput.py

A control tick is 10 ms: ten steps of the physics, the referee, and an observation of every world as arrays.
In the air the hands open and close at their start; among the objects they first go down into them. Each row
is the median of several blocks, which alternate with those of all other rows of the scene, quartiles in
brackets. ``--server`` starts a server and adds rows for it and for `AsyncVectorEnv` on it. ``--mjcf`` adds
the `rollout` of MuJoCo with as many worlds of the same scene, which ``palmares-compare mjcf`` writes.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from record import fields, line

import palmares
import palmares.gym
from palmares import Training
from palmares.outputs import output_file
from palmares.server import Server
from palmares.sim import Batch

SCENES = {
    # Task, speed down (m/s) and ticks of this motion.
    "air": ("balls", 0.0, 0),
    "balls": ("balls", -0.5, 110),
    "shelf": ("shelf", 0.0, 0),
    "grasp": ("grasp", -0.3, 60),
}
# Ticks between opening and closing.
MOVE = 25
# A block has as many ticks as fit into this time, s, but not fewer than those of the warm-up.
BLOCK_S = 1.0
WARM_UP = 5
ABOUT = """\
`client-py/benchmarks/throughput.py` measured these rows. A control tick is 10 ms: ten steps of the physics,
the referee, and an observation of every world as arrays. In the air the hands open and close at their start;
among the objects they first go down into them. A row is the median of several blocks, which alternate with
those of all other rows of the scene, quartiles in brackets. MuJoCo's `rollout` steps as many worlds of the
same scene, a block in a call, without referee and observation, with the settings of the [report](README.md),
which says what these can do, and with objects that sleep."""


@dataclass
class Row:
    """A way to play, and the outcomes of its blocks."""

    name: str
    block: Callable[[int], int]
    """Plays a number of ticks of each of its worlds; returns the sum of all ticks"""
    physics_s: Callable[[], float] = field(default=lambda: 0.0)
    """Time of physics and referee up to now, all threads together, s"""
    threads: int = 1
    rates: list[float] = field(default_factory=list)
    micros: list[float] = field(default_factory=list)
    extra: list[float] = field(default_factory=list)
    """Time outside the physics, relative to it"""

    def ticks(self, most: int) -> int:
        """Return the number of ticks of a block, after a warm-up."""
        begun_s = time.perf_counter()
        self.block(WARM_UP)
        fit = BLOCK_S * WARM_UP / (time.perf_counter() - begun_s)
        return min(most, max(WARM_UP, round(fit)))

    def play(self, ticks: int) -> None:
        """Play a block."""
        before_s, begun_s = self.physics_s(), time.perf_counter()
        played = self.block(ticks)
        wall_s = time.perf_counter() - begun_s
        self.rates.append(played / wall_s)
        self.micros.append(1e6 * wall_s / played)
        if (physics_s := self.physics_s() - before_s) > 0.0:
            self.extra.append(self.threads * wall_s / physics_s - 1.0)


def action(motors: int, tick: int, down: float = 0.0) -> np.ndarray[Any, Any]:
    """Return a world's action (6 + motors,): the motors open and close."""
    sigma = 0.6 if tick // MOVE % 2 else 0.1
    return np.array([0.0, 0.0, down, 0.0, 0.0, 0.0] + [sigma] * motors)


def batch(scene: str, hand: str, count: int, threads: int, step_ms: float | None = None) -> Row:
    """Return worlds in a `Batch`."""
    task, down, lead_in = SCENES[scene]
    worlds = Batch(task, hand, count, threads=threads, training=Training(step_ms=step_ms))
    motors = worlds.action_len - 6
    worlds.reset(range(1, count + 1))
    if lead_in:
        worlds.step(np.tile(action(motors, 0, down), (count, 1)), lead_in)

    played = itertools.count()

    def block(ticks: int) -> int:
        for tick in itertools.islice(played, ticks):
            worlds.step(np.tile(action(motors, tick), (count, 1)), 1)
        return count * ticks

    name = f"`Batch`, {count} worlds, {threads} thread{'s' if threads > 1 else ''}"
    if step_ms is not None:
        name += f", steps of {step_ms:g} ms"
    return Row(name, block, lambda: worlds.physics_s, threads)


def socket(url: str, scene: str, hand: str) -> Row:
    """Return one run on a server."""
    task, down, lead_in = SCENES[scene]
    client = palmares.Client(url)
    motors = len(client.welcome.hand(hand).motors)
    client.reset(task, hand, seed=1)
    if lead_in:
        falling = palmares.twist([0, 0, down], [0, 0, 0])
        for _ in range(lead_in // 10):
            client.step(base=falling, hand=[0.1] * motors, repeat=10)
    still = palmares.twist([0.0] * 3, [0.0] * 3)

    played = itertools.count()

    def block(ticks: int) -> int:
        for tick in itertools.islice(played, ticks):
            client.step(base=still, hand=action(motors, tick)[6:])
        return ticks

    return Row("one `Client` on a server", block)


def asynchronous(url: str | None, scene: str, hand: str, count: int) -> Row:
    """Return `AsyncVectorEnv` of environments on a server, or each in a process of its own."""
    task, down, lead_in = SCENES[scene]
    words = {"softhand": "SoftHand", "reflex": "ReFlex"}
    options: dict[str, Any] = {"url": url} if url else {}
    envs = gymnasium.make_vec(
        f"palmares.gym:palmares/{task.title()}-{words[hand]}-v1",
        num_envs=count,
        vectorization_mode="async",
        ticks=1,
        **options,
    )
    envs.reset(seed=1)
    space: Any = envs.single_action_space
    motors = space.shape[0] - 6

    def act(tick: int, speed: float) -> np.ndarray[Any, Any]:
        flat = action(motors, tick, speed / 1.5)
        flat[6:] = 2.0 * flat[6:] - 1.0
        return np.tile(flat, (count, 1))

    for _ in range(lead_in):
        envs.step(act(0, down))

    played = itertools.count()

    def block(ticks: int) -> int:
        for tick in itertools.islice(played, ticks):
            envs.step(act(tick, 0.0))
        return count * ticks

    where = "on a server" if url else "in its processes"
    return Row(f"`AsyncVectorEnv`, {count} environments {where}", block)


def rollout(folder: Path, count: int, threads: int, step_ms: int) -> Row:
    """Return worlds in MuJoCo, all from one state, under the same set points."""
    import mujoco
    from mujoco.rollout import Rollout

    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    model.opt.timestep = 1e-3 * step_ms
    drive = json.loads((folder / "drive.json").read_text())
    ctrl = np.array(drive["ctrl"])[::step_ms]
    state = np.concatenate([[0.0], drive["qpos"], drive["qvel"]])
    assert len(state) == mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    states = np.tile(state, (count, 1))
    steps = 10 // step_ms
    pool = Rollout(nthread=threads if threads > 1 else 0)
    data = [mujoco.MjData(model) for _ in range(threads)]
    played = 0

    def block(ticks: int) -> int:
        nonlocal states, played
        rows = ctrl[np.arange(played * steps, (played + ticks) * steps) % len(ctrl)]
        # One call, in which the solver starts warm and objects may sleep.
        after, _ = pool.rollout(model, data, states, np.tile(rows, (count, 1, 1)), nstep=len(rows))
        states = after[:, -1]
        played += ticks
        return count * ticks

    name = f"MuJoCo's `rollout`, `{folder.name}`, {step_ms} ms, {count} worlds, {threads} thread"
    return Row(name + ("s" if threads > 1 else ""), block)


def versions_here() -> str:
    """Return the versions of this measurement."""
    versions = [f"{name} {metadata.version(name)}" for name in ("gymnasium", "numpy")]
    try:
        versions.append(f"mujoco {metadata.version('mujoco')}")
    except metadata.PackageNotFoundError:
        versions.append("without MuJoCo")
    return f"palmares {palmares.__version__}, {', '.join(versions)}."


def quartiles(values: list[float], form: str) -> str:
    """Return the median and, in brackets, the quartiles."""
    low, median, high = statistics.quantiles(values, n=4)
    return f"{median:{form}} ({low:{form}} to {high:{form}})"


def table(scene: str, hand: str, args: argparse.Namespace, url: str | None) -> str:
    """Measure a scene with a hand; print and return its table."""
    rows = [batch(scene, hand, args.worlds, threads) for threads in (1, 2)]
    rows += [batch(scene, hand, args.worlds, threads, ms) for ms in (2.0, 4.0) for threads in (1, 2)]
    rows.append(asynchronous(None, scene, hand, 2))
    if url:
        rows += [socket(url, scene, hand), asynchronous(url, scene, hand, 2)]
    if args.mjcf and hand == "softhand":
        for folder in sorted((args.mjcf / scene).glob("*")):
            rows += [rollout(folder, args.worlds, n, ms) for ms in (1, 2) for n in (1, 2)]
    blocks = [(row, row.ticks(args.ticks)) for row in rows]
    for _ in range(args.blocks):
        for row, ticks in blocks:
            row.play(ticks)
    lines = [f"## {scene}, {hand}\n"]
    lines += ["| way | control ticks/s | µs a tick | outside the physics |", "|---|---|---|---|"]
    for row in rows:
        extra = quartiles(row.extra, "+.1%") if row.extra else ""
        lines.append(
            f"| {row.name} | {quartiles(row.rates, ',.0f')} | {quartiles(row.micros, '.1f')} | {extra} |"
        )
    one, two = (row.rates for row in rows[:2])
    gain = [b / a for a, b in zip(one, two, strict=True)]
    lines.append(f"\nTwo threads: {quartiles(gain, '.2f')} times one.\n")
    text = "\n".join(lines)
    print(text, flush=True)
    return text


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--server", action="store_true", help="measure a server, too")
    parser.add_argument("--output", type=output_file, metavar="PAGE", help="write the tables into a page")
    parser.add_argument(
        "--mjcf",
        type=Path,
        metavar="FOLDER",
        help="scenes for MuJoCo: folders SCENE/SETTINGS, each by `palmares-compare mjcf --out`",
    )
    parser.add_argument("--worlds", type=int, default=64)
    parser.add_argument("--blocks", type=int, default=7)
    parser.add_argument("--ticks", type=int, default=50, help="most ticks of each world in a block")
    parser.add_argument("--hand", action="append", choices=["softhand", "reflex"])
    parser.add_argument("--scene", action="append", choices=[*SCENES])
    args = parser.parse_args()
    head = f"# Throughput\n\n{line(fields('throughput'))}\n\n{ABOUT}\n\n{versions_here()}\n"
    with contextlib.ExitStack() as stack:
        url = None
        if args.server:
            url = stack.enter_context(Server(Path(stack.enter_context(tempfile.TemporaryDirectory())))).url
        hands, scenes = args.hand or ["softhand", "reflex"], args.scene or SCENES
        tables = [table(scene, hand, args, url) for hand in hands for scene in scenes]
    if args.output:
        args.output.write_text("\n".join([head, *tables]))


if __name__ == "__main__":
    try:
        main()
    except palmares.PalmaresError as error:
        sys.exit(str(error))
