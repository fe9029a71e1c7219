"""Parts of controllers: motions, where objects are, grasps, and ways to clear a shelf.

The examples share nothing else. After ``import palmares`` alone, `palmares.skills.motion` and the others are
there, too.

    motion      `Mover`: moves base and fingers within the limits; `fling`, `press`
    objects     `object_bounds`: bounding boxes of the free objects; which objects roll
    grasps      `TopGrasp`: a grasp from above; `Capsules`: room for the hand
    attempts    `Attempt`: one grasp or push that was tried; `candidates`: objects that are left to try
    runs        `play`: the main program of a controller; `Summary` of a run
    raking      Hooked fingers pull an object out of a shelf so fast that it lands in the box
    pushing     The fist pushes an object into the shelf
    tipping     The fingers tip over a tall object at the rear wall
    fetching    The hand grasps an object in the shelf and carries it to the box
    clearing    Clears a shelf with the SoftHand by all of these
    balls       `BallMover`: plays the task balls with the numbers and motions of any hand
    shelf       `ShelfMover`: plays the task shelf with the motions of any hand
    recipes     `RECIPES`: a grasp from above for every hand but the SoftHand
    cookbook    `COOKBOOK`: grips of every hand by the kind of object; `pick` plays one

Rotations are in `palmares.rotation`, targets of actions in `palmares.targets`. Units are SI, arrays are
float64; every function states its shapes.
"""

from importlib import import_module
from pkgutil import iter_modules
from typing import Any


def __getattr__(name: str) -> Any:
    """Import a module of the package at its first use."""
    if any(module.name == name for module in iter_modules(__path__)):
        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
