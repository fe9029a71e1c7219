"""Learn to lift and hold objects with PPO or SAC by the task's shaped rewards, and test on other objects.

    pip install 'palmares[learn]'
    python train_lift_shaped.py --learner sac --seed 1 --curve curve.json --policy policy.zip

A run begins with the open hand 10 cm above `GUESS`, a rough guess of the grasp. Every half second the policy
decides how far the hand moves, up to 8 cm, and how far it closes or opens; with an action of zero it stays.
It sees the truth: poses, motor and contact.

The reward is the change of the score and of the potential Φ that ``tasks/grasp/task.toml`` declares, with
``discount=1.0``: with the learner's own discount a critic that knows Φ cancels the shaped part
(docs/training.md). With ``--no-shaping`` it is the change of the score alone. With ``--curriculum`` runs
begin late in the guessed grasp, and earlier as the score grows.

Training has long steps of the integration; the test has the task's own, too. PPO (Schulman et al. 2017) and
SAC (Haarnoja et al. 2018) are those of stable-baselines3.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from palmares import Training
from palmares.arrays import Array, array
from palmares.examples._grasp_runs import (
    HAND,
    STEP_MS,
    TASK,
    rot_zyz,
    rotated,
    test_scenes,
    training_scenes,
    yaw_across,
)
from palmares.examples._training import Learned, Mask, OnPoint, learn, main, vec_env
from palmares.sim import Batch, Snapshot
from palmares.skills.motion import UP

GUESS = array([1.7, 0.1, 0.01, 0.01, 0.2])
"""Pitch, roll, above, aside and along as in ``train_grasp_cem``: the palm 1 cm over the object, about
horizontal, the object's middle 20 cm from the wrist"""
SINK_M = 0.1
"""Height above the guess of the start"""
DECISIONS, TEST_DECISIONS = 12, 26
"""Decisions of a run in training, 6 s, and in the test, which ends with the shake"""
TICKS, APPROACH_TICKS = 50, 120
"""Ticks of a decision, and of the way to the start"""
ACTIONS = 4
"""Numbers of an action, −1 to 1: along the fingers, across them, up, and closing"""
LARGEST = array([0.02, 0.02, 0.08, 0.5])
"""Change of the targets for an action of ±1, m and σ"""
LEAST, MOST = array([-0.05, -0.05, -0.04, 0.0]), array([0.05, 0.05, 0.16, 1.0])
"""Bounds of the targets, from the guess"""
OBSERVATIONS = 19
"""Numbers of an observation"""
STAGES = ((0.0, 0.75), (0.0, 0.4), (0.0, 0.05), (SINK_M / 2, 0.05), (SINK_M, 0.05))
"""Height above the guess, m, and σ in which runs begin: the last stage without, all with a curriculum"""
PASSED, WINDOW = 0.5, 64
"""The curriculum adds a stage at this mean score of that many runs"""
NEWEST = 0.6
"""Share of the runs that begin in the stage added last; the others begin in any"""
LOST_M = 0.15
"""An object this far from its place, or this far below, is lost, and the run over"""
TENSION = 2.0
"""Typical tension with an object in the hand, in the tendon's unit"""
SAC_STEPS = 20
"""Steps of SAC's optimisers for each decision of all worlds"""

Learner = Literal["ppo", "sac"]
UPDATES: dict[Learner, int] = {"ppo": 32, "sac": 20}
"""Updates of a training"""


