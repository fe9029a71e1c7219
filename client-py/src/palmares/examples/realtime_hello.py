"""The shortest useful controller in real time: open and close the hand while the world runs by the clock.

Nothing waits here: the world goes on from tick to tick, whatever the controller does. Start a server with
`cargo run --release -p palmares -- serve`, then run this file.
"""

import argparse
import math
import sys
import time

import palmares

PLAY_S = 3.0
PERIOD_S = 2.0
THINK_S = 0.5


def main() -> None:
    """Play for `PLAY_S`, pause for `THINK_S` in the middle, print what was missed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--url", default="http://127.0.0.1:8080", help="where the server listens")
    parser.add_argument("--team", default="example", help="name on a practice server's leaderboard")
    args = parser.parse_args()
    with palmares.Client(args.url, team=args.team) as client:
        obs = client.reset("balls", "softhand", mode="realtime", seed=1)
        print(f"run {obs.run_id}: the world runs from now on")

        seen = 0
        thought = False
        for obs in client.observations():  # Always the newest; ends with the run.
            seen += 1
            if obs.done or obs.sim_time_s >= PLAY_S:
                break
            # 0 is open, 1 is closed. The command holds from the next tick on.
            client.act(hand=[0.5 - 0.5 * math.cos(2.0 * math.pi * obs.sim_time_s / PERIOD_S)])
            if not thought and obs.sim_time_s >= PLAY_S / 2:
                thought = True
                time.sleep(THINK_S)  # The hand keeps its last command meanwhile, for a while.

        motor = obs.hand.actuators[0]
        print(f"{obs.sim_time_s:5.2f} s  sigma {motor.position:.2f}  tension {motor.tension:.3f}")
        result = client.stop()
        print(f"read {seen} of {obs.tick} observations, {client.skipped} were replaced by newer ones")
        print(
            f"{result.missed_ticks} ticks without a new action, {result.late_ticks} begun late by the server"
        )
        print(f"score {result.score:g} ({result.status}, {result.reason})")


if __name__ == "__main__":
    try:
        main()
    except palmares.PalmaresError as error:
        sys.exit(str(error))
