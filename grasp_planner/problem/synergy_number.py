"""How many synergies a problem has that names no number."""

from __future__ import annotations

from ..hand.hand import Hand

DEFAULT_SYNERGIES, MOTION_SYNERGIES = 3, 6
"""Number of synergies if none is given: the paper's case; and the least for a twist task: β needs rank 6."""


def default_synergies(hand: Hand, synergy_set: str | None = None, *, clear: bool = True, motion: bool = False) -> int:
    """Return the number of synergies of a problem that names none: three, six for a twist, or all of the set.

    Args:
        hand: The hand.
        synergy_set: Name of its set; the default one if None.
        clear: Whether that is the default where links keep clear.
        motion: Whether a task is a twist: β needs rank 6.
    """
    name = synergy_set or hand.description.synergies.default_for(clear)
    return min(MOTION_SYNERGIES if motion else DEFAULT_SYNERGIES, hand.synergies(name).n_synergies)
