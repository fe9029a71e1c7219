"""``palmares foxglove``: a server's runs, live in the panels of Foxglove."""

from __future__ import annotations

import argparse
import os
import re
import sys
import time
from contextlib import closing

from palmares.bridges.spectator import Spectator
from palmares.errors import ConnectionLostError, NoServerError, PalmaresError

MISSING = "palmares foxglove needs the packages foxglove-sdk and scipy: pip install 'palmares[foxglove]'"
# Time between two tries to reach a server that was lost, s.
AGAIN_S = 2.0


def main(arguments: list[str]) -> int:
    """Run the command; return the exit code."""
    options = parser().parse_args(arguments)
    try:
        from palmares.bridges.panels import APP, Panels
    except ImportError as missing:
        print(f"{MISSING} ({missing})", file=sys.stderr)
        return 1
    token = options.token or os.environ.get("PALMARES_TOKEN") or None
    try:
        with closing(Panels(options.host, options.port, options.allowed_origin)) as panels:
            print(f"Foxglove can connect to ws://{options.host}:{panels.port}", flush=True)
            needs = "" if APP in options.allowed_origin else f", with --allowed-origin {APP}"
            print(f"  in a browser{needs}: {panels.url}", flush=True)
            lost = None
            while True:
                try:
                    with closing(Spectator(options.url, session=options.session, token=token)) as spectator:
                        lost = None
                        for message in spectator.messages():
                            panels.show(message)
                except (ConnectionLostError, NoServerError) as error:
                    if lost is None:
                        print(f"palmares foxglove: {error}; trying again", file=sys.stderr)
                    lost = error
                time.sleep(AGAIN_S)
    except (PalmaresError, OSError, RuntimeError, ValueError) as error:
        print(f"palmares foxglove: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


def site(text: str) -> str:
    """Return a site as browsers name it in `Origin`."""
    if not re.fullmatch(r"[a-zA-Z][a-zA-Z0-9+.-]*://[^/\s]*", text):
        raise argparse.ArgumentTypeError(
            f"{text!r}: expected a site such as https://app.foxglove.dev, without a path"
        )
    return text


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser(
        prog="palmares foxglove",
        description="Watch a server as a spectator, and serve its runs to Foxglove, live: scene, frames, "
        "telemetry and events, in the topics of a replay.",
    )
    made.add_argument(
        "--url", default="http://127.0.0.1:8080", help="the Palmares server (default %(default)s)"
    )
    made.add_argument("--session", help="the session to watch (default: the featured run, then the next)")
    made.add_argument("--token", help="a spectator's, team's or organizer's token; better in PALMARES_TOKEN")
    made.add_argument("--host", default="127.0.0.1", help="the address to listen on (default %(default)s)")
    made.add_argument("--port", type=int, default=8765, help="the port to listen on (default %(default)s)")
    made.add_argument(
        "--allowed-origin",
        type=site,
        action="append",
        default=[],
        metavar="SITE",
        help="a site whose pages may connect, such as https://app.foxglove.dev; repeatable (default: none; "
        "programs on this machine need no permission)",
    )
    return made
