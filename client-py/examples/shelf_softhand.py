"""Take objects out of the shelf with the SoftHand and drop them into the box.

The hand goes in horizontally, palm down, above the object; sinks onto it, closes, lifts a little, comes out
the way it went in, and opens over the box:

    in front of the shelf -> in, over the object -> down -> close -> up -> out -> over the box -> open

Which object, and with which of a few grasps, is decided by the room that the hand has on its way in, seen
with the true poses (sensing "truth"). An object that slipped is tried again with another grasp. What stands
in front of it may come along, or fall: of the ten objects of the seeds 100 to 109, 5 to 8 ended in the box
(6.1 on average) and about three on the ground.

    python shelf_softhand.py --seed 7 --runs 3
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from dataclasses import asdict, dataclass

import numpy as np

import palmares
from palmares.bounds import Thing, look
from palmares.motion import Mover, RunOverError
from palmares.rotation import Array, quat_of, rot_y, rot_z
from palmares.softhand import CAPSULE_A, CAPSULE_B, CAPSULE_RADIUS

# --------------------------------------------------------------------------------------------------------
# What to tune


@dataclass(frozen=True)
class Grasp:
    """How the SoftHand takes an object from above. Hand frame: fingers +z, palm normal +x, thumb +y."""

    name: str
    pitch: float
    """rad; π/2 holds the fingers level, more points them down"""
    roll: float
    """rad; turns the palm about the fingers' axis"""
    above: float
    """Where the hand's origin is above the object's top, along the palm normal, m"""
    aside: float
    """Where the object's middle is in the hand frame along y, m"""
    along: float
    """Where the object's middle is in the hand frame along the fingers, m"""
    sigma_open: float
    """Motor command on the way in"""
    sigma_closed: float
    """Motor command of the grasp"""
    sink: float
    """The hand goes in this much farther from the object and then sinks, m"""

    def rotation(self, yaw: float) -> Array:
        """World-from-hand rotation when the hand goes in along +y turned by `yaw` (rad)."""
        turned: Array = rot_z(math.pi / 2 + yaw) @ rot_y(self.pitch) @ rot_z(self.roll)
        return turned


GRASPS = [
    Grasp("flat", 1.6182, 0.3491, 0.0068, 0.0264, 0.1876, 0.0212, 0.7417, 0.0194),
    Grasp("high", 1.4135, 0.1346, 0.0232, 0.0137, 0.1689, 0.0, 0.8641, 0.0332),
    Grasp("steep", 1.7088, -0.3693, 0.0187, 0.0117, 0.1764, 0.0, 0.9539, 0.0327),
    Grasp("loose", 1.5586, -0.1036, 0.0226, 0.0357, 0.1726, 0.0492, 0.7668, 0.0097),
]
YAWS = (0.0, 0.35, -0.35)
"""Directions tried, rad"""
PICKS = 30
"""Attempts per run"""
TRIES = 5
"""An object that was tried so often where it stands is left there"""
MOVED = 0.015
"""An object that has moved farther than this since an attempt is a new case, m"""
MARGIN = 0.006
"""Room to leave between the hand and what it should not touch, m"""

WAIT_AT = np.array([0.0, -0.12, 0.95])
"""Where the hand's base waits and turns, before the shelf and above the box, m"""
IN_S, SINK_S, CLOSE_S, SQUEEZE_S, LIFT_S, OUT_S, OPEN_S, FALL_S = 0.9, 0.25, 0.6, 0.2, 0.3, 1.1, 0.4, 0.3
LIFT = 0.02
"""How far an object is lifted before it is drawn out, m"""

# --------------------------------------------------------------------------------------------------------
# Which object, and how


@dataclass(frozen=True)
class Plan:
    """An object, a grasp, and where the hand then is."""

    thing: Thing
    grasp: Grasp
    yaw: float
    rotation: Array
    at: Array
    """Of the base when the fingers close, m"""
    room: float

    @property
    def before(self) -> Array:
        """Of the base before it sinks, m."""
        before: Array = self.at - self.grasp.sink * self.rotation[:, 0]
        return before

    @property
    def into(self) -> Array:
        """Direction in which the hand goes in, level, unit vector."""
        level: Array = rot_z(self.yaw) @ np.array([0.0, 1.0, 0.0])
        return level


