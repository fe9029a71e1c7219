"""Control ticks per second on a machine with many cores, beside MuJoCo's `rollout` and mujoco_warp on a GPU.

    palmares-compare mjcf …                                                  # as in docs/report/throughput.md
    pip install 'mujoco>=4,<5' mujoco-warp
    python beside_gpu.py --mjcf FOLDER --json ../../docs/report/beside_gpu.json
    python beside_gpu.py --json ../../docs/report/beside_gpu.json --page ../../docs/report/throughput.md

The scenes are those of `throughput.py`. Without MuJoCo, mujoco_warp or a GPU it says so and leaves these rows
out. The file is written after every row, so that a stop loses only what is not measured yet. ``--page``
writes the section of the page from the file and measures nothing.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from record import fields, line, with_section
from throughput import SCENES, batch, rollout

TITLES = {True: "Beside a GPU", False: "On many cores"}
"""Sections of the page, by whether there was a GPU"""
HAND = "softhand"
SETTINGS = "stiff5"
WORLDS = 64
MANY = 512
WARP = {
    # Worlds and step, ms.
    "balls": [(4096, 1), (2048, 2), (8192, 2)],
    "air": [(8192, 2)],
    "shelf": [(2048, 2)],
    "grasp": [(2048, 2), (8192, 2)],
}
CONTACTS = 160
"""Contacts of a world that mujoco_warp has space for, in the mean over the worlds"""
ROWS = 600
"""Rows of constraints of a world that it has space for"""
NOTES = (
    "A control tick is 10 ms. Ours is ten steps of 1 ms in double precision, with the referee and the "
    "observation of every world; MuJoCo's is its steps alone, in double precision on the cores and in single "
    "precision on the GPU. A step of 2 ms is twice ours. The SoftHand opens and closes as in the tables "
    "above; the [report](README.md) says whether the settings hold an object."
)


def rate(block: Callable[[int], int], ticks: int, blocks: int) -> float:
    """Return the median rate of several blocks, ticks/s; one block before is not measured."""
    block(ticks)
    rates = []
    for _ in range(blocks):
        begun_s = time.perf_counter()
        rates.append(block(ticks) / (time.perf_counter() - begun_s))
    return statistics.median(rates)


def warp_block(folder: Path, worlds: int, step_ms: int) -> tuple[Callable[[int], int], Callable[[], str]]:
    """Return worlds of mujoco_warp under the set points of the scene, and what says which space they use."""
    import mujoco
    import mujoco_warp
    import warp

    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    model.opt.timestep = 1e-3 * step_ms
    drive = json.loads((folder / "drive.json").read_text())
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = drive["qpos"], drive["qvel"]
    mujoco.mj_forward(model, data)
    on_gpu = mujoco_warp.put_model(model)
    state = mujoco_warp.put_data(model, data, nworld=worlds, nconmax=CONTACTS, njmax=ROWS)
    rows = np.array(drive["ctrl"], dtype=np.float32)[::step_ms]
    ctrl = [warp.array(np.tile(row, (worlds, 1)), dtype=float) for row in rows]
    mujoco_warp.step(on_gpu, state)
    with warp.ScopedCapture() as capture:
        mujoco_warp.step(on_gpu, state)
    played = 0

    def block(ticks: int) -> int:
        nonlocal played
        for _ in range(ticks * (10 // step_ms)):
            warp.copy(state.ctrl, ctrl[played % len(ctrl)])
            warp.capture_launch(capture.graph)
            played += 1
        warp.synchronize()
        return worlds * ticks

    def used() -> str:
        contacts, most = int(state.nacon.numpy()[0]), int(state.nefc.numpy().max())
        if contacts > CONTACTS * worlds or most > ROWS:
            sys.exit(
                f"{folder.parent.name}: {contacts} contacts, {most} rows a world: the space is too small"
            )
        return f"{contacts / worlds:.0f} contacts in the mean, at most {most} rows"

    return block, used


def gpu() -> str | None:
    """Return the name of the GPU that mujoco_warp would use, or say why there is none."""
    for module in ("mujoco", "mujoco_warp", "warp"):
        if importlib.util.find_spec(module) is None:
            print(f"skipped: mujoco_warp on a GPU, since {module} is not installed", flush=True)
            return None
    import warp

    if not warp.is_cuda_available():
        print("skipped: mujoco_warp on a GPU, since there is none", flush=True)
        return None
    return str(warp.get_device("cuda:0").name)


class Measured:
    """Rows, written to a file as they come."""

    def __init__(self, file: Path, head: dict[str, Any]) -> None:
        self.file = file
        self.content = head | {"ours": {}, "rollout": {}, "warp": {}}

    def add(self, kind: str, scene: str, found: float, **row: Any) -> None:
        """Add a row."""
        row["ticks_per_s"] = round(found)
        self.content[kind].setdefault(scene, []).append(row)
        self.file.write_text(json.dumps(self.content, indent=1) + "\n")
        print(kind, scene, row, flush=True)


def measure(measured: Measured, mjcf: Path | None, ticks: int, blocks: int) -> None:
    """Measure all rows, first those of the cores."""
    cores = os.cpu_count() or 1
    threads = [count for count in (1, 2, 4, 8, 16, 32, 64) if count < cores] + [cores]
    for scene in SCENES:
        for worlds, count in [(WORLDS, count) for count in threads] + [(MANY, cores)]:
            row = batch(scene, HAND, worlds, count)
            measured.add("ours", scene, rate(row.block, ticks, blocks), worlds=worlds, threads=count)
    if mjcf is None or importlib.util.find_spec("mujoco") is None:
        print("skipped: MuJoCo, which is not installed or has no scenes (--mjcf)", flush=True)
        return
    for scene in SCENES:
        for step_ms in (1, 2):
            row = rollout(mjcf / scene / SETTINGS, MANY, cores, step_ms)
            found = rate(row.block, ticks, blocks)
            measured.add("rollout", scene, found, worlds=MANY, threads=cores, step_ms=step_ms)
    if measured.content["gpu"] is None:
        return
    for scene, plans in WARP.items():
        for worlds, step_ms in plans:
            begun_s = time.perf_counter()
            block, used = warp_block(mjcf / scene / SETTINGS, worlds, step_ms)
            prepared_s = round(time.perf_counter() - begun_s)
            found = rate(block, ticks // 2, blocks)
            measured.add(
                "warp", scene, found, worlds=worlds, step_ms=step_ms, prepared_s=prepared_s, used=used()
            )


def versions() -> dict[str, str]:
    """Return the versions of what is installed."""
    found = {}
    for name in ("palmares", "mujoco", "mujoco-warp", "warp-lang", "numpy"):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def driver() -> str | None:
    """Return the version of the GPU's driver."""
    query = ["nvidia-smi", "--query-gpu=driver_version", "--format=csv,noheader"]
    try:
        return subprocess.run(query, capture_output=True, text=True, check=True).stdout.split()[0]
    except (OSError, subprocess.CalledProcessError, IndexError):
        return None


