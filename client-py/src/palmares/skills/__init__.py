"""Parts of controllers: motions, where objects are, grasps, and ways to clear a shelf.

Import them from their modules; the examples share nothing else.

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

Rotations are in `palmares.rotation`, targets of actions in `palmares.targets`. Units are SI, arrays are
float64; every function states its shapes.
"""