@dataclass(frozen=True)
class Attempt:
    """What was tried, and where the object stood."""

    index: int
    grasp: str
    yaw: float
    middle: Array


def room(plan: Plan, others: list[Thing], shelf: palmares.Region) -> float:
    """Return how well the hand gets in: 0 if it touches nothing on its way, less if it does (m).

    The hand is a set of points with radii; on its way in each draws a line that ends where it stops.
    """
    shares = np.linspace(0.0, 1.0, 5)[:, None, None]
    axes = CAPSULE_A[None] * (1 - shares) + CAPSULE_B[None] * shares
    points = axes.reshape(-1, 3) @ plan.rotation.T + plan.before
    radii = np.tile(CAPSULE_RADIUS, 5)
    inside = points[:, 1] + radii > shelf.min[1]
    points, radii = points[inside], radii[inside]
    score = 0.0
    for side in (0, 1, 2):
        beyond = np.maximum(points[:, side] + radii - shelf.max[side], 0.0)
        if side != 1:
            beyond = np.maximum(beyond, shelf.min[side] - (points[:, side] - radii))
        score -= 2.0 * float(beyond.max(initial=0.0))
    back = -plan.into / plan.into[1]
    for thing in others:
        # Where each point's line passes the object's front, or ends.
        front = np.clip(points[:, 1], thing.low[1], thing.high[1])
        reached = points[:, 1] + radii > thing.low[1]
        line = points + np.outer(points[:, 1] - front, back)
        gap_x = np.maximum(thing.low[0] - line[:, 0], line[:, 0] - thing.high[0])
        gap_z = line[:, 2] - thing.high[2]
        gap = np.maximum(gap_x, gap_z) - radii
        score -= float(np.clip(MARGIN - gap[reached], 0.0, 0.05).max(initial=0.0))
    return score


def choose(things: list[Thing], shelf: palmares.Region, attempts: list[Attempt]) -> Plan | None:
    """Return the plan with the most room; one that failed where the object still stands counts less."""
    best, best_score = None, -math.inf
    inside = [thing for thing in things if shelf.contains(thing.com)]
    for thing in inside:
        others = [other for other in inside if other is not thing]
        here = [
            tried
            for tried in attempts
            if tried.index == thing.index and np.linalg.norm(tried.middle - thing.middle) < MOVED
        ]
        if len(here) >= TRIES:
            continue
        depth = thing.middle[1] - shelf.min[1]
        for rank, grasp in enumerate(GRASPS):
            for yaw in YAWS:
                rotation = grasp.rotation(yaw)
                height = float(thing.high[2] - thing.low[2])
                in_hand = np.array([height / 2 + grasp.above, grasp.aside, grasp.along])
                at = thing.middle - rotation @ in_hand
                plan = Plan(thing, grasp, yaw, rotation, at, 0.0)
                free = room(plan, others, shelf)
                same = sum(tried.grasp == grasp.name for tried in here)
                score = free - 0.02 * depth - 0.002 * rank - 0.01 * abs(yaw) - 0.02 * len(here) - 0.05 * same
                if score > best_score:
                    best, best_score = Plan(thing, grasp, yaw, rotation, at, free), score
    return best


# --------------------------------------------------------------------------------------------------------
# How it is done


def fetch(mover: Mover, plan: Plan, scene: palmares.Scene) -> None:
    """Carry a plan out: whatever is in the hand in the end drops into the box."""
    shelf, box = scene.region("shelf"), scene.region("box")
    grasp, quat = plan.grasp, quat_of(plan.rotation)
    outside = plan.before - plan.into * (plan.before[1] + 0.02) / plan.into[1]
    mover.to(0.6, WAIT_AT, quat, sigma=grasp.sigma_open)
    mover.to(0.6, outside)
    mover.to(IN_S, plan.before)
    mover.to(SINK_S, plan.at)
    mover.to(CLOSE_S, sigma=grasp.sigma_closed)
    mover.wait(SQUEEZE_S)
    mover.to(LIFT_S, plan.at + np.array([0.0, 0.0, LIFT]))
    # Out along the way in, until the whole hand is before the shelf; then the object over the box's middle.
    out = mover.position - plan.into * (plan.thing.high[1] - shelf.min[1] + 0.05) / plan.into[1]
    mover.to(OUT_S * 0.6, out)
    middle = box.center
    aside = plan.at - plan.thing.middle
    over = np.array([middle[0] + aside[0], middle[1] + aside[1], out[2]])
    mover.to(OUT_S * 0.6, over)
    mover.to(OPEN_S, sigma=0.0)
    mover.wait(FALL_S)


