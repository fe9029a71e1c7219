"""Grasps by the thousand: tried, kept through a shake, proven at other steps and in drawn hands.

>>> from palmares.grasps import GraspFile, make                              # doctest: +SKIP
... make("softhand", ["025_mug", "056_tennis_ball"], "grasps.h5")
... with GraspFile("grasps.h5") as file:
...     kept = file.kept("025_mug", pose=0)
...     kept.hand_in_object[kept.survived.all(axis=1)]                       # (k, 7)

`palmares grasps` does the same from a shell; docs/grasps.md has the protocol and the schema of the file. It
needs ``pip install 'palmares[grasps]'``.
"""

from palmares.grasps.explore import STEPS_MS, Explored, Kept, Tries
from palmares.grasps.file import SCHEMA, GraspFile, Settings, totals
from palmares.grasps.learning import Examples, examples
from palmares.grasps.making import make, processes
from palmares.grasps.play import FATES
from palmares.grasps.replay import Replayed, replay

__all__ = [
    "FATES",
    "SCHEMA",
    "STEPS_MS",
    "Examples",
    "Explored",
    "GraspFile",
    "Kept",
    "Replayed",
    "Settings",
    "Tries",
    "examples",
    "make",
    "processes",
    "replay",
    "totals",
]
