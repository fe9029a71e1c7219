"""Grasp one object with the SoftHand, lift it, hold it through a shake. The first thing to try.

    python grasp_softhand.py --seed 1

The hand comes down on the object with its palm, closes, lifts and waits. The server then shakes it. What it
is worth is in `tasks/grasp/task.toml`. Change the numbers in `GRASP` and see what becomes of the score.
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
from palmares.bounds import look
from palmares.motion import Mover, RunOverError
from palmares.rotation import Array, quat_of, rot_y, rot_z


@dataclass(frozen=True)
class Grasp:
    """How the SoftHand takes an object from above. Hand frame: fingers +z, palm normal +x, thumb +y."""

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
    """Motor command on the way down"""
    sigma_closed: float
    """Motor command of the grasp"""
    sink: float
    """The hand comes down over this height, m"""

    def rotation(self, yaw: float) -> Array:
        """World-from-hand rotation when the fingers point along +y turned by `yaw` (rad)."""
        turned: Array = rot_z(math.pi / 2 + yaw) @ rot_y(self.pitch) @ rot_z(self.roll)
        return turned


GRASP = Grasp(
    pitch=1.6182,
    roll=0.3491,
    above=0.0068,
    aside=0.0264,
    along=0.1876,
    sigma_open=0.0212,
    sigma_closed=0.9,
    sink=0.12,
)
LIFT = 0.16
"""How far the object is lifted, m"""


def main() -> None:
    """Play runs and print what the referee said."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--url", default="http://127.0.0.1:8080", help="where the server listens")
    parser.add_argument("--team", default="example", help="name on a practice server's leaderboard")
    parser.add_argument("--seed", type=int, help="scene of the first run; the next runs count up")
    parser.add_argument("--runs", type=int, default=1, help="how many runs")
    parser.add_argument("--json", action="store_true", help="one JSON object per run on stdout")
    args = parser.parse_args()
    with palmares.Client(args.url, team=args.team) as client:
        for k in range(args.runs):
            summary = grasp(client, None if args.seed is None else args.seed + k)
            if args.json:
                print(json.dumps(asdict(summary)), flush=True)
            else:
                said = ", ".join(summary.said) or "not lifted"
                print(f"{summary.object:28} score {summary.score:5.2f}  {said}", flush=True)


@dataclass(frozen=True)
class Summary:
    """What came of a run."""

    run_id: str
    seed: int | None
    object: str
    score: float
    kept: int
    """1 if the object is still in the hand after the shake"""
    said: list[str]
    """What the referee noted, and when"""
    sim_time_s: float
    rtf: float
    """Simulated time per wall time"""


def grasp(client: palmares.Client, seed: int | None) -> Summary:
    """Play one run."""
    started = time.monotonic()
    obs = client.reset("grasp", "softhand", sensing="truth", seed=seed)
    (thing,) = look(client.scene, obs)
    # The fingers lie across the object's longer side.
    width, depth, height = thing.high - thing.low
    rotation = GRASP.rotation(0.0 if width >= depth else math.pi / 2)
    in_hand = np.array([height / 2 + GRASP.above, GRASP.aside, GRASP.along])
    at = thing.middle - rotation @ in_hand

    mover = Mover(client, obs)
    up = np.array([0.0, 0.0, 1.0])
    try:
        mover.to(1.0, at + GRASP.sink * up, quat_of(rotation), sigma=GRASP.sigma_open)
        mover.to(0.5, at)
        mover.to(0.6, sigma=GRASP.sigma_closed)
        mover.wait(0.3)
        mover.to(0.6, at + LIFT * up)
        mover.wait(10.0)
    except RunOverError:
        pass  # The shake is over.
    wall_s = time.monotonic() - started
    result = client.stop()
    return Summary(
        run_id=result.run_id,
        seed=seed,
        object=thing.name,
        score=result.score,
        kept=result.in_goal,
        said=[f"{event.kind} at {event.tick * 0.01:.2f} s" for event in result.events],
        sim_time_s=mover.obs.sim_time_s,
        rtf=mover.obs.sim_time_s / wall_s,
    )


if __name__ == "__main__":
    try:
        main()
    except palmares.PalmaresError as error:
        sys.exit(f"{error}")
    except KeyboardInterrupt:
        sys.exit("interrupted")