# --------------------------------------------------------------------------------------------------------
# A run


@dataclass(frozen=True)
class Summary:
    """What came of a run."""

    run_id: str
    seed: int | None
    score: float
    in_box: int
    outside: int
    """Objects that ended neither in the shelf nor in the box"""
    picks: int
    """Attempts made"""
    caught: int
    """... after which there was more in the box"""
    sim_time_s: float
    rtf: float
    """Simulated time per wall time"""
    left: list[str]
    """What is still in the shelf"""


def run(client: palmares.Client, seed: int | None, picks: int, quiet: bool) -> Summary:
    """Play one run and return what came of it."""
    obs = client.reset("shelf", "softhand", sensing="truth", seed=seed)
    seed = seed if obs.run is None else obs.run.seed
    scene = client.scene
    shelf, box = scene.region("shelf"), scene.region("box")
    mover = Mover(client, obs)
    attempts: list[Attempt] = []
    done = caught = 0

    def count() -> int:
        return sum(box.contains(thing.com) for thing in look(scene, mover.obs))

    started = time.monotonic()
    try:
        while done < picks:
            plan = choose(look(scene, mover.obs), shelf, attempts)
            if plan is None:
                break
            done += 1
            attempts.append(Attempt(plan.thing.index, plan.grasp.name, plan.yaw, plan.thing.middle))
            before = count()
            fetch(mover, plan, scene)
            caught += count() > before
            if not quiet:
                print(
                    f"pick {done:2d}  {plan.thing.name:28.28} {plan.grasp.name:6} "
                    f"room {plan.room * 1e3:6.1f} mm  {count()} in the box, {mover.obs.sim_time_s:.0f} s",
                    file=sys.stderr,
                )
        mover.wait(0.5)
    except RunOverError:
        pass  # Complete, or out of time: `stop` tells which.
    wall_s = time.monotonic() - started
    left = [thing.name for thing in look(scene, mover.obs) if shelf.contains(thing.com)]
    sim_time_s = mover.obs.sim_time_s
    result = client.stop()
    return Summary(
        run_id=result.run_id,
        seed=seed,
        score=result.score,
        in_box=result.in_goal,
        outside=result.outside,
        picks=done,
        caught=caught,
        sim_time_s=sim_time_s,
        rtf=sim_time_s / wall_s,
        left=left,
    )


def main() -> None:
    """Read the command line and play."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--url", default="http://127.0.0.1:8080", help="where the server listens")
    parser.add_argument("--team", default="example", help="name on a practice server's leaderboard")
    parser.add_argument("--seed", type=int, help="scene of the first run; the next runs count up")
    parser.add_argument("--runs", type=int, default=1, help="how many runs")
    parser.add_argument("--picks", type=int, default=PICKS, help="attempts per run")
    parser.add_argument("--quiet", action="store_true", help="no progress lines")
    parser.add_argument("--json", action="store_true", help="one JSON object per run on stdout")
    args = parser.parse_args()

    summaries: list[Summary] = []
    with palmares.Client(args.url, team=args.team) as client:
        for k in range(args.runs):
            seed = None if args.seed is None else args.seed + k
            summary = run(client, seed, args.picks, args.quiet)
            summaries.append(summary)
            if args.json:
                print(json.dumps(asdict(summary)), flush=True)
            else:
                print(
                    f"run {summary.run_id}: score {summary.score:g}, {summary.in_box} objects in the box, "
                    f"{summary.outside} lost, {summary.caught} of {summary.picks} picks paid, "
                    f"{summary.sim_time_s:.1f} s simulated, {summary.rtf:.1f} x real time",
                    flush=True,
                )
    if args.runs > 1 and not args.json:
        mean = sum(s.in_box for s in summaries) / len(summaries)
        print(f"{len(summaries)} runs: {mean:.1f} objects in the box on average")


if __name__ == "__main__":
    try:
        main()
    except palmares.PalmaresError as error:
        sys.exit(f"{error}")
    except KeyboardInterrupt:
        sys.exit("interrupted")
