"""Old names that still work, with a warning."""

from __future__ import annotations

import importlib

import pytest

from palmares.rotation import rot_z
from palmares.skills.motion import Mover


def test_controllers_of_0_1_0_find_their_imports() -> None:
    motion = importlib.import_module("palmares.motion")
    with pytest.warns(DeprecationWarning, match=r"is now palmares\.skills\.motion\.Mover"):
        assert motion.Mover is Mover
    with pytest.warns(DeprecationWarning, match=r"palmares\.rotation\.rot_z"):
        assert motion.rot_z is rot_z
    with pytest.raises(AttributeError, match="nothing"):
        _ = motion.nothing
