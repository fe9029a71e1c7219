"""Play every grip of the cookbook, and write docs/cookbook.md and its pictures.

    python cookbook.py                                  plays all, five scenes each; exit code 1 if one fails
    python cookbook.py --hands softhand --kinds ball    plays these
    python cookbook.py --write                          also writes the document and the pictures

An object is lifted if its centre of mass is 50 mm higher than at the start, one second after the lift.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import re
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

import palmares
from palmares.arrays import Array, array
from palmares.png import png
from palmares.rotation import matrix_of, rot_z
from palmares.scene import ScenePart
from palmares.sim import View, World
from palmares.skills.cookbook import COOKBOOK, KINDS, Grip, GripMover, most_room, pick, target_of
from palmares.skills.motion import UP, RunOverError
from palmares.skills.objects import ObjectBounds, half_extents, truth_of

Picture = NDArray[np.uint8]
ROOT = Path(__file__).resolve().parents[2]
DOCUMENT = ROOT / "docs/cookbook.md"
PICTURES = ROOT / "docs/pictures/cookbook"
SEEDS = (1, 2, 3, 4, 5)
LIFTED_M = 0.05
TILE = (160, 120)
"""Width and height of a picture"""
ACROSS = 5
"""Grips side by side"""
ALIKE = {"softhand_skin": "softhand", "softhand_strong": "softhand"}
"""Hands whose grips are those of another"""

BALL = """
[[objects.own]]
name = "ball"
source = "the ball of the task balls"
parts = [{ shape = "sphere", radius = 0.05 }]
mass = 0.216
friction = 0.7
rolling_friction = 0.001
torsional_friction = 0.001
color = [0.84, 0.30, 0.25]
"""
REFERENCE = {
    "ball": "ball",
    "bottle": "006_mustard_bottle",
    "box": "061_foam_brick",
    "cylinder": "005_tomato_soup_can",
    "handle": "pan",
    "plate": "029_plate",
}
"""Objects alone on the table of the task grasp; the others are played in their task"""
IN_TASK = {"ball_in_box": "balls", "knob": "pan", "peg": "peg"}
WORDS = {
    "ball": "ball of 100 mm, 216 g, on a table",
    "ball_in_box": "the same among nine others in a box: task balls",
    "bottle": "mustard bottle, 94 × 58 × 190 mm, 603 g",
    "box": "foam brick, 75 × 50 × 50 mm, 28 g",
    "cylinder": "soup can, 66 × 101 mm, 349 g, upright",
    "handle": "handle of the pan, 24 mm thick, 60 mm high, pan of 950 g without its lid",
    "knob": "knob of the lid, 50 mm, lid of 652 g on its pan: task pan",
    "peg": "peg, 40 × 200 mm, 170 g, upright: task peg",
    "plate": "rim of a plate of 258 mm, 30 mm high, 279 g",
}


def task_of(kind: str, folder: Path) -> str:
    """Return the task in which a kind is grasped; one with a single object is written into `folder`."""
    if kind in IN_TASK:
        return IN_TASK[kind]
    own = {"ball": BALL, "handle": _pan()}.get(kind, "")
    text = (ROOT / "tasks/grasp/task.toml").read_text()
    changes = [
        (r'^name = "grasp"', f'name = "cookbook-{kind}"'),
        (r"from = \[[^\]]*\]", f'from = ["{REFERENCE[kind]}"]'),
        (r"^\[place.scatter\]", f"{own}\n[place.scatter]"),
        (
            r"min = \[-0.12, -0.12, 0.0\]\nmax = \[0.12, 0.12, 0.4\]",
            "min = [-0.25, -0.25, 0.0]\nmax = [0.25, 0.25, 0.4]",
        ),
    ]
    for old, new in changes if kind in ("plate", "handle") else changes[:3]:
        text, count = re.subn(old, new, text, flags=re.MULTILINE)
        if count != 1:
            sys.exit(f"tasks/grasp/task.toml has changed: {count} times {old!r}")
    place = folder / kind
    place.mkdir(exist_ok=True)
    (place / "task.toml").write_text(text)
    return str(place)


def _pan() -> str:
    found = re.search(
        r'\[\[objects.own\]\]\nname = "pan".*?\n\]\n', (ROOT / "tasks/pan/task.toml").read_text(), re.DOTALL
    )
    if found is None:
        sys.exit("tasks/pan/task.toml has changed: its pan is looked for by its text")
    return "\n" + found[0]


@dataclass(frozen=True)
class Lift:
    """The result of a grip in a scene."""

    hand: str
    kind: str
    seed: int
    risen_m: float
    """Rise of the object's centre of mass"""
    reach_m: float
    """Reach of the fingers below the middle of the object, when they begin to close; negative above it"""

    @property
    def lifted(self) -> bool:
        """Whether the object was lifted."""
        return self.risen_m >= LIFTED_M


