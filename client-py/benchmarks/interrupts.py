"""Delay of Ctrl-C in calls of several minutes: from the signal to the exception in Python.

    python client-py/benchmarks/interrupts.py --times 20

Each call has its own process, which is interrupted at a random moment of its first second.
"""

from __future__ import annotations

import argparse
import random
import signal
import statistics
import subprocess
import sys
import time

CALLS = {
    "World.step": 'sim.World("balls", "softhand", 1).step(hand=[1.0], repeat=2**31)',
    "World.step, ReFlex in front of a shelf": 'sim.World("shelf", "reflex", 1).step(repeat=2**31)',
    "Batch.step, 4 worlds": "batch.step(np.zeros((4, 7)), 2**31)",
    "Batch.step, 256 worlds": "many.step(np.zeros((256, 7)), 2**31)",
    "Batch.reset, 100,000 worlds of a shelf": "largest.reset(range(100_000))",
    "BatchEnv.step": "env.step(np.zeros((4, 7)))",
}
CHILD = """
import signal, sys, time
import numpy as np
from palmares import sim
# A shell makes background processes ignore Ctrl-C; undo that.
signal.signal(signal.SIGINT, signal.default_int_handler)
call = sys.argv[1]
if "batch" in call:
    batch = sim.Batch("balls", "softhand", 4)
    batch.reset(range(4))
if "many" in call:
    many = sim.Batch("balls", "softhand", 256)
    many.reset(range(256))
if "largest" in call:
    largest = sim.Batch("shelf", "softhand", 100_000)
if "env" in call:
    from palmares.gym import BatchEnv
    env = BatchEnv("balls", "softhand", 4, ticks=2**31)
    env.reset(seed=1)
try:
    print("ready", flush=True)
    eval(call)
except KeyboardInterrupt:
    print(time.monotonic(), flush=True)
"""


def answer_s(call: str, wait_s: float) -> float:
    """Interrupt a call; return the delay of the exception, s."""
    with subprocess.Popen([sys.executable, "-c", CHILD, call], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        if child.stdout.readline() != "ready\n":
            raise RuntimeError(f"{call}: did not begin")
        time.sleep(wait_s)
        sent_s = time.monotonic()
        child.send_signal(signal.SIGINT)
        line = child.stdout.readline()
        if not line:
            raise RuntimeError(f"{call}: ended before it was interrupted")
        return float(line) - sent_s


def main() -> int:
    """Measure every call."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--times", type=int, default=20, help="interruptions of each call (default 20)")
    options = parser.parse_args()
    draw = random.Random(1)
    print(f"{'':40}{'median':>8}{'most':>8}  ms")
    for name, call in CALLS.items():
        took = [1e3 * answer_s(call, draw.uniform(0.0, 1.0)) for _ in range(options.times)]
        print(f"{name:40}{statistics.median(took):8.0f}{max(took):8.0f}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
