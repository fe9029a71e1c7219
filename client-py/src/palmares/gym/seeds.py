"""Seeds of scenes: the same in an environment and in a row of a batch that begins with its seed."""

from __future__ import annotations

import numpy as np


def any_seed() -> int:
    """Return a seed from the system, of 52 bits, so that the seeds of a batch's other rows are valid, too."""
    return int(np.random.SeedSequence().generate_state(1, np.uint64)[0] >> np.uint64(12))


def seed_of_episode(first: int, episode: int) -> int:
    """Return the seed of an episode's scene: `first` of the first one, 53 bits of both numbers of later ones.

    Args:
        first: Seed of the first episode.
        episode: Number of this one, from 0 on.

    """
    if episode == 0:
        return first
    mixed = np.random.SeedSequence([first, episode])
    return int(mixed.generate_state(1, np.uint64)[0] >> np.uint64(11))