def target_in(client: palmares.Client, mover: GripMover, kind: str, grip: Grip) -> tuple[ObjectBounds, float]:
    """Return what is grasped in a scene, and its direction."""
    if kind != "ball_in_box":
        return target_of(client.scene, mover.obs, kind)
    chosen = most_room(client.scene, mover.obs, grip, client.scene.region("box_a"))
    assert chosen is not None
    return chosen


def lift(
    client: palmares.Client, task: str, hand: str, kind: str, seed: int, shots: list[Picture] | None = None
) -> Lift:
    """Play a grip; append pictures of the hand before closing and after the lift to `shots`."""
    grip = COOKBOOK[hand][kind]
    mover = Watched(client, client.reset(task, hand, seed=seed))
    target, yaw_rad = target_in(client, mover, kind, grip)
    height_m = truth_of(mover.obs).positions[target.index, 2]
    reach_m = 0.0
    # A long lift shakes an object that was held for two seconds, and the run is then over.
    with contextlib.suppress(RunOverError):
        pick(mover, grip, target, yaw_rad)
        mover.wait(1.0)
    risen_m = float(truth_of(mover.obs).positions[target.index, 2] - height_m)
    if mover.lowest_m is not None:
        reach_m = float(target.middle[2]) - mover.lowest_m
    if shots is not None:
        for world, middle in (
            (mover.closing, target.middle),
            (client.world, target.middle + grip.lift_m * UP),
        ):
            assert world is not None
            shots.append(shot(world, middle, yaw_rad, from_above=kind == "ball_in_box"))
    client.abandon()
    return Lift(hand, kind, seed, risen_m, reach_m)


class Watched(GripMover):
    """Keeps a copy of the world, and the height of the lowest finger, when the fingers begin to close."""

    closing: World | None = None
    lowest_m: float | None = None

    def _step(self) -> None:
        super()._step()
        world = self.client.world
        if self.closing is None and world is not None and self.sigma > 0.0:
            self.closing = world.fork()
            self.lowest_m = lowest(world, self.client.describe_hand(self.client.run.hand))


def lowest(world: World, hand: dict[str, Any]) -> float:
    """Return the height of the lowest point of the hand's moving links, m."""
    heights = []
    for link, at in zip(hand["links"], world.mechanics("links")["links"], strict=True):
        if link["coordinate"] is None:
            continue
        parts = msgspec.convert(link["shapes"], list[ScenePart])
        for part in parts:
            up = (matrix_of(at[3:]) @ matrix_of(part.quat_xyzw))[2]
            middle = at[2] + matrix_of(at[3:])[2] @ part.xyz
            shape = part.shape
            if shape.points is not None:
                heights.append(middle + (array(shape.points, -1, 3) @ up).min() - shape.rounding)
            else:
                half = half_extents(shape, np.vstack([np.zeros((2, 3)), up]))[2]
                heights.append(middle - half)
    return float(min(heights))


def shot(world: World, middle: Array, yaw_rad: float, from_above: bool = False) -> Picture:
    """Return a picture of the hand at an object, (height, width, 3), uint8."""
    eye = middle + rot_z(yaw_rad) @ array([0.2, -0.2, 0.55] if from_above else [0.42, -0.42, 0.30])
    view = View.looking(eye.tolist(), (middle + 0.04 * UP).tolist(), fov_deg=52.0)
    return world.pictures(view, TILE, "rgb")["rgb"]


def sheet(shots: Sequence[Picture]) -> Picture:
    """Return one picture: two rows for every `ACROSS` grips, before closing above, after the lift below."""
    bands: list[Picture] = []
    for first in range(0, len(shots), 2 * ACROSS):
        band = [*shots[first : first + 2 * ACROSS]]
        band += [np.full_like(shots[0], 255)] * (2 * ACROSS - len(band))
        bands += [np.concatenate(band[row::2], axis=1) for row in (0, 1)]
    return np.concatenate(bands)


def numbers(hand: str, kind: str, folder: Path) -> list[str]:
    """Return the cells of a grip that follow from the cookbook: orientation, place, motors, times."""
    grip = COOKBOOK[hand][kind]
    with palmares.Client("local") as client:
        mover = GripMover(client, client.reset(task_of(kind, folder), hand, seed=SEEDS[0]))
        target, _ = target_in(client, mover, kind, grip)
    x, y, z = 1e3 * grip.in_hand(target)
    columns = grip.rotation(0.0).T
    down, along = columns @ -UP, columns @ array([1.0, 0.0, 0.0])
    return [
        f"({x:.0f}, {y:.0f}, {z:.0f})",
        _vector(down),
        _vector(along),
        _motors(grip.opened),
        _motors(grip.closed),
        f"{grip.close_s:g}",
        f"{1e3 * grip.lift_m:.0f} in {grip.lift_s:g} s",
    ]


def _vector(of: Array) -> str:
    return "(" + ", ".join(f"{x + 0.0:.2f}".replace("-0.00", "0.00") for x in of) + ")"


def _motors(sigma: Sequence[float]) -> str:
    return " ".join(f"{x:.2f}".rstrip("0").rstrip(".") for x in sigma)


