"""Design of a hand: numbers of its files that meet goals as well as possible.

>>> from pathlib import Path
>>> from palmares.design import find, maker, read, write_hand                # doctest: +SKIP
... design = read(Path("design.toml"))
... with maker(design) as made:
...     found = find(made, evaluations=200)
... best = write_hand(design, found, Path("my-hand"), "palmares hand design design.toml --out my-hand")

`palmares hand design` does the same from a shell; docs/analysis.md describes the design file.
"""

from palmares.design.file import Design, Unknown, read
from palmares.design.making import Candidate, Designed, Maker, find, maker
from palmares.design.result import write_hand

__all__ = ["Candidate", "Design", "Designed", "Maker", "Unknown", "find", "maker", "read", "write_hand"]
