"""Move balls from box A to box B with the SoftHand: look, pick, carry, drop, look again.

An honest and simple controller to start from. It sees the true ball positions (sensing "truth"), chooses the
ball and the direction that leave the hand most room, and then plays a fixed sequence of motions:

    above the ball -> down (slightly tilted) -> forward along the palm -> close -> up -> over box B -> open

A ball by a wall or in a corner leaves the fingers no room to get around it. It is raked away from there
first: the fingers come down on its inner side, curl over it and draw it to the middle of the box.

It does not react to touch. What it does react to is what it sees after each attempt.

    python balls_softhand.py --seed 7 --runs 3
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
from palmares.motion import Mover, RunOverError
from palmares.rotation import Array, quat_of, rot_y, rot_z
from palmares.softhand import CAPSULE_A, CAPSULE_B, CAPSULE_RADIUS

# --------------------------------------------------------------------------------------------------------
# What to tune


@dataclass(frozen=True)
class Grasp:
    """How the SoftHand takes a ball of 10 cm. Hand frame: fingers +z, palm normal +x, thumb +y."""

    pitch: float = 2.2405
    """rad; tilts the fingers from straight up to pointing down"""
    roll: float = -0.3159
    """rad; turns the palm about the fingers' axis"""
    ball_in_hand: tuple[float, float, float] = (0.0527, 0.05, 0.2103)
    """Where the ball's centre should be when the fingers close, hand frame, m"""
    sigma_preshape: float = 0.0977
    """Motor command while approaching: slightly curled"""
    sigma_closed: float = 1.0
    """Motor command of the grasp"""
    advance: float = 0.0165
    """The approach stops this far behind the grasp; the palm then moves forward along its normal, m"""
    lean: float = 0.155
    """rad; the approach comes down along this tilt from the vertical"""

    def rotation(self, yaw: float) -> Array:
        """World-from-hand rotation when the ball is taken from the direction `yaw` (rad)."""
        rotation: Array = rot_z(yaw) @ rot_y(self.pitch) @ rot_z(self.roll)
        return rotation

    def approach_direction(self, yaw: float) -> Array:
        """Direction in which the hand comes down, unit vector, world frame."""
        down: Array = rot_z(yaw) @ np.array([math.sin(self.lean), 0.0, -math.cos(self.lean)])
        return down


@dataclass(frozen=True)
class Script:
    """How long and how far. A motion takes longer than its time here if the base's limits demand it."""

    travel_s: float = 1.2
    approach_s: float = 0.8
    advance_s: float = 0.3
    close_s: float = 0.8
    """The motor needs 0.5 s from open to closed; the tendon then takes up its tension"""
    squeeze_s: float = 0.2
    """Wait between closing and lifting"""
    lift_s: float = 0.8
    carry_s: float = 1.2
    hold_s: float = 0.2
    """Wait over box B until the ball hangs still"""
    open_s: float = 0.4
    fall_s: float = 0.3
    """Wait after opening until the ball has left the hand"""
    ready_height: float = 0.9
    """Where the hand's base goes first, over the middle of box A, m"""
    clearance_height: float = 0.32
    """The approach starts this far above the grasp, m"""
    lift_height: float = 0.36
    """Enough for the ball and the fingers under it to pass over the wall, m"""
    lifted: float = 0.15
    """A ball that rose by this much is in the hand, m"""


@dataclass(frozen=True)
class Rake:
    """How a ball is drawn away from a wall. The hand is turned as for a grasp, fingers to the wall."""

    height: float = 0.02
    """The hand stays this far above where it would grasp, m"""
    inward: float = 0.07
    """... and this far nearer to the middle, so that the fingers do not land on the wall, m"""
    sigma: float = 0.6
    """Motor command that curls the fingers over the ball"""
    curl_s: float = 0.5
    way: float = 0.12
    """How far the hand draws, m; the ball rolls on"""
    draw_s: float = 0.8
    retreat_height: float = 0.3
    """How far it then goes up, m"""


GRASP = Grasp()
SCRIPT = Script()
RAKE = Rake()
PICKS = 25
"""Attempts per run"""
YAWS = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
"""Directions tried for every ball, rad"""

# --------------------------------------------------------------------------------------------------------
# How much room the hand has


