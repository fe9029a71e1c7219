"""Open and close the hand while the world runs by the clock: the shortest controller in real time.

    palmares serve                                                   # in another terminal
    python -m palmares.examples.realtime_hello

The world does not wait: it makes a tick every 0.01 s, also while the controller computes.
"""

import argparse
import math
import sys
import time

import palmares

PLAY_S = 3.0
"""Length of the run"""
PERIOD_S = 2.0
"""Time in which the hand closes and opens once"""
THINK_S = 0.5
"""Length of the pause in the middle"""


def main() -> None:
    """Play for `PLAY_S`, pause for `THINK_S` in the middle, print the missed ticks."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--url", default="http://127.0.0.1:8080", help="address of the server")
    parser.add_argument("--team", default="example", help="name on a practice server's leaderboard")
    args = parser.parse_args()
    with palmares.Client(args.url, team=args.team) as client:
        obs = client.reset("balls", "softhand", mode="realtime", seed=1)
        print(f"run {obs.run_id}: the world runs from now on")

        read = 0
        paused = False
        for obs in client.observations():  # Always the newest; ends with the run.
            read += 1
            if obs.done or obs.sim_time_s >= PLAY_S:
                break
            # 0 is open, 1 is closed. The command holds from the next tick on.
            client.act(hand=[0.5 - 0.5 * math.cos(2.0 * math.pi * obs.sim_time_s / PERIOD_S)])
            if not paused and obs.sim_time_s >= PLAY_S / 2:
                paused = True
                time.sleep(THINK_S)  # The hand keeps its last command, at most for `Limits.hold_ticks`.

        motor = obs.hand.actuators[0]
        print(f"{obs.sim_time_s:5.2f} s  sigma {motor.position:.2f}  tension {motor.tension:.3f}")
        result = client.stop()
        print(f"read {read} of {obs.tick} observations, {client.skipped} were replaced by newer ones")
        print(
            f"{result.missed_ticks} ticks without a new action, {result.late_ticks} begun late by the server"
        )
        print(f"score {result.score:g} ({result.status}, {result.reason})")


if __name__ == "__main__":
    try:
        main()
    except palmares.PalmaresError as error:
        sys.exit(str(error))
