"""Analysis of hands and grasps: stiffness, synergies, closure, quality, closing, design.

>>> from palmares.analysis import Contact, Hand                      # doctest: +SKIP
... hand = Hand("pinch")
... rest = hand.rest([0.3, 0.35])
... tip = Contact("left_distal", (0, 0, 0.02), (0, -1, 0))
... grasp = hand.grasp(rest, [tip])
... print(grasp.G.shape, grasp.linear().object_stiffness)

Arrays are numpy's, units SI, poses a position and a quaternion x y z w. docs/analysis.md has the shapes,
frames and the source of
each equation. The functions need the compiled part of the package, which the wheels contain.
"""

from palmares.analysis.closure import Closure, Quality, force_closure, form_closure, quality
from palmares.analysis.contacts import Contact, ContactModel, grasp_matrix
from palmares.analysis.design import Forces, Optimum, Postures, Variable, arm, rest, stiffness
from palmares.analysis.grasp import Ellipsoid, Grasp, ellipsoid, force_ellipsoid
from palmares.analysis.hand import Closing, Ejection, Hand, Inverse, Rest, held
from palmares.analysis.linear import LinearGrasp, LinearHand, soft_synergies
from palmares.analysis.robot_arm import Reached, RobotArm

__all__ = [
    "Closing",
    "Closure",
    "Contact",
    "ContactModel",
    "Ejection",
    "Ellipsoid",
    "Forces",
    "Grasp",
    "Hand",
    "Inverse",
    "LinearGrasp",
    "LinearHand",
    "Optimum",
    "Postures",
    "Quality",
    "Reached",
    "Rest",
    "RobotArm",
    "Variable",
    "arm",
    "ellipsoid",
    "force_closure",
    "force_ellipsoid",
    "form_closure",
    "grasp_matrix",
    "held",
    "quality",
    "rest",
    "soft_synergies",
    "stiffness",
]