# The hand is checked at these distances before the end of its approach, m.
APPROACH_SAMPLES = (0.0, 0.05, 0.12)
MARGIN = 0.005
"""Room to leave between hand and other balls, m"""
TIGHT = -0.1
"""With less room than this, a ball is raked, not grasped"""
CENTRAL = 0.12
"""A ball this near to the middle of the box is not raked, m"""
TRIES = 4
"""A ball that stayed where it is through so many attempts is left there"""
MOVED = 0.01
"""A ball that has moved farther than this since an attempt is a new case, m"""


def room(rotation: Array, position: Array, others: Array, ball_radius: float, box: palmares.Region) -> float:
    """Return how well the preshaped hand fits at a pose: 0 if it touches nothing, less if it does (m).

    `others` are the centres of the balls that should not be touched, shape (n, 3).
    """
    a = CAPSULE_A @ rotation.T + position
    b = CAPSULE_B @ rotation.T + position
    score = 0.0

    if len(others):
        # Distance of every ball's centre from every capsule's axis: clamp the foot point to the segment.
        axis = b - a
        to_ball = others[None, :, :] - a[:, None, :]
        along = np.einsum("kij,kj->ki", to_ball, axis) / np.sum(axis**2, axis=1)[:, None]
        foot = a[:, None, :] + np.clip(along, 0.0, 1.0)[:, :, None] * axis[:, None, :]
        gap = np.linalg.norm(others[None, :, :] - foot, axis=2) - CAPSULE_RADIUS[:, None] - ball_radius
        score -= float(np.clip(MARGIN - gap, 0.0, 0.05).sum())

    # Walls are hard: what would stand inside one counts three times, and once more for being there at all.
    radius = CAPSULE_RADIUS[:, None]
    low, high = np.minimum(a, b) - radius, np.maximum(a, b) + radius
    below_rim = low[:, 2] < box.max[2]
    for side in range(2):
        for into in (high[:, side] - box.max[side], box.min[side] - low[:, side]):
            into = into[below_rim]
            score -= float(3.0 * np.clip(into, 0.0, None).sum() + 0.1 * np.count_nonzero(into > 0.004))
    return score


@dataclass(frozen=True)
class Candidate:
    """A ball and the direction to take it from."""

    ball: int
    yaw: float
    room: float
    position: Array
    """Centre of the ball when the choice was made, (3,), m"""
    tried: int
    """How often it was tried where it lies"""


@dataclass(frozen=True)
class Attempt:
    """What was tried: which ball, from where, and where it lay."""

    ball: int
    yaw: float
    position: Array


def choose(
    balls: Array, in_a: list[int], radius: float, box: palmares.Region, attempts: list[Attempt]
) -> Candidate | None:
    """Return the ball and the yaw with the most room, or `None` if nothing is worth another try.

    A ball that was tried where it lies now counts less, and from about the same direction much less.
    """
    best, best_score = None, -math.inf
    for ball in in_a:
        others = np.delete(balls, ball, axis=0)
        of_it = [attempt for attempt in attempts if attempt.ball == ball]
        here = [tried for tried in of_it if np.linalg.norm(tried.position - balls[ball]) < MOVED]
        if len(here) >= TRIES:
            continue
        for yaw in YAWS:
            rotation = GRASP.rotation(yaw)
            grasp_at = balls[ball] - rotation @ np.array(GRASP.ball_in_hand)
            before_advance = grasp_at - GRASP.advance * rotation[:, 0]
            down = GRASP.approach_direction(yaw)
            least = min(
                room(rotation, before_advance - back * down, others, radius, box) for back in APPROACH_SAMPLES
            )
            score = (
                least - 0.05 * len(here) - 0.2 * sum(max(0.0, math.cos(yaw - tried.yaw)) for tried in here)
            )
            if score > best_score:
                best, best_score = Candidate(ball, float(yaw), least, balls[ball].copy(), len(here)), score
    return best


# --------------------------------------------------------------------------------------------------------
# How a ball is taken


