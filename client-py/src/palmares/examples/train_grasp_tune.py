"""Search the numbers of the SoftHand's grasp with Ray Tune, on this machine or on a Ray cluster.

    pip install 'ray[tune]'
    python train_grasp_tune.py --samples 40 --scenes 12

Each trial plays `grasp_softhand.py` with one grasp of its own numbers, scene after scene, and stops when it
is in the worse half of the trials with the same number of scenes. The best grasp is then compared with the
first one of `grasp_softhand.py` in other scenes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from dataclasses import replace
from statistics import fmean
from typing import Any

import palmares
from palmares.examples.grasp_softhand import ACROSS, run
from palmares.skills.cookbook import NARROW
from palmares.skills.grasps import TopGrasp

RANGES = {
    "pitch_rad": (1.4, 1.8),
    "roll_rad": (0.0, 0.6),
    "above_m": (-0.01, 0.03),
    "aside_m": (-0.02, 0.04),
    "along_m": (0.14, 0.21),
    "sigma_closed": (0.5, 1.0),
}
"""Ranges of the search, for fields of `TopGrasp`"""
UNSEEN = 1000
"""First seed of the final comparison; the search uses smaller seeds"""


def scores(grasp: TopGrasp, seeds: Iterable[int]) -> Iterable[float]:
    """Play the grasp in these scenes; yield the scores."""
    for seed in seeds:
        with palmares.Client("local") as client:
            yield run(client, seed, only=(grasp, ACROSS)).score


def trial(config: dict[str, Any], seeds: int) -> None:
    """Play one choice of numbers; report the mean score to Tune after every scene."""
    from ray import tune

    found: list[float] = []
    for score in scores(replace(NARROW, **config), range(1, seeds + 1)):
        found.append(score)
        tune.report({"score": fmean(found)})


def search(options: argparse.Namespace) -> tuple[dict[str, Any], float]:
    """Return the best numbers, and their mean score in the scenes of the search."""
    from ray import tune
    from ray.tune.schedulers import ASHAScheduler
    from ray.tune.search.basic_variant import BasicVariantGenerator

    space: dict[str, Any] = {name: tune.uniform(*bounds) for name, bounds in RANGES.items()}
    config = tune.TuneConfig(
        metric="score",
        mode="max",
        num_samples=options.samples,
        search_alg=BasicVariantGenerator(random_state=options.seed),
        scheduler=ASHAScheduler(
            max_t=options.scenes, grace_period=max(1, options.scenes // 4), reduction_factor=2
        ),
    )
    tuner = tune.Tuner(
        tune.with_parameters(trial, seeds=options.scenes),
        param_space=space,
        tune_config=config,
        run_config=tune.RunConfig(
            storage_path=options.folder, verbose=1, failure_config=tune.FailureConfig(max_failures=3)
        ),
    )
    # A stopped trial has fewer scenes than the others, so its mean does not compare.
    whole = [
        result
        for result in tuner.fit()
        if result.metrics and result.metrics["training_iteration"] == options.scenes
    ]
    best = max(whole, key=lambda result: result.metrics["score"])
    return best.config, best.metrics["score"]


def main(arguments: list[str] | None = None) -> int:
    """Search and print the best numbers."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--samples", type=int, default=40, help="trials (default 40)")
    parser.add_argument("--scenes", type=int, default=12, help="scenes of a trial (default 12)")
    parser.add_argument("--seeds", type=int, dest="scenes", default=argparse.SUPPRESS, help=argparse.SUPPRESS)
    parser.add_argument("--unseen", type=int, default=20, help="scenes of the final comparison (default 20)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the trials (default 1)")
    parser.add_argument("--address", help="Ray cluster (default: that of this machine, or a new one)")
    parser.add_argument("--folder", help="folder of Tune's records (default: ~/ray_results)")
    options = parser.parse_args(arguments)
    try:
        import ray
        import ray.tune
    except ImportError:
        print("this needs Ray Tune: pip install 'ray[tune]'", file=sys.stderr)
        return 1
    if not ray.is_initialized():
        ray.init(options.address)
    config, score = search(options)
    unseen = range(UNSEEN, UNSEEN + options.unseen)
    print(f"best numbers, {score:.2f} in the scenes of the search:")
    for name, value in config.items():
        print(f"    {name}={value:.4f},")
    found, before = (fmean(scores(grasp, unseen)) for grasp in (replace(NARROW, **config), NARROW))
    print(f"in {options.unseen} other scenes: {found:.2f}; the example's grasp: {before:.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
