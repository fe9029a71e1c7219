"""Close the hand in the air and print the tension of its tendon: the shortest useful controller.

    palmares serve                                                   # in another terminal
    python -m palmares.examples.first_steps

Without a server:

    python -m palmares.examples.first_steps --url local
"""

import argparse
import sys

import palmares

CLOSE_S = 1.0
"""Time in which the hand closes"""


def main() -> None:
    """Connect, open a run, close the hand in `CLOSE_S`, print the tension, stop."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--url", default="http://127.0.0.1:8080", help="address of the server, or local")
    parser.add_argument("--team", default="example", help="name on a practice server's leaderboard")
    args = parser.parse_args()
    with palmares.Client(args.url, team=args.team) as client:
        obs = client.reset("balls", "softhand", seed=1)
        print(f"run {obs.run_id}: {len(client.scene.bodies)} bodies in the scene")

        ticks = round(CLOSE_S / client.run.tick_s)
        for tick in range(1, ticks + 1):
            obs = client.step(hand=[tick / ticks])  # 0 is open, 1 is closed
            if tick % 20 == 0:
                motor = obs.hand.actuators[0]
                print(f"{obs.sim_time_s:5.2f} s  sigma {motor.position:.2f}  tension {motor.tension:.3f}")

        result = client.stop()
        print(f"score {result.score:g} ({result.status}, {result.reason})")


if __name__ == "__main__":
    try:
        main()
    except palmares.PalmaresError as error:
        sys.exit(str(error))
