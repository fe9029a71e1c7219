"""Learn to reach, wrap and lift the peg with your own reward, observation and starts: begin yours here.

    pip install 'palmares[learn]'
    python train_peg_reward.py --seed 1 --policy peg.zip --curve peg.json

`reward` and `observe` are functions of arrays with a row for each environment; docs/training.md lists the
fields. The rest of the file calls PPO of stable-baselines3 (Schulman et al. 2017) in 16 environments, and
plays what it learned in scenes that it has not seen.

An episode has 60 actions of 0.1 s. Training has steps of 5 ms, the test the task's own of 1 ms. Episodes of
the training begin where the hand begins, or somewhere in a scripted grasp, so that closing and lifting are
learned before the way there (Salimans and Chen 2018, *Learning Montezuma's Revenge from a single
demonstration*); those of the test begin where the hand begins.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palmares.arrays import Array
from palmares.outputs import output_file

if TYPE_CHECKING:
    from palmares.gym import Transition
    from palmares.sim import State

TASK, HAND = "peg", "softhand"
PEG = 0
"""Row of the peg in ``objects``"""
IN_HAND_M = np.array([0.035, -0.020, 0.172])
"""The peg's axis between the fingers before they close, in the hand's frame: as in peg_softhand.py"""
PEG_HEIGHT_M = 0.1
"""Height of the peg's centre when it stands on the table"""
GRIP_M = 0.04
"""Height above the peg's centre at which the fingers shall close"""
LIFTED_M = 0.03
"""Rise from which the peg counts as lifted, as in the task's first goal"""
LARGEST_RISE_M, FALLEN_M = 0.1, 0.01
"""Rise above which the reward does not grow, and fall from which the peg no longer stands"""
STEPS, TICKS, STEP_MS = 60, 10, 5.0
"""Actions of an episode, ticks of 10 ms of an action, and long steps of the training"""
# Velocities up to 0.24 m/s and 0.75 rad/s, and all of the motor's range.
SQUARE = 0.5**0.5
ACTION_SCALE = (0.12, 0.12, 0.12, 0.25, 0.25, 0.25, 1.0)
UPDATES = 140
SHOWN_SEEDS = range(9001, 9009)
"""Scenes of the scripted grasp"""
FIRST_TEST_SEED, FIRST_SEED_BETWEEN = 1_000_001, 2_000_001
TEST_EVERY = 10
"""Updates between two tests of 20 scenes with long steps"""


def rise(fields: dict[str, Any]) -> Array:
    """Return how far the peg is above its place on the table, (N,), m."""
    found: Array = fields["objects"][:, PEG, 2] - PEG_HEIGHT_M
    return found


def turns(fields: dict[str, Any]) -> Array:
    """Return the rotation matrices of the hand, (N, 3, 3)."""
    x, y, z, w = fields["base"][:, 3:7].T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def way(fields: dict[str, Any]) -> Array:
    """Return the way of the hand to the grip, (N, 3), m, in the hand's frame."""
    turn = turns(fields)
    between = fields["base"][:, :3] + turn @ IN_HAND_M
    grip = fields["objects"][:, PEG, :3] + [0.0, 0.0, GRIP_M]
    found: Array = np.einsum("nij,ni->nj", turn, grip - between)
    return found


def potential(fields: dict[str, Any]) -> Array:
    """Return what an episode is worth so far, (N,): it grows with reach, turn, wrap and lift."""
    distance = np.linalg.norm(way(fields), axis=1)
    reach = -5.0 * distance
    # The thumb shall point up, so that the fingers lie around the upright peg.
    turn = turns(fields)[:, 2, 1]
    # The motor's command shall be open until the peg stands between the fingers, and closed from then on: it
    # says how much the hand squeezes, where the motor's position stays at the peg.
    stands = rise(fields) > -FALLEN_M
    ready = np.exp(-((distance / 0.03) ** 2)) * np.clip(turn, 0.0, 1.0) * stands
    wrap = (4.0 * ready - 1.0) * fields["motors"][:, 0, 0]
    lift = 30.0 * np.clip(rise(fields), -FALLEN_M, LARGEST_RISE_M)
    found: Array = reach + turn + wrap + lift
    return found


