"""A page about a file of grasps: pictures of kept ones, and success by object."""

from __future__ import annotations

import base64
import html
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from palmares.grasps.file import GraspFile, Total, totals
from palmares.grasps.replay import replay
from palmares.png import png
from palmares.reproducible import total
from palmares.sim import Batch

SIZE = (320, 240)
"""Width and height of a picture, pixels"""
PICTURES = 3
"""Pictures of an object: its grasps that are kept at every step, the largest ε first"""
ENOUGH = 20
"""Differing grasps of an object from which it counts as covered"""

HEAD = """\
<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Grasps of {hand}</title>
<style>
:root {{ color-scheme: light dark; font: 16px/1.5 system-ui, sans-serif; }}
body {{ margin: 0 auto; max-width: 76rem; padding: 1rem; }}
article {{ border-top: 1px solid color-mix(in srgb, currentColor 25%, transparent); padding: 1rem 0; }}
h2 {{ font-size: 1.1rem; margin: 0; overflow-wrap: anywhere; }}
p {{ margin: .25rem 0; }}
.pictures {{ display: grid; gap: .5rem;
  grid-template-columns: repeat(auto-fill, minmax(min(100%, 16rem), 1fr)); }}
figure {{ margin: 0; }} img {{ border-radius: .4rem; display: block; height: auto; width: 100%; }}
figcaption {{ font-size: .85rem; }}
meter {{ height: 1rem; vertical-align: middle; width: 10rem; }}
</style></head><body>
<h1>Grasps of {hand}</h1>
<p>{covered} of {objects} objects have at least {enough} grasps that differ from each other and are kept at
every step (1, 2 and 4 ms). {tries} grasps were tried, {kept} kept. Engine {engine}.</p>
"""


def write_page(file: GraspFile, path: Path, report: Callable[[str], None] | None = None) -> None:
    """Write the page; every picture is of a grasp that is played again.

    Args:
        file: The grasps.
        path: The HTML file.
        report: Called with the name of each object that is done.

    Raises:
        OSError: It cannot be written.

    """
    rows = totals(file)
    text = HEAD.format(
        hand=html.escape(file.reach.name),
        covered=len([row for row in rows if row.survived >= ENOUGH]),
        objects=len(rows),
        enough=ENOUGH,
        tries=int(total([row.tries for row in rows])),
        kept=int(total([row.kept for row in rows])),
        engine=html.escape(file.engine),
    )
    for row in rows:
        text += _article(file, row)
        if report is not None:
            report(row.name)
    path.write_text(text + "</body></html>\n", encoding="utf-8")


def _article(file: GraspFile, row: Total) -> str:
    share = row.kept / row.tries if row.tries else 0.0
    drawn = "" if row.drawn_share is None else f", in {row.drawn_share:.0%} of drawn hands"
    lines = [
        "<article>",
        f"<h2>{html.escape(row.name)}</h2>",
        f'<p><meter value="{share:.4f}" max="1"></meter> {row.kept} of {row.tries} tries kept ({share:.1%}); '
        f"{row.apart} differ; {row.survived} of these are kept at every step{drawn}</p>",
        '<div class="pictures">',
    ]
    for pose, grasp, epsilon in _best(file, row.name):
        image = base64.b64encode(_picture(file, row.name, pose, grasp)).decode()
        words = f"pose {pose}, grasp {grasp}, ε {epsilon:.3f} N"
        lines.append(
            f'<figure><img src="data:image/png;base64,{image}" width="{SIZE[0]}" height="{SIZE[1]}" '
            f'alt="{html.escape(row.name)} in the hand, {words}"><figcaption>{words}</figcaption></figure>'
        )
    return "\n".join([*lines, "</div></article>\n"])


def _best(file: GraspFile, name: str) -> list[tuple[int, int, float]]:
    """Return pose, row and ε of the grasps that are shown."""
    found = []
    for other, pose in file.sections():
        if other == name:
            kept = file.kept(name, pose)
            rows = np.flatnonzero(kept.survived.all(axis=1)).tolist()
            found += [(pose, row, float(kept.epsilon[row])) for row in rows]
    return sorted(found, key=lambda it: -it[2])[:PICTURES]


def _picture(file: GraspFile, name: str, pose: int, grasp: int) -> bytes:
    """Return the picture of a held object, PNG."""
    pictures: list[bytes] = []

    def on_held(batch: Batch, _: int) -> None:
        pictures.append(png(batch.pictures("film", SIZE, "film")["film"][0]))

    with tempfile.TemporaryDirectory(prefix="palmares-grasps-") as folder:
        replay(file, name, pose, grasp, Path(folder), on_held=on_held)
    return pictures[0] if pictures else b""
