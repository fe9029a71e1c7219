"""Learn with PPO to lift and hold objects by sensors alone, and test it on other objects.

    pip install 'palmares[learn]'
    python train_lift_sb3.py --seed 1 --curve curve.json --policy policy.zip

A depth camera at the table takes an image before the run begins: the policy receives the smallest upright box
around the object. After that it receives the base's pose, the motor, force and torque at the wrist, all with
the noise of real sensors. It decides four times in a run:

0. above the object: pitch, roll, position and opening of the hand
1. on the object: shift of the hand, and closing of the fingers
2. with the fingers closed: further closing; then the hand lifts
3. in the air: force of the hold; then the referee waits 2 s, and shakes

Between decisions the hand moves along smoothsteps. The reward is the change of the referee's score; neither
policy nor training use anything else of the simulator's truth. Training has long steps of the integration,
the test the task's own. PPO (Schulman et al. 2017) is that of stable-baselines3.
"""

from __future__ import annotations

import itertools
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from palmares import Training
from palmares.arrays import Array, array
from palmares.examples._grasp_runs import (
    HAND,
    STEP_MS,
    TASK,
    Hands,
    rot_zyz,
    rotated,
    test_scenes,
    training_scenes,
    yaw_across,
)
from palmares.examples._training import Learned, Mask, OnPoint, learn, main, vec_env
from palmares.examples.grasp_sensors import find_object
from palmares.examples.train_grasp_cem import CLOSE_S, GRIP_S, LIFT_S
from palmares.sim import Batch, World
from palmares.skills.motion import UP

DECISIONS = 4
"""Decisions of a run"""
ACTIONS = 7
"""Numbers of an action, −1 to 1; each decision uses some of pitch, roll, above, aside, along, open, closed"""
OBSERVATIONS = 21
"""Numbers of an observation"""
START = array([1.77, 0.09, 0.0, 0.025, 0.22, 0.05, 0.9])
"""Numbers for an action of 0, a guess: between the grips of a ball and of a can in docs/cookbook.md"""
RANGE = array([0.2, 0.3, 0.02, 0.02, 0.03, 0.05, 0.1])
"""Change of the numbers for an action of ±1, rad, m and σ"""
SHIFT_M, SQUEEZE = 0.02, 0.3
"""Largest shift of the hand in decision 1, along each of its axes; largest change of σ in 2 and 3"""
SINK_M, LIFT_M = 0.10, 0.16
"""Height above the grasp at which the hand stops, and height of the lift"""
CAMERA = "table"
TABLE_M, BELOW_HAND_M = 0.0, 0.25
"""Heights between which points belong to the object"""
REWARD = 0.1
"""Reward for a point of the score"""
TENSION = 2.0
"""Typical tension with an object in the hand, in the tendon's unit"""


@dataclass(frozen=True)
class ObjectBox:
    """The upright box around the object in the camera's image."""

    middle: Array
    """(3,), m"""
    size: Array
    """(3,): along `yaw_rad`, across and up, m"""
    yaw_rad: float


@lru_cache(maxsize=1000)
def look(seed: int) -> ObjectBox:
    """Return the box around the object in this scene at the beginning."""
    world = World(TASK, HAND, seed, sensing="sensors", noise="real")
    points = world.observe(cameras=[CAMERA]).cameras[CAMERA].points().reshape(-1, 3)
    # The hand is above the table, too.
    found = find_object(points[points[:, 2] < BELOW_HAND_M], TABLE_M)
    if found is None:
        raise ValueError(f"seed {seed}: the image of {CAMERA!r} shows no object")
    return ObjectBox(found.bounds.middle, found.bounds.high - found.bounds.low, found.yaw_rad)


