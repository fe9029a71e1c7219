"""Let Ray Tune search the numbers of the SoftHand's grasp, here or on all machines of a Ray cluster.

    pip install 'ray[tune]'
    python train_grasp_tune.py --samples 40 --scenes 12

Each trial plays `grasp_softhand.py` with one grasp of other numbers, scene after scene, and is given up when
it is among the worse half of those that came as far. What is found is then played in scenes that the search
has not seen, beside the grasp that `grasp_softhand.py` tries first.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from dataclasses import replace
from statistics import fmean
from typing import Any

import palmares
from palmares.examples.grasp_softhand import ACROSS, NARROW, run
from palmares.skills.grasps import TopGrasp

RANGES = {
    "pitch_rad": (1.4, 1.8),
    "roll_rad": (0.0, 0.6),
    "above_m": (-0.01, 0.03),
    "aside_m": (-0.02, 0.04),
    "along_m": (0.14, 0.21),
    "sigma_closed": (0.5, 1.0),
}
"""Where to search, for fields of `TopGrasp`"""
UNSEEN = 1000
"""Seeds from here on are not searched with"""


def scores(grasp: TopGrasp, seeds: Iterable[int]) -> Iterable[float]:
    """Play the grasp in these scenes; yield the scores."""
    for seed in seeds:
        with palmares.Client("local") as client:
            yield run(client, seed, only=(grasp, ACROSS)).score


def trial(config: dict[str, Any], seeds: int) -> None:
    """Play one choice of numbers; tell Tune the mean score after every scene."""
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
            max_t=options.scenes, grace_period=max(1, options.seeds // 4), reduction_factor=2
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
    # A trial that was given up knows fewer scenes than the others: its mean is not theirs.
    whole = [
        result
        for result in tuner.fit()
        if result.metrics and result.metrics["training_iteration"] == options.scenes
    ]
    best = max(whole, key=lambda result: result.metrics["score"])
    return best.config, best.metrics["score"]


def main(arguments: list[str] | None = None) -> int:
    """Search, and tell what was found."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--samples", type=int, default=40, help="choices of numbers (default 40)")
    parser.add_argument("--scenes", type=int, default=12, help="scenes of a trial (default 12)")
    parser.add_argument("--seeds", type=int, dest="scenes", default=argparse.SUPPRESS, help=argparse.SUPPRESS)
    parser.add_argument("--unseen", type=int, default=20, help="scenes to compare in afterwards (default 20)")
    parser.add_argument("--seed", type=int, default=1, help="of the choices (default 1)")
    parser.add_argument("--address", help="of a Ray cluster (default: this machine's, or one of its own)")
    parser.add_argument("--folder", help="where Tune keeps its notes (default: ~/ray_results)")
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
    print(f"found, {score:.2f} in the scenes of the search:")
    for name, value in config.items():
        print(f"    {name}={value:.4f},")
    found, before = (fmean(scores(grasp, unseen)) for grasp in (replace(NARROW, **config), NARROW))
    print(f"in {options.unseen} scenes it has not seen: {found:.2f}; the example's grasp: {before:.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