HEAD = """\
# Cookbook: how each hand grasps

Grips of every built-in hand, in numbers. In Python the first lines of [teams.md](teams.md#grasp-and-lift)
play them: `COOKBOOK["softhand"]["ball"]` is a grip, `pick` plays it. In any language, with the object's
middle at o and its longer side at the angle ψ from x:

1. *down* and *along* are the world's down and the world's x in the hand frame, for ψ = 0. So the rows of
   R are *along*, *along* × *down* and −*down*. Turn R by ψ about the vertical: R ← rot_z(ψ) R.
2. Move the base to o − R p + (0, 0, 0.12 m) with the motors at σ *open*; p is *object in the hand*. Then
   move it to o − R p.
3. Move the motors to σ *closed* in the time *close*, as a smooth ramp, and wait 0.3 s.
4. Lift.

A grip of `ball_in_box` comes down from 0.32 m, and needs a ball and an angle with room for the hand:
`most_room` finds them. The peg of the SoftHand is grasped from the side: `SideGrasp` has its way in.
`softhand_skin` and `softhand_strong` have the grips of `softhand`.

*lifted*: scenes of {count} in which the object's centre of mass is 50 mm higher one second after the lift.
*reach*: distance of the lowest finger below the middle of the object when the fingers begin to close.
Lengths are in mm, times in s.

| kind | object |
|---|---|
"""
FOOT = """
---

`client-py/benchmarks/cookbook.py --write` writes this page from `palmares.skills.cookbook`; do not edit it.
Engine {engine}.
"""
COLUMNS = (
    "kind",
    "object in the hand",
    "down",
    "along",
    "σ open",
    "σ closed",
    "close",
    "lift",
    "reach",
    "lifted",
)


def page(lifts: Sequence[Lift], folder: Path) -> str:
    """Return the text of the document."""
    engine = palmares.sim.identity().engine
    text = HEAD.format(count=len(SEEDS))
    text += "".join(f"| `{kind}` | {WORDS[kind]} |\n" for kind in KINDS)
    for hand, grips in COOKBOOK.items():
        if hand in ALIKE:
            continue
        text += (
            f"\n## {hand}\n\n![{hand}: {', '.join(grips)}; each before closing, and below it after the lift]"
        )
        text += f"(pictures/cookbook/{hand}.png)\n\n"
        missing = [kind for kind in KINDS if kind not in grips]
        if missing:
            text += f"No grip was found for {', '.join(f'`{kind}`' for kind in missing)}.\n\n"
        text += f"| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}\n"
        for kind in grips:
            own = [found for found in lifts if (found.hand, found.kind) == (hand, kind)]
            if not own:
                sys.exit(f"{hand}, {kind}: not played; play all, or give earlier lifts by --kept")
            done = f"{sum(found.lifted for found in own)} of {len(own)}"
            reach = f"{1e3 * np.mean([found.reach_m for found in own]):.0f}"
            text += f"| {' | '.join([f'`{kind}`', *numbers(hand, kind, folder), reach, done])} |\n"
    return text + FOOT.format(engine=engine)


def main() -> int:
    """Play the grips; return the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--hands", type=lambda text: text.split(","), default=[*COOKBOOK], help="names with commas"
    )
    parser.add_argument(
        "--kinds", type=lambda text: text.split(","), default=[*KINDS], help="names with commas"
    )
    parser.add_argument("--seeds", type=int, default=len(SEEDS), help="scenes of each")
    parser.add_argument("--write", action="store_true", help="write document and pictures")
    parser.add_argument("--kept", type=Path, help="file of earlier lifts, which are not played again")
    options = parser.parse_args()
    kept: dict[tuple[str, str, int], Lift] = {}
    if options.kept is not None and options.kept.exists():
        for line in options.kept.read_text().splitlines():
            earlier = Lift(**json.loads(line))
            kept[earlier.hand, earlier.kind, earlier.seed] = earlier
    failed = 0
    with tempfile.TemporaryDirectory() as name, palmares.Client("local") as client:
        folder = Path(name)
        for hand in options.hands:
            shots: list[Picture] = []
            for kind in [kind for kind in COOKBOOK[hand] if kind in options.kinds]:
                own = []
                for seed in SEEDS[: options.seeds]:
                    drawn = shots if options.write and seed == SEEDS[0] and hand not in ALIKE else None
                    found = kept.get((hand, kind, seed))
                    if found is None or drawn is not None:
                        found = lift(client, task_of(kind, folder), hand, kind, seed, drawn)
                        kept[hand, kind, seed] = found
                        if options.kept is not None:
                            with options.kept.open("a") as file:
                                file.write(json.dumps(asdict(found)) + "\n")
                    own.append(found)
                done = sum(found.lifted for found in own)
                failed += done < len(own) - len(own) // 5
                print(f"{hand:15} {kind:12} {done} of {len(own)}", flush=True)
            if shots:
                PICTURES.mkdir(exist_ok=True)
                (PICTURES / f"{hand}.png").write_bytes(png(sheet(shots)))
        if options.write:
            DOCUMENT.write_text(page([*kept.values()], folder))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
