"""Plan in the simulator: model predictive path integral control of the SoftHand, from snapshots of the run.

    python -m palmares.examples.mppi_grasp --seed 5

Every 0.2 s a batch of worlds continues from a snapshot of the run, each with its own disturbed plan. The
plans are averaged, those of small cost with large weight (Williams et al. 2017, *Information theoretic MPC
for model-based reinforcement learning*), and the run takes the first action of the average. The plans are
tried with long steps of the integration, the run has the task's own. The result is the same for any number
of threads.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import dataclass

import numpy as np

from palmares import Training
from palmares.arrays import Array
from palmares.reproducible import exp, log, matmul, mean, normal, norms, total
from palmares.rotation import matrix_of
from palmares.sim import Batch
from palmares.sim.batch import Stepped
from palmares.skills.motion import UP

TASK, HAND = "grasp", "softhand"
TICKS = 20
"""Ticks of an action: 0.2 s"""
STEP_MS = 5.0
"""Longest step with which plans are tried"""
LIMITS = np.array([0.4, 0.4, 0.4, 1.0, 1.0, 1.0, 1.0])
"""Largest velocities of the base, m/s and rad/s, and σ"""
SPREAD = np.array([0.24, 0.24, 0.24, 0.6, 0.6, 0.6, 0.3])
"""Standard deviation of the largest disturbances"""
LEAST = 0.15
"""That of the smallest, as a part of it: large ones find a way, small ones make it exact"""
GRASP_CENTRE = np.array([0.049, 0.010, 0.192])
"""Where the fingers close, in the base's frame, m: docs/teams.md has it for each hand"""
PALM = np.array([1.0, 0.0, 0.0])
"""Normal of the palm in the base's frame"""
COLDNESS = 0.15
"""Costs count relative to this part of their standard deviation"""
TURNED_M = 0.2
"""The hand aims this high above the object while its palm is horizontal, and lower the more it looks down"""
NEAR_M = 0.05
"""The hand closes within this distance"""


@dataclass
class Planner:
    """A plan, and worlds that try it out.

    Attributes:
        worlds: K worlds of the run's task and hand.
        plan: (H, 7), the next H actions.
        rng: Draws disturbances.
        height: Height of the object at the start, m.

    """

    worlds: Batch
    plan: Array
    rng: np.random.Generator
    height: float

    def improve(self, run: Batch) -> Array:
        """Improve the plan from the run's state; return its first action."""
        snapshot = run.snapshot(0)
        for world in range(self.worlds.count):
            self.worlds.restore(world, snapshot)
        steps = len(self.plan)
        # Each disturbance lasts two actions, which explores farther than one that changes at each.
        noise = np.repeat(normal(self.rng, self.worlds.count, (steps + 1) // 2, 7), 2, axis=1)
        noise[0] = 0.0
        shares = np.linspace(1.0, 0.0, self.worlds.count - 1).tolist()
        noise[1:] *= np.array([exp(share * log(LEAST)) for share in shares])[:, np.newaxis, np.newaxis]
        plans = np.clip(self.plan + noise[:, :steps] * SPREAD, -LIMITS, LIMITS)
        plans[..., 6] = plans[..., 6].clip(0.0, 1.0)
        costs = np.zeros(self.worlds.count)
        for step in range(steps):
            costs += self.cost(self.worlds.step(plans[:, step], TICKS)) * (2.0 if step == steps - 1 else 1.0)
        middle = total(costs) / len(costs)
        deviation = math.sqrt(total((costs - middle) * (costs - middle)) / len(costs))
        colder = (costs - costs.min()) / max(COLDNESS * deviation, 1e-6)
        weights = np.array([exp(-cost) for cost in colder.tolist()])
        self.plan = mean(weights[:, np.newaxis, np.newaxis] * plans) * (len(plans) / total(weights))
        first: Array = self.plan[0].copy()
        self.plan = np.vstack([self.plan[1:], self.plan[-1:]])
        return first

    def cost(self, stepped: Stepped) -> Array:
        """Return the cost of each world's state.

        The hand is far away, its palm not down, it closes too early, touches little; the object is not lifted
        or fast.
        """
        observed, touch = stepped.observations, (self.worlds.potential or {})["contact"]
        turns = np.array([matrix_of(quat) for quat in observed["base"][:, 3:7]])
        target = observed["objects"][:, 0]
        tilt = (1.0 + matmul(turns, PALM)[:, 2]).clip(0.0, 1.0)
        lifted = (target[:, 2] - self.height).clip(0.0, 0.15) * (touch > 0.2)
        aim = target[:, :3] + np.outer(TURNED_M * tilt * (lifted < 0.01), UP)
        distance = norms(observed["base"][:, :3] + matmul(turns, GRASP_CENTRE) - aim)
        early = observed["motors"][:, 0, 0] * (distance - NEAR_M).clip(0.0, 0.1)
        speed = norms(target[:, 7:10])
        cost: Array = 4.0 * distance + tilt + 10.0 * early - 3.0 * touch - 60.0 * lifted + 0.05 * speed
        return cost - 3.0 * stepped.rewards


def play(seed: int, worlds: int, horizon: int, limit_s: float, threads: int | None) -> tuple[float, float]:
    """Play a scene for at most `limit_s` of its time; return score and real-time factor of planning."""
    training = Training(shaping=True, discount=1.0, step_ms=STEP_MS)
    run = Batch(TASK, HAND, 1, threads=1)
    copies = Batch(TASK, HAND, worlds, threads=threads, training=training)
    observed = run.reset([seed])
    copies.reset([seed] * worlds)
    plan = np.zeros((horizon, 7))
    plan[:, 2] = -0.1
    planner = Planner(copies, plan, np.random.default_rng(seed), float(observed["objects"][0, 0, 2]))
    spent_s, time_s = 0.0, 0.0
    while time_s < limit_s and not run.done[0]:
        begun = time.perf_counter()
        action = planner.improve(run)
        spent_s += time.perf_counter() - begun
        run.step(action[np.newaxis], TICKS)
        time_s += TICKS * run.tick_s
    return float(run.scores[0]), time_s / spent_s


def main() -> None:
    """Play a scene and print the outcome."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--worlds", type=int, default=16, help="plans that are tried out each time")
    parser.add_argument("--horizon", type=int, default=5, help="actions of a plan, 0.2 s each")
    parser.add_argument("--limit", type=float, default=20.0, help="time of the run, s")
    parser.add_argument("--threads", type=int, help="one for each core when left out")
    options = parser.parse_args()
    score, factor = play(options.seed, options.worlds, options.horizon, options.limit, options.threads)
    print(
        f"seed {options.seed}: score {score:.2f}; planning ran {factor:.2f} times as fast as the scene's time"
    )


if __name__ == "__main__":
    main()