def pick_and_carry(mover: Mover, target: Candidate, box_b: palmares.Region) -> bool:
    """Take the ball, carry it over box B and let it go. Return whether a ball was in the hand."""
    rotation = GRASP.rotation(target.yaw)
    quat = quat_of(rotation)
    grasp_at = target.position - rotation @ np.array(GRASP.ball_in_hand)
    before_advance = grasp_at - GRASP.advance * rotation[:, 0]
    down = GRASP.approach_direction(target.yaw)
    above = before_advance - SCRIPT.clearance_height / abs(down[2]) * down

    mover.to(SCRIPT.travel_s, above, quat, sigma=GRASP.sigma_preshape)
    mover.to(SCRIPT.approach_s, before_advance)
    mover.to(SCRIPT.advance_s, grasp_at)
    mover.to(SCRIPT.close_s, sigma=GRASP.sigma_closed)
    mover.wait(SCRIPT.squeeze_s)

    heights = true_positions(mover.obs)[:, 2]
    mover.to(SCRIPT.lift_s, grasp_at + np.array([0.0, 0.0, SCRIPT.lift_height]))
    caught = bool(np.any(true_positions(mover.obs)[:, 2] > heights + SCRIPT.lifted))
    if caught:
        # The ball, not the hand, should arrive near the middle of box B.
        x, y, _ = middle_of(box_b) - target.position
        mover.to(SCRIPT.carry_s, mover.position + np.array([x, 0.7 * y, 0.0]))
        mover.wait(SCRIPT.hold_s)
    mover.to(SCRIPT.open_s, sigma=0.0)
    mover.wait(SCRIPT.fall_s)
    return caught


def rake(mover: Mover, target: Candidate, outward: Array) -> None:
    """Draw the ball towards the middle of its box; `outward` is the unit vector away from there."""
    # The ball lies in front of the hand: turn the hand so that it reaches outward.
    yaw = max(YAWS, key=lambda yaw: float(GRASP.rotation(yaw) @ np.array(GRASP.ball_in_hand) @ outward))
    rotation = GRASP.rotation(yaw)
    behind = target.position - rotation @ np.array(GRASP.ball_in_hand) - RAKE.inward * outward
    down_at = behind + np.array([0.0, 0.0, RAKE.height])
    drawn_to = down_at - RAKE.way * outward
    down = GRASP.approach_direction(yaw)
    above = down_at - SCRIPT.clearance_height / abs(down[2]) * down

    mover.to(SCRIPT.travel_s, above, quat_of(rotation), sigma=GRASP.sigma_preshape)
    mover.to(SCRIPT.approach_s, down_at)
    mover.to(RAKE.curl_s, sigma=RAKE.sigma)
    mover.to(RAKE.draw_s, drawn_to)
    mover.to(SCRIPT.lift_s, drawn_to + np.array([0.0, 0.0, RAKE.retreat_height]))
    mover.to(SCRIPT.open_s, sigma=0.0)
    mover.wait(SCRIPT.fall_s)


# --------------------------------------------------------------------------------------------------------
# A run


def true_positions(obs: palmares.Observation) -> Array:
    """Centres of the balls, shape (n, 3), m."""
    if obs.truth is None:
        raise SystemExit('this controller needs sensing="truth"')
    return obs.truth.positions


@dataclass(frozen=True)
class Failure:
    """A grasp that lifted nothing: where the ball lay (m), the hand's direction (rad), its room."""

    x: float
    y: float
    yaw: float
    room: float


@dataclass(frozen=True)
class Summary:
    """What came of a run."""

    run_id: str
    seed: int | None
    score: float
    balls_in_b: int
    picks: int
    """Attempts made"""
    raked: int
    """... that drew a ball away from a wall"""
    caught: int
    """Attempts with a ball in the hand after the lift"""
    sim_time_s: float
    rtf: float
    """Simulated time per wall time"""
    failures: list[Failure]


class Progress:
    """One line on stderr that says how far the run is."""

    def __init__(self, box_b: palmares.Region, quiet: bool) -> None:
        self.box_b = box_b
        self.quiet = quiet
        self.pick = 0
        self.started = time.monotonic()
        self._shown = 0.0

    def show(self, obs: palmares.Observation, always: bool = False) -> None:
        """Write the line; on a terminal a few times a second, else only when `always`."""
        now = time.monotonic()
        live = sys.stderr.isatty()
        if self.quiet or not (always or (live and now - self._shown > 0.2)):
            return
        self._shown = now
        rtf = obs.sim_time_s / max(now - self.started, 1e-9)
        line = (
            f"pick {self.pick:2d}   balls in B {count_inside(true_positions(obs), self.box_b):2d}   "
            f"{obs.sim_time_s:6.1f} s simulated   {rtf:5.1f} x real time"
        )
        print(f"\r{line}" if live else line, end="" if live else "\n", file=sys.stderr, flush=True)

    def end(self) -> None:
        """Leave the line."""
        if not self.quiet and sys.stderr.isatty():
            print(file=sys.stderr)