class Lifts:
    """Runs of the grasp task as decisions, in N worlds; a world begins another run when one is over.

    Attributes:
        batch: The worlds.
        finished: Scores of the runs that are over, oldest first.
        stages: Number of stages in which runs begin, the latest ones.

    Args:
        count: N.
        seeds: The scenes.
        rng: Draws scene and stage of a run; without it world k plays scene k once, and a run without a point
            after 6 s is over.
        shaping: Rewards contain the shaped part.
        curriculum: Runs begin in the latest of `STAGES`, and also in earlier ones as the score grows.
        step_ms, threads: As of `Training` and `Batch`.

    """

    def __init__(
        self,
        count: int,
        seeds: Sequence[int],
        rng: np.random.Generator | None = None,
        *,
        shaping: bool = True,
        curriculum: bool = False,
        step_ms: float | None = None,
        threads: int | None = None,
    ) -> None:
        training = Training(shaping=True, discount=1.0, step_ms=step_ms)
        self.batch = Batch(TASK, HAND, count, base="pose", threads=threads, training=training)
        self.finished: list[float] = []
        self.stages, self._rng, self._shaping = 1, rng, shaping
        self._seeds, self._stages = list(seeds), STAGES if curriculum else STAGES[-1:]
        self._judged = 0
        self._prepare()
        self._scene, self._decided = np.arange(count) % len(self._seeds), np.zeros(count, dtype=int)
        self._sent, self._plays = np.zeros((count, ACTIONS)), np.ones(count, dtype=bool)

    def _prepare(self) -> None:
        """Keep snapshots of all scenes: the hand moves to the last stage, and from there to the first."""
        self._snapshots: list[list[Snapshot]] = [[] for _ in self._stages]
        kept: list[list[Array]] = []
        count, stages = self.batch.count, self._stages
        for first in range(0, len(self._seeds), count):
            some = self._seeds[first : first + count]
            fields = self.batch.reset(some + some[-1:] * (count - len(some)))
            middle, quat = fields["objects"][:, 0, :3], fields["objects"][:, 0, 3:7]
            size = 2.0 * fields["object_half_extents"][:, 0]
            # Objects stand upright: their pose is a turn about z.
            yaw = math.pi / 2 + yaw_across(2.0 * np.arctan2(quat[:, 2], quat[:, 3]), size)
            pitch, roll, above, aside, along = np.tile(GUESS, (count, 1)).T
            hand = rot_zyz(yaw, pitch, roll)
            guess = middle - rotated(hand, np.stack([size[:, 2] / 2 + above, aside, along], axis=1))
            kept.append([middle, size, guess, hand, rot_zyz(yaw, 0.0 * yaw, 0.0 * yaw)])
            # The hand turns high above the object.
            self._send(guess + 2.5 * SINK_M * UP, hand, 0.0, APPROACH_TICKS)
            for stage in reversed(range(len(stages))):
                height_m, sigma = stages[stage]
                self._send(guess + height_m * UP, hand, sigma, APPROACH_TICKS)
                self._snapshots[stage] += [self.batch.snapshot(k) for k in range(len(some))]
        arrays = [np.concatenate(parts)[: len(self._seeds)] for parts in zip(*kept, strict=True)]
        self._places, self._sizes, self._guesses, self._hands, self._turns = arrays

    def _send(self, place: Array, hand: Array, sigma: float, ticks: int) -> None:
        self.batch.step(np.hstack([place, hand, np.full((len(place), 1), sigma)]), ticks)

    def reset(self) -> Array:
        """Begin a run in every world; return the observations (N, 19)."""
        self._plays[:] = True
        self._begin(self._plays)
        return self._observe()

    def step(self, actions: Array) -> tuple[Array, Array, Array, Mask, Mask]:
        """Play a decision (N, 4) in every world.

        Returns observations (N, 19), those before the next run began where one is over (N, 19), rewards (N,),
        and whether runs ended and whether they were cut short (N,).
        """
        scene = self._scene
        self._sent = np.clip(self._sent + LARGEST * np.clip(actions, -1.0, 1.0), LEAST, MOST)
        at = self._guesses[scene] + rotated(self._turns[scene], self._sent[:, :3])
        target = np.hstack([at, self._hands[scene], self._sent[:, 3:]])
        stepped = self.batch.step(target, TICKS, self._plays)
        self._decided += 1
        off = stepped.observations["objects"][:, 0, :3] - self._places[scene]
        lost = (np.abs(off[:, :2]).max(axis=1) > LOST_M) | (off[:, 2] < -LOST_M)
        lost &= ~stepped.terminated
        rewards = stepped.rewards
        if self._shaping and stepped.shaping is not None:
            # A lost object is an end for the learner alone, so that it takes the potential back.
            potential = np.sum(list((self.batch.potential or {}).values()), axis=0)
            rewards = rewards + stepped.shaping - np.where(lost, potential, 0.0)
        rewards = np.where(self._plays, rewards, 0.0)
        ended, now = stepped.terminated | lost, self._observe()
        if self._rng is None:
            hopeless = (self._decided >= DECISIONS) & (self.batch.scores == 0.0)
            self._plays &= ~(ended | stepped.truncated | hopeless)
            return now, now, rewards, ended, stepped.truncated
        short = ~ended & (stepped.truncated | (self._decided == DECISIONS))
        over = ended | short
        if not over.any():
            return now, now, rewards, ended, short
        self.finished += self.batch.scores[over].tolist()
        self._widen()
        self._begin(over)
        return self._observe(), now, rewards, ended, short

    def _begin(self, over: Mask) -> None:
        """Begin a run in these worlds."""
        for world in np.flatnonzero(over):
            stage = len(self._stages) - 1
            if self._rng is not None:
                stage = int(self._rng.integers(self.stages))
                if self.stages > 1 and self._rng.random() < NEWEST:
                    stage = self.stages - 1
                self._scene[world] = self._rng.integers(len(self._seeds))
            self.batch.restore(int(world), self._snapshots[stage][self._scene[world]])
            self._sent[world] = [0.0, 0.0, *self._stages[stage]]
        self._decided[over] = 0

    def _widen(self) -> None:
        """Let runs begin one stage earlier, too, if those since the last such change were good."""
        last = self.finished[self._judged :][-WINDOW:]
        if self.stages < len(self._stages) and len(last) == WINDOW and np.mean(last) >= PASSED:
            self.stages += 1
            self._judged = len(self.finished)

    def _observe(self) -> Array:
        """Return the observations (N, 19), each number with about unit variance."""
        fields, scene = self.batch.observe(), self._scene
        back = self._turns[scene] * [-1.0, -1.0, -1.0, 1.0]
        base, motor = fields["base"], fields["motors"][:, 0]
        off = rotated(back, base[:, :3] - self._guesses[scene])
        moved = rotated(back, fields["objects"][:, 0, :3] - self._places[scene])
        contact = (self.batch.potential or {})["contact"]
        return np.hstack(
            [
                off / 0.05,
                (self._sent[:, :3] - off) / 0.02,
                moved / 0.05,
                (moved - off) / 0.05,
                2.0 * self._sent[:, 3:] - 1.0,
                2.0 * motor[:, :1] - 1.0,
                motor[:, 3:] / TENSION,
                (self._sizes[scene] - [0.09, 0.07, 0.09]) / [0.02, 0.02, 0.03],
                4.0 * contact[:, np.newaxis] - 1.0,
            ]
        )