def section(content: dict[str, Any]) -> str:
    """Return the section of the page."""
    scenes = list(content["ours"])
    plans: dict[str, dict[str, int]] = {}
    for kind in ("ours", "rollout", "warp"):
        for scene, rows in content[kind].items():
            for row in rows:
                plans.setdefault(label(kind, row), {})[scene] = row["ticks_per_s"]
    lines = [f"| way | {' | '.join(scenes)} |", "|---" * (len(scenes) + 1) + "|"]
    for name, rates in plans.items():
        cells = [f"{rates[scene]:,}" if scene in rates else "" for scene in scenes]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    parts = [line(content), " ".join([NOTES, content["how"]]), "Control ticks per second:", "\n".join(lines)]
    if sessions := content.get("sessions"):
        parts += [sessions["how"], "\n".join(lateness(sessions["sent_after_due_ms"]))]
    return "\n\n".join(parts)


def label(kind: str, row: dict[str, Any]) -> str:
    """Return the words for a row."""
    worlds = f", {row['worlds']} worlds" if row.get("worlds") else ""
    if kind == "warp":
        return f"mujoco_warp on the GPU, `{SETTINGS}`, {row['step_ms']} ms{worlds}"
    threads = f", {row['threads']} thread{'s' if row['threads'] > 1 else ''}"
    if kind == "rollout":
        return f"MuJoCo's `rollout`, `{SETTINGS}`, {row['step_ms']} ms{worlds}{threads}"
    return f"`Batch`{worlds}{threads}"


def lateness(sessions: dict[str, dict[str, float]]) -> list[str]:
    """Return the table of realtime sessions."""
    head = ["| sessions | median, ms | 99 %, ms | most, ms |", "|---|---|---|---|"]
    return head + [f"| {n} | {ms['p50']:g} | {ms['p99']:g} | {ms['max']:g} |" for n, ms in sessions.items()]


def main() -> None:
    """Measure into the file, or write the page from it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", type=Path, required=True, metavar="FILE", help="file of the rows")
    parser.add_argument("--page", type=Path, help="write the section of this page from the file")
    parser.add_argument(
        "--mjcf", type=Path, metavar="FOLDER", help="scenes for MuJoCo: folders SCENE/SETTINGS"
    )
    parser.add_argument("--ticks", type=int, default=25, help="ticks of each world in a block")
    parser.add_argument("--blocks", type=int, default=3)
    parser.add_argument("--commit", help="the commit of the engine, where there is no repository")
    args = parser.parse_args()
    if args.page:
        content = json.loads(args.json.read_text())
        args.page.write_text(
            with_section(args.page.read_text(), TITLES[bool(content["warp"])], section(content))
        )
        return
    record = fields("throughput")
    if args.commit:
        record["commit"] = args.commit
    found = gpu()
    if found:
        record["machine"]["gpu"] = found
    named = ", ".join(f"{name} {version}" for name, version in versions().items())
    how = (
        f"A row is the median of {args.blocks} blocks of {args.ticks} ticks ({args.ticks // 2} on the GPU), "
        f"one row after the other. {named}; driver {driver() or 'none'}."
    )
    measure(Measured(args.json, record | {"gpu": found, "how": how}), args.mjcf, args.ticks, args.blocks)


if __name__ == "__main__":
    main()
