"""Play every example controller as on other processors: its runs must end in the same states.

    python processors.py                      a whole run of each
    python processors.py --sim-s 2            the first 2 s of each run
    python processors.py --only grasp_sensors

NumPy's BLAS chooses its kernel by the processor, as do NumPy and the C library for sine and others. Variables
of the environment make them choose as on another processor. The exit code is 1 if a run does not end alike on
all of them. A kernel whose instructions this processor lacks is named, and not played.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import logging
import os
import subprocess
import sys
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

import palmares
from palmares.skills.motion import RunOverError

SEED = 90001
"""Scene of each run"""
EXAMPLES: dict[str, dict[str, Any]] = {
    "balls_reflex": {},
    "balls_sensors": {},
    "balls_softhand": {},
    "grasp": {"hand": "allegro"},
    "grasp_arm": {},
    "grasp_sensors": {},
    "grasp_softhand": {},
    "pan_softhand": {},
    "peg_softhand": {},
    "shelf_reflex": {},
    "shelf_sensors": {},
    "shelf_softhand": {},
}
"""Controllers with a `run`, and its further arguments"""
PLANNER = "mppi_grasp"
"""It plays without a client"""


@dataclass(frozen=True)
class Processor:
    """A processor: the variables that make all choose as on it, and the feature that its kernels need."""

    name: str
    environment: dict[str, str]
    needs: str


OLD = {"NPY_DISABLE_CPU_FEATURES": "X86_V3", "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX"}
"""NumPy and the C library of a processor without fused multiplication and addition"""
PROCESSORS = (
    Processor("Haswell", {"OPENBLAS_CORETYPE": "Haswell"}, "avx2"),
    Processor("SkylakeX", {"OPENBLAS_CORETYPE": "SkylakeX"}, "avx512f"),
    Processor("Nehalem", {"OPENBLAS_CORETYPE": "Nehalem"}, "sse4_2"),
    Processor("Prescott", {"OPENBLAS_CORETYPE": "Prescott"} | OLD, "pni"),
)


class ShortClient(palmares.Client):
    """A client whose runs are over after some time of theirs."""

    sim_s = float("inf")

    def step(self, *args: Any, **options: Any) -> palmares.Observation:
        """Make a step, as every client."""
        obs = super().step(*args, **options)
        if obs.sim_time_s >= self.sim_s:
            raise RunOverError("its beginning is enough")
        return obs


def play(name: str, sim_s: float) -> str:
    """Play a run and return the hash of its last state, and its score."""
    module = import_module(f"palmares.examples.{name}")
    if name == PLANNER:
        score, _ = module.play(SEED, worlds=8, horizon=4, limit_s=min(sim_s, 4.0), threads=2)
        return f"score {score!r}"
    with ShortClient("local") as client:
        client.sim_s = sim_s
        module.run(client, SEED, **EXAMPLES[name])
        result = client.result
        assert result is not None
        return f"{result.state_hash} score {result.score!r}"


def product() -> str:
    """Return a digest of a matrix product, by which the kernel shows."""
    matrix = np.random.default_rng(1).random((50, 50))
    return hashlib.sha256((matrix @ matrix).tobytes()).hexdigest()[:12]


def flags() -> set[str]:
    """Return the features of this processor; none where the system does not list them."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    return next((set(line.split()) for line in lines if line.startswith("flags")), set())


def played_as(processor: Processor, names: list[str], sim_s: float) -> dict[str, str]:
    """Play the runs as on another processor."""
    command = [sys.executable, __file__, "--play", "--sim-s", str(sim_s)]
    command += [word for name in names for word in ("--only", name)]
    inherited = {name: value for name, value in os.environ.items() if name != "OPENBLAS_CORETYPE"}
    # NumPy warns that it does what was asked for.
    environment = inherited | processor.environment | {"PYTHONWARNINGS": "ignore"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"as on {processor.name}: exit code {done.returncode}: {done.stderr[-500:]}")
    found: dict[str, str] = json.loads(done.stdout)
    return found


def main() -> int:
    """Play, compare and print."""
    names = [*EXAMPLES, PLANNER]
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", choices=names, action="append", metavar="NAME", help=", ".join(names))
    parser.add_argument("--sim-s", type=float, default=float("inf"), help="longest time of a run, s")
    parser.add_argument("--play", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    chosen = options.only or names
    logging.disable()
    if options.play:
        print(json.dumps({name: play(name, options.sim_s) for name in chosen} | {"product": product()}))
        return 0
    known, differ = flags(), False
    played: dict[str, dict[str, str]] = {}
    for processor in PROCESSORS:
        if processor.needs not in known:
            print(f"{processor.name}: not played, this processor lacks {processor.needs}")
            continue
        runs = played[processor.name] = played_as(processor, chosen, options.sim_s)
        first, wanted = next(iter(played.items()))
        other = [name for name in chosen if runs[name] != wanted[name]]
        differ |= bool(other)
        alike = "are played" if processor.name == first else f"end as on {first}"
        print(f"{processor.name}: {len(chosen) - len(other)} of {len(chosen)} {alike}", flush=True)
        for name in other:
            print(f"  {name}: {runs[name]}, on {first} {wanted[name]}")
    if len({runs["product"] for runs in played.values()}) < 2:
        print("all kernels give the same matrix product: this machine shows nothing")
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