def play(model: Any, lifts: Lifts) -> list[float]:
    """Play a run in each world without exploration; return the scores."""
    observations = lifts.reset()
    for _ in range(TEST_DECISIONS):
        observations = lifts.step(model.predict(observations, deterministic=True)[0])[0]
    return [float(score) for score in lifts.batch.scores]


def learner_of(name: Learner, env: Any, seed: int) -> Any:
    """Return a learner of stable-baselines3."""
    from stable_baselines3 import PPO, SAC

    if name == "sac":
        return SAC(
            "MlpPolicy",
            env,
            learning_rate=1e-3,
            gamma=0.95,
            learning_starts=env.num_envs * DECISIONS,
            train_freq=DECISIONS,
            gradient_steps=SAC_STEPS * DECISIONS,
            # A run has about one point: at larger temperatures the policy stays random.
            ent_coef="auto_0.02",
            # Exploration that lasts as long as a run (gSDE, Raffin et al. 2022) finds the way up, which takes
            # several decisions with the fingers closed.
            use_sde=True,
            use_sde_at_warmup=True,
            policy_kwargs={"net_arch": [64, 64], "log_std_init": -1.0},
            seed=seed,
            device="cpu",
        )
    return PPO(
        "MlpPolicy",
        env,
        n_steps=DECISIONS,
        batch_size=env.num_envs * DECISIONS // 4,
        n_epochs=10,
        learning_rate=1e-3,
        gamma=0.97,
        policy_kwargs={"log_std_init": -1.0},
        seed=seed,
        device="cpu",
    )