def middle_of(region: palmares.Region) -> Array:
    """Return the middle of a region, (3,), m."""
    middle: Array = (np.array(region.min) + np.array(region.max)) / 2
    return middle


def count_inside(points: Array, region: palmares.Region) -> int:
    """Return how many of the points (n, 3) lie in the region."""
    return sum(region.contains(point) for point in points)


def ball_radius(scene: palmares.Scene) -> float:
    """Return the largest radius among the free spheres of the scene, m."""
    radii = [part.shape.radius for body in scene.bodies if body.free for part in body.parts]
    return max((radius for radius in radii if radius is not None), default=0.05)


def run(client: palmares.Client, seed: int | None, picks: int, quiet: bool) -> Summary:
    """Play one run and return what came of it."""
    obs = client.reset("balls", "softhand", sensing="truth", seed=seed)
    seed = seed if obs.run is None else obs.run.seed
    box_a, box_b = client.scene.region("box_a"), client.scene.region("box_b")
    radius = ball_radius(client.scene)
    progress = Progress(box_b, quiet)
    mover = Mover(client, obs, progress.show)
    caught = raked = 0
    attempts: list[Attempt] = []
    failures: list[Failure] = []
    try:
        ready = np.array([*middle_of(box_a)[:2], SCRIPT.ready_height])
        mover.to(1.0, ready, quat_of(GRASP.rotation(0.0)))
        while progress.pick < picks:
            balls = true_positions(mover.obs)
            in_a = [ball for ball in range(len(balls)) if box_a.contains(balls[ball])]
            target = choose(balls, in_a, radius, box_a, attempts)
            if target is None:
                break
            progress.pick += 1
            outward = np.array([*(target.position - middle_of(box_a))[:2], 0.0])
            distance = float(np.linalg.norm(outward))
            if (target.room < TIGHT or target.tried > 0) and distance > CENTRAL:
                rake(mover, target, outward / distance)
                raked += 1
            elif pick_and_carry(mover, target, box_b):
                caught += 1
            else:
                x, y, _ = (float(v) for v in target.position)
                failures.append(Failure(x, y, target.yaw, target.room))
            attempts.append(Attempt(target.ball, target.yaw, target.position))
            progress.show(mover.obs, always=True)
        mover.wait(0.5)
    except RunOverError:
        pass  # Complete, or out of time: `stop` tells which.
    progress.end()
    wall_s = time.monotonic() - progress.started
    sim_time_s = mover.obs.sim_time_s
    result = client.stop()
    return Summary(
        run_id=result.run_id,
        seed=seed,
        score=result.score,
        balls_in_b=result.in_goal,
        picks=progress.pick,
        raked=raked,
        caught=caught,
        sim_time_s=sim_time_s,
        rtf=sim_time_s / wall_s,
        failures=failures,
    )


def main() -> None:
    """Read the command line and play."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--url", default="http://127.0.0.1:8080", help="where the server listens")
    parser.add_argument("--team", default="example", help="name on a practice server's leaderboard")
    parser.add_argument("--seed", type=int, help="scene of the first run; the next runs count up")
    parser.add_argument("--runs", type=int, default=1, help="how many runs")
    parser.add_argument("--picks", type=int, default=PICKS, help="attempts per run")
    parser.add_argument("--quiet", action="store_true", help="no progress line")
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
                    f"run {summary.run_id}: score {summary.score:g}, {summary.balls_in_b} balls in B, "
                    f"{summary.caught} of {summary.picks - summary.raked} grasps held, "
                    f"{summary.raked} balls raked, {summary.sim_time_s:.1f} s simulated, "
                    f"{summary.rtf:.1f} x real time",
                    flush=True,
                )
    if args.runs > 1 and not args.json:
        mean = sum(s.balls_in_b for s in summaries) / len(summaries)
        print(f"{len(summaries)} runs: {mean:.1f} balls in B on average")


if __name__ == "__main__":
    try:
        main()
    except palmares.PalmaresError as error:
        sys.exit(f"{error}")
    except KeyboardInterrupt:
        sys.exit("interrupted")