def reward(step: Transition) -> Array:
    """Return the rewards of a step, (N,): the task's, the gained potential, and a little for a lifted peg."""
    gained = potential(step.after) - potential(step.before)
    return step.rewards + gained + 0.02 * (rise(step.after) > LIFTED_M)


def observe(fields: dict[str, Any]) -> Array:
    """Return the observations, (N, 38), each number of about the size 1."""
    to_grip, turn = way(fields), turns(fields)
    episode_s = STEPS * TICKS * 0.01
    return np.hstack(
        [
            8.0 * to_grip,
            np.linalg.norm(to_grip, axis=1, keepdims=True),
            turn[:, 0],
            turn[:, 2],
            4.0 * fields["base"][:, 2:3],
            fields["motors"][:, 0, [1, 3]],  # Position and tension.
            fields["joints"][:, 0],
            fields["wrist"][:, :3] / 5.0,  # Force.
            10.0 * rise(fields)[:, np.newaxis],
            fields["objects"][:, PEG, 9:10],  # Vertical velocity.
            (fields["time_left"] - 120.0) / episode_s + 1.0,
        ]
    )


def starts() -> list[State]:
    """Return states of a scripted grasp in a few scenes: three of its beginning to five of the rest."""
    from palmares.sim import Batch, State

    batch = Batch(TASK, HAND, len(SHOWN_SEEDS), base="pose")
    begin = batch.reset(SHOWN_SEEDS)["base"]
    # Palm towards −x, thumb up, fingers towards +y.
    turned = np.tile([0.0, SQUARE, SQUARE, 0.0], (len(begin), 1))
    turn = turns({"base": np.hstack([begin[:, :3], turned, begin[:, 7:]])})
    at = batch.state().objects[:, PEG, :3] + [0.0, 0.0, GRIP_M] - turn @ IN_HAND_M
    found = [batch.state()] * 3

    def go(to: Array, sigma: float, seconds: float) -> None:
        begun, ticks = batch.observe()["base"][:, :3], int(seconds / batch.tick_s)
        for part in np.linspace(0.0, 1.0, ticks // TICKS + 1)[1:]:
            pose = np.hstack([begun + part * (to - begun), turned, np.full((len(to), 1), sigma)])
            batch.step(pose, TICKS)
        found.append(batch.state())

    go(0.5 * (begin[:, :3] + at), 0.0, 1.5)
    go(at, 0.0, 1.5)
    go(at, 0.5, 0.7)
    go(at, 1.0, 1.0)
    go(at + np.array([0.0, 0.0, 0.04]), 1.0, 0.5)
    rows = [(state, k) for state in found for k in range(len(begin))]
    names = ("base", "q", "joint_velocity", "motors", "objects", "tension")
    return [State(**{name: getattr(state, name)[k] for name in names}) for state, k in rows]


@dataclass(frozen=True)
class Point:
    """A point of the learning curve."""

    update: int
    episodes: int
    """Episodes of the training up to here"""
    reward: float
    """Mean sum of an episode's rewards, of the last 64, with exploration"""
    lifted: float | None
    """Share of 20 other scenes at whose end the peg is lifted, without exploration, with long steps; ``None``
    if this update was not tested"""


@dataclass(frozen=True)
class Learned:
    """Outcome of a training."""

    seed: int
    curve: list[Point]
    rises: list[float]
    """Rise of the peg at the end of each test episode, m"""
    scores: list[float]
    """Score of each test episode"""
    cpu_s: float
    """CPU time of training and test, s"""


def train(
    seed: int,
    *,
    updates: int = UPDATES,
    envs: int = 16,
    tests: int = 100,
    threads: int | None = None,
    on_point: Callable[[Point], None] = lambda _: None,
    policy: Path | None = None,
) -> Learned:
    """Train and test. The same arguments give the same curve on a machine, for any number of threads.

    Args:
        seed: Seed of the network, its exploration, and the scenes.
        updates: Updates of the policy, each from an episode of each environment.
        envs: Environments.
        tests: Test scenes.
        threads: Threads that simulate; one for each core when left out.
        on_point: Called with every point of the curve.
        policy: File for the policy, in the format of stable-baselines3.

    """
    try:
        import torch
        from stable_baselines3 import PPO

        from palmares.gym import Settings
        from palmares.sb3 import PalmaresVecEnv
    except ImportError:
        sys.exit("this needs stable-baselines3: pip install 'palmares[learn]'")
    torch.set_num_threads(1)
    begun_s = time.process_time()
    settings = Settings(
        reward=reward, observe=observe, action_scale=ACTION_SCALE, ticks=TICKS, threads=threads
    )
    env = PalmaresVecEnv(
        TASK,
        HAND,
        envs,
        settings=settings,
        step_ms=STEP_MS,
        max_episode_steps=STEPS,
        flat=True,
    )
    model = PPO(
        "MlpPolicy",
        env,
        n_steps=STEPS,
        batch_size=envs * STEPS // 4,
        n_epochs=10,
        learning_rate=1e-3,
        gamma=0.985,
        policy_kwargs={"log_std_init": -1.0},
        stats_window_size=64,
        seed=seed,
        device="cpu",
    )
    env.set_options({"state": starts()})
    curve = []
    for update in range(1, updates + 1):
        model.learn(STEPS * envs, reset_num_timesteps=False)
        returns = [episode["r"] for episode in model.ep_info_buffer]
        lifted = None
        if update % TEST_EVERY == 0:
            lifted = share_lifted(play(model, settings, FIRST_SEED_BETWEEN, 20, step_ms=STEP_MS)[0])
        curve.append(Point(update, envs * update, float(np.mean(returns)), lifted))
        on_point(curve[-1])
    if policy:
        model.save(policy)
    rises, scores = play(model, settings, FIRST_TEST_SEED, tests)
    return Learned(seed, curve, rises, scores, round(time.process_time() - begun_s, 1))


def share_lifted(rises: list[float]) -> float:
    """Return the share of episodes at whose end the peg is lifted."""
    return float(np.mean(np.array(rises) > LIFTED_M))


def play(
    model: Any, settings: Any, first_seed: int, count: int, **options: Any
) -> tuple[list[float], list[float]]:
    """Play an episode in each scene without exploration; return the rises of the peg and the scores."""
    from palmares.gym import BatchEnv

    env = BatchEnv(TASK, HAND, count, settings=settings, **options)
    observations, _ = env.reset(seed=first_seed)
    for _ in range(STEPS):
        actions, _ = model.predict(observations["observed"], deterministic=True)
        observations, *_ = env.step(actions)
    return rise(env.batch.observe()).tolist(), env.batch.scores.tolist()


def main() -> None:
    """Read the command line, train, and print what it learned."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1, help="seed of the training (default 1)")
    parser.add_argument("--updates", type=int, default=UPDATES, help=f"updates (default {UPDATES})")
    parser.add_argument("--envs", type=int, default=16, help="environments (default 16)")
    parser.add_argument("--tests", type=int, default=100, help="test scenes (default 100)")
    parser.add_argument("--threads", type=int, help="threads that simulate (default: one for each core)")
    parser.add_argument("--curve", type=output_file, help="file for the learning curve, JSON")
    parser.add_argument("--policy", type=output_file, help="file for the policy")
    args = vars(parser.parse_args())
    curve: Path | None = args.pop("curve")

    def show(point: Point) -> None:
        lifted = "" if point.lifted is None else f", lifted {100 * point.lifted:.0f} %"
        print(
            f"{time.process_time():5.0f} s, update {point.update}, reward {point.reward:.2f}{lifted}",
            flush=True,
        )

    learned = train(**args, on_point=show)
    print(
        f"{len(learned.rises)} unseen scenes: {100 * share_lifted(learned.rises):.0f} % lifted, "
        f"mean score {np.mean(learned.scores):.2f}, {learned.cpu_s:.0f} s of CPU time"
    )
    if curve:
        curve.write_text(json.dumps(asdict(learned)) + "\n")


if __name__ == "__main__":
    main()