def train(
    seed: int,
    *,
    learner: Learner = "ppo",
    shaping: bool = True,
    curriculum: bool = False,
    updates: int | None = None,
    worlds: int = 64,
    scenes: int = 10,
    tests: int = 100,
    coarse_tests: int = 25,
    threads: int | None = None,
    on_point: OnPoint = lambda _: None,
    policy: Path | None = None,
) -> Learned:
    """Train. The same arguments give the same curve on a machine, for any number of threads of the worlds.

    Args:
        seed: Seed of the network, its exploration, and the scenes.
        learner: ``ppo`` or ``sac``.
        shaping: The reward contains the shaped part.
        curriculum: Runs begin late in the guessed grasp, and earlier as the score grows.
        updates: Number of updates, by default `UPDATES`; in each every world plays `DECISIONS` decisions.
        worlds: Worlds stepped together.
        scenes: Scenes of each object in training.
        tests: Test scenes after the last update, with the task's own steps.
        coarse_tests: Test scenes, the first of these, also played with the training's long steps.
        threads: As for `palmares.sim.Batch`.
        on_point: Called with every point of the curve.
        policy: File for the policy, in the format of stable-baselines3.

    """
    try:
        import torch
        from stable_baselines3.common.utils import set_random_seed
    except ImportError:
        sys.exit("this needs stable-baselines3: pip install 'palmares[learn]'")
    torch.set_num_threads(1)
    set_random_seed(seed)
    rng = np.random.default_rng(seed)
    drawn = training_scenes(rng)
    seeds = list(itertools.chain.from_iterable(itertools.islice(drawn, scenes)))
    lifts = Lifts(
        worlds, seeds, rng, shaping=shaping, curriculum=curriculum, step_ms=STEP_MS, threads=threads
    )
    env = vec_env(worlds, OBSERVATIONS, ACTIONS, lifts.reset, lifts.step)
    model = learner_of(learner, env, seed)
    scores: list[float] = []

    def improve() -> float:
        before = len(lifts.finished)
        model.learn(worlds * DECISIONS, reset_num_timesteps=False)
        return float(np.mean(lifts.finished[before:] or [0.0]))

    def test() -> float:
        scores[:] = play(model, Lifts(tests, test_scenes(tests), threads=threads))
        return float(np.mean(scores))

    curve = learn(
        improve,
        test,
        updates=UPDATES[learner] if updates is None else updates,
        episodes=lambda: len(lifts.finished),
        test_every=None,
        on_point=on_point,
    )
    coarse = Lifts(coarse_tests, test_scenes(coarse_tests), step_ms=STEP_MS, threads=threads)
    if policy:
        model.save(policy)
    return Learned(seed, curve, scores, play(model, coarse))


def options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this example."""
    parser.add_argument("--learner", choices=get_args(Learner), default="ppo", help="default ppo")
    parser.add_argument("--no-shaping", dest="shaping", action="store_false", help="the score alone")
    parser.add_argument("--curriculum", action="store_true", help="runs begin late in the guessed grasp")


if __name__ == "__main__":
    main(train, __doc__, updates=None, options=options)