class Decisions:
    """Runs of the grasp task as four decisions each, in N worlds at once.

    Attributes:
        batch: The worlds.
        finished: Mean score of the runs that ended together, oldest first.

    Args:
        count: N.
        scenes: The seeds to play, one after another.
        threads: As for `palmares.sim.Batch`.
        step_ms: As for `Training`.

    """

    def __init__(
        self, count: int, scenes: Iterator[int], threads: int | None = None, step_ms: float | None = None
    ) -> None:
        training = Training(step_ms=step_ms)
        self.batch = Batch(
            TASK, HAND, count, sensing="sensors", noise="real", threads=threads, training=training
        )
        self._hands, self._scenes = Hands(self.batch), scenes
        self.finished: list[float] = []

    def reset(self) -> Array:
        """Open runs in the next N scenes; return the observations (N, 21)."""
        seeds = [next(self._scenes) for _ in range(self.batch.count)]
        boxes = [look(seed) for seed in seeds]
        self._hands.reset(seeds)
        self._middle = np.stack([box.middle for box in boxes])
        self._size = np.stack([box.size for box in boxes])
        self._yaw = yaw_across(array([box.yaw_rad for box in boxes]), self._size)
        self._empty = self._hands.obs["wrist"]
        self._decision, self._scores = 0, np.zeros(self.batch.count)
        return self._observe()

    def step(self, actions: Array) -> tuple[Array, Array, bool]:
        """Play a decision (N, 7); return observations (N, 21), rewards (N,) and whether the runs are over."""
        {0: self._approach, 1: self._close, 2: self._lift, 3: self._hold}[self._decision](actions)
        rewards, self._scores = self.batch.scores - self._scores, self.batch.scores
        self._decision += 1
        if self._decision == DECISIONS:
            self.finished.append(float(self._scores.mean()))
        return self._observe(), rewards, self._decision == DECISIONS

    def _approach(self, actions: Array) -> None:
        hands = self._hands
        pitch, roll, above, aside, along, sigma_open, _ = (START + RANGE * actions).T
        rotation = rot_zyz(math.pi / 2 + self._yaw, pitch, roll)
        in_hand = np.stack([self._size[:, 2] / 2 + above, aside, along], axis=1)
        at = self._middle - rotated(rotation, in_hand)
        hands.to(2.0, at + SINK_M * UP, rotation, sigma_open)
        self._empty = self._read_wrist()
        hands.to(0.4, at)

    def _close(self, actions: Array) -> None:
        hands = self._hands
        shift = rotated(hands.quat_xyzw, SHIFT_M * actions[:, :3])
        hands.to(CLOSE_S, hands.position + shift, sigma=START[6] + RANGE[6] * actions[:, 6])
        hands.wait(GRIP_S)

    def _lift(self, actions: Array) -> None:
        hands = self._hands
        hands.to(LIFT_S, hands.position + LIFT_M * UP, sigma=self._squeezed(actions))
        # Runs without a point end here.
        hands.active &= self.batch.scores > 0.0

    def _hold(self, actions: Array) -> None:
        self._hands.to(0.2, sigma=self._squeezed(actions))
        for _ in range(11):
            self._hands.wait(0.5)

    def _squeezed(self, actions: Array) -> Array:
        return np.clip(self._hands.sigma + SQUEEZE * actions[:, 6], 0.0, 1.0)

    def _read_wrist(self) -> Array:
        """Return force and torque at the wrist, mean of 0.1 s, (N, 6)."""
        readings = [self._hands.wait(0.02)["wrist"] for _ in range(5)]
        return array(np.mean(readings, axis=0))

    def _observe(self) -> Array:
        """Return the observations (N, 21), each number with about unit variance."""
        obs = self._hands.obs
        which = np.zeros((self.batch.count, DECISIONS))
        which[:, min(self._decision, DECISIONS - 1)] = 1.0
        # Larger objects than those of the training saturate.
        size = np.tanh((self._size - [0.09, 0.07, 0.09]) / [0.02, 0.02, 0.03])
        from_hand = obs["base"][:, 3:7] * [-1.0, -1.0, -1.0, 1.0]
        top = self._middle + 0.5 * self._size[:, 2:] * UP
        off = rotated(from_hand, top - obs["base"][:, :3]) / 0.1
        up = rotated(from_hand, np.tile(UP, (self.batch.count, 1)))
        wrench = obs["wrist"] - self._empty
        force, torque = rotated(from_hand, wrench[:, :3]), rotated(from_hand, wrench[:, 3:])
        # The range is from the weight of an orange to the force of the palm.
        load = np.arcsinh(np.hstack([force, torque]) / [1.0, 1.0, 1.0, 0.1, 0.1, 0.1])
        motor = obs["motors"][:, 0, [1, 3]] / [1.0, TENSION]
        return np.hstack([which, size, off, up, motor, load])


def as_vec_env(decisions: Decisions) -> Any:
    """Return decisions as an environment of stable-baselines3; when the runs are over, others begin."""

    def step(actions: Array) -> tuple[Array, Array, Array, Mask, Mask]:
        last, rewards, over = decisions.step(actions)
        now = decisions.reset() if over else last
        ended = np.full(len(rewards), over)
        return now, last, REWARD * rewards, ended, np.zeros_like(ended)

    return vec_env(decisions.batch.count, OBSERVATIONS, ACTIONS, decisions.reset, step)


def play(model: Any, decisions: Decisions) -> float:
    """Play a run in each world without exploration; return the mean score."""
    obs, over = decisions.reset(), False
    while not over:
        actions, _ = model.predict(obs, deterministic=True)
        obs, _, over = decisions.step(actions)
    return decisions.finished[-1]


def train(
    seed: int,
    *,
    updates: int = 16,
    worlds: int = 32,
    tests: int = 100,
    test_every: int | None = None,
    threads: int | None = None,
    on_point: OnPoint = lambda _: None,
    policy: Path | None = None,
) -> Learned:
    """Train. The same arguments give the same curve on a machine, for any number of threads of the worlds.

    Args:
        seed: Seed of the network, its exploration, and the scenes.
        updates: Number of updates of the policy.
        worlds: Runs played together; an update learns from two in each world.
        tests: Test scenes, in which the policy is played after every `test_every` updates.
        test_every: See `tests`; without it the policy is tested after the last update alone.
        threads: As for `palmares.sim.Batch`.
        on_point: Called with every point of the curve.
        policy: File for the policy, in the format of stable-baselines3.

    """
    try:
        from stable_baselines3 import PPO
    except ImportError:
        sys.exit("this needs stable-baselines3: pip install 'palmares[learn]'")
    scenes = itertools.chain.from_iterable(training_scenes(np.random.default_rng(seed)))
    learning = Decisions(worlds, scenes, threads, STEP_MS)
    testing = Decisions(tests, itertools.cycle(test_scenes(tests)), threads)
    steps = 2 * DECISIONS
    model = PPO(
        "MlpPolicy",
        as_vec_env(learning),
        n_steps=steps,
        batch_size=worlds * steps // 4,
        n_epochs=10,
        learning_rate=1e-3,
        gamma=1.0,
        policy_kwargs={"log_std_init": -1.0},
        seed=seed,
        device="cpu",
    )

    def improve() -> float:
        model.learn(worlds * steps, reset_num_timesteps=False)
        return float(np.mean(learning.finished[-2:]))

    curve = learn(
        improve,
        lambda: play(model, testing),
        updates=updates,
        episodes=2 * worlds,
        test_every=test_every,
        on_point=on_point,
    )
    if policy:
        model.save(policy)
    return Learned(seed, curve, testing.batch.scores.tolist())


if __name__ == "__main__":
    main(train, __doc__, updates=16)
