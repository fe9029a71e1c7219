"""Learn to lift the peg with a reward and an observation of your own, by PPO. Begin your own training here.

    pip install 'palmares[learn]'
    python train_peg_reward.py --seed 1 --policy peg.zip --curve peg.json

`reward` and `observe` are functions of arrays with a row for each environment; docs/training.md lists the
fields. The rest of the file calls PPO of stable-baselines3 (Schulman et al. 2017) in 16 environments, and
plays what it learned in scenes that it has not seen.

An episode has 60 actions of 0.1 s. Training has steps of 5 ms, the test the task's own of 1 ms.
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
STEPS, TICKS = 60, 10
"""Actions of an episode, and ticks of 10 ms of an action"""
# Velocities up to 0.24 m/s and 0.75 rad/s, and all of the motor's range.
ACTION_SCALE = (0.12, 0.12, 0.12, 0.25, 0.25, 0.25, 1.0)
UPDATES = 160
FIRST_TEST_SEED = 1_000_001


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
    # The hand shall be open until the peg stands between its fingers, and closed from then on.
    stands = rise(fields) > -FALLEN_M
    ready = np.exp(-((distance / 0.05) ** 2)) * np.clip(turn, 0.0, 1.0) * stands
    wrap = (4.0 * ready - 1.0) * fields["motors"][:, 0, 1]
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


@dataclass(frozen=True)
class Point:
    """A point of the learning curve: the last 64 episodes of the training, with exploration."""

    update: int
    episodes: int
    """Episodes up to here"""
    reward: float
    """Mean sum of an episode's rewards"""
    lifted: float
    """Share of the episodes in which the task counted the peg as lifted"""


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

    @property
    def lifted(self) -> float:
        """Share of the test episodes at whose end the peg is lifted."""
        return float(np.mean(np.array(self.rises) > LIFTED_M))


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
        step_ms=5,
        max_episode_steps=STEPS,
        flat=True,
        info_keywords=("score",),
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
    curve = []
    for update in range(1, updates + 1):
        model.learn(STEPS * envs, reset_num_timesteps=False)
        last = list(model.ep_info_buffer)
        # The first goal, a lifted peg, is one point.
        lifted = [episode["score"] >= 1.0 for episode in last]
        returns = [episode["r"] for episode in last]
        curve.append(Point(update, envs * update, float(np.mean(returns)), float(np.mean(lifted))))
        on_point(curve[-1])
    if policy:
        model.save(policy)
    rises, scores = play(model, settings, tests)
    return Learned(seed, curve, rises, scores, round(time.process_time() - begun_s, 1))


def play(model: Any, settings: Any, tests: int) -> tuple[list[float], list[float]]:
    """Play an episode in each test scene without exploration; return the rises of the peg and the scores."""
    from palmares.gym import BatchEnv

    env = BatchEnv(TASK, HAND, tests, settings=settings)
    observations, _ = env.reset(seed=FIRST_TEST_SEED)
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
        print(
            f"{time.process_time():5.0f} s, update {point.update}, reward {point.reward:.2f}, "
            f"lifted {100 * point.lifted:.0f} %",
            flush=True,
        )

    learned = train(**args, on_point=show)
    print(
        f"{len(learned.rises)} unseen scenes: {100 * learned.lifted:.0f} % lifted, "
        f"mean score {np.mean(learned.scores):.2f}, {learned.cpu_s:.0f} s of CPU time"
    )
    if curve:
        curve.write_text(json.dumps(asdict(learned)) + "\n")


if __name__ == "__main__":
    main()
