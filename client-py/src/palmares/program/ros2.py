"""``palmares ros2``: a run in real time as a node of ROS 2."""

from __future__ import annotations

import argparse
import os
import sys
from typing import Any

from palmares.client import Client
from palmares.errors import PalmaresError

MISSING = "palmares ros2 needs the package cyclonedds: pip install 'palmares[ros2]'"


def main(arguments: list[str]) -> int:
    """Run the command; return the exit code."""
    options = parser().parse_args(arguments)
    try:
        from palmares.bridges.ros2.node import Node
    except ImportError as missing:
        print(f"{MISSING} ({missing})", file=sys.stderr)
        return 1
    try:
        with Client(options.url, team=options.team, token=options.token) as client:
            node = Node(
                options.domain, client.welcome.hand(options.hand), options.camera, options.velocity_timeout
            )
            opened = client.reset(options.task, options.hand, mode="realtime", seed=options.seed)
            print(
                f"run {opened.run_id}: {options.task} with {options.hand} on domain {options.domain}",
                flush=True,
            )
            try:
                play(client, node, options.camera, options.camera_period)
            except KeyboardInterrupt:
                print("stopping", file=sys.stderr)
            result = client.stop()
            print(f"score {result.score:g} ({result.status}, {result.reason})")
    except (PalmaresError, OSError, ValueError, KeyError) as error:
        print(f"palmares ros2: {error}", file=sys.stderr)
        return 1
    return 0


def play(client: Client, node: Any, cameras: list[str], period: int) -> None:
    """Publish observations, and pass commands on, until the run is over."""
    next_image = 0
    for observation in client.observations():
        node.publish(observation)
        if observation.done:
            return
        wanted = cameras if cameras and observation.tick >= next_image else []
        if wanted:
            next_image = observation.tick + period
        base, hand = node.targets(observation)
        client.act(base=base, hand=hand, cameras=wanted)


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser(
        prog="palmares ros2",
        description="Open a run in real time, publish its sensors as standard messages of ROS 2, and play "
        "the targets that ROS nodes publish. It needs no ROS.",
    )
    made.add_argument("--url", default="http://127.0.0.1:8080", help="the server (default %(default)s)")
    made.add_argument("--task", default="grasp", help="task (default %(default)s)")
    made.add_argument("--hand", default="softhand", help="hand (default %(default)s)")
    made.add_argument("--team", default="ros", help="name on a practice server (default %(default)s)")
    made.add_argument("--token", help="the team's token; better in PALMARES_TOKEN")
    made.add_argument("--seed", type=int, help="scene, in practice (default: drawn)")
    made.add_argument(
        "--camera",
        action="append",
        default=[],
        metavar="NAME",
        help="publish this camera's depth; repeatable",
    )
    made.add_argument(
        "--camera-period", type=int, default=10, metavar="TICKS", help="ticks between images (default 10)"
    )
    made.add_argument(
        "--velocity-timeout",
        type=float,
        default=0.5,
        metavar="S",
        help="simulated time after which a velocity of the base that is not repeated becomes zero "
        "(default %(default)s)",
    )
    made.add_argument(
        "--domain",
        type=int,
        default=int(os.environ.get("ROS_DOMAIN_ID") or "0"),
        help="DDS domain (default: ROS_DOMAIN_ID, or 0)",
    )
    return made
