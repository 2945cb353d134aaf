"""Names of fingers that a person understands, from the names in a URDF where these say something."""

from __future__ import annotations

import re

KNOWN = ("thumb", "index", "middle", "ring", "little", "pinky")
"""Names of fingers."""


def finger_names(fingers: list[tuple[tuple[str, ...], str]]) -> list[str]:
    """Return short, different names of fingers.

    Args:
        fingers: Names of the joints of each from the palm outwards, and its last link; the opposing finger first.

    Returns:
        The finger's own name or number if its link or joints have one, what its joints' names share if that is a
        word, or ``thumb``, ``finger_2``, …
    """
    shorts = []
    for number, (chain, link) in enumerate(fingers):
        same = [len(set(letters)) == 1 for letters in zip(*chain, strict=False)]
        length = same.index(False) if False in same else len(same)
        shared = chain[0][:length].rstrip("_-. 0123456789") if len(chain) > 1 else ""
        plain = "thumb" if number == 0 else f"finger_{number + 1}"
        counts = [sum(word in text.lower() for text in (link, *chain)) for word in KNOWN]
        numbered = re.search(r"finger_?\d(?!\d)", link.lower())
        named = KNOWN[counts.index(max(counts))] if any(counts) else numbered[0] if numbered else ""
        told = bool(re.search(r"[A-Za-z]{3}", shared)) and not re.search(r"joint|link", shared.lower())
        shorts.append(named or (shared if told else plain))
    names = [
        short if shorts.count(short) == 1 else f"{'thumb' if number == 0 else 'finger'}_{number + 1}"
        for number, short in enumerate(shorts)
    ]
    return [re.sub(r"[^A-Za-z0-9_-]", "_", name) for name in names]
