"""Where a hand comes from: its files by content, so that a record knows it again and can rebuild it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..exceptions import FileFormatError
from ..files.reading import hash_of_file
from ..files.text import read_text_file
from ..values import Value
from .description import HandDescription, hand_library

MAX_KEPT_CHARACTERS = 400_000
"""Most characters of text that a record keeps of a hand; of more it has the hash only."""
MAX_FILE_BYTES = 20_000_000
"""Largest file whose text is read."""
MAX_HASHED_BYTES = 200_000_000
"""Largest file that has a hash."""


@dataclass(frozen=True, eq=False, repr=False)
class HandSource(Value):
    """The files of a hand as they were when it was loaded.

    Attributes:
        library: Name of the hand in the package; empty if it is none of its hands.
        path: The file that was loaded.
        texts: Texts by path relative to its folder (as the description names them), the loaded file first; empty
            if they are too long to be kept.
        meshes: Meshes of the collision geometry: path and hash.
        content_hash: Hash of texts and meshes, wherever they lie.
    """

    library: str
    path: Path
    texts: tuple[tuple[str, str], ...]
    meshes: tuple[tuple[str, str], ...]
    content_hash: str


def hand_source(path: Path, description: HandDescription, urdf: Path, collision_model: Any) -> HandSource:
    """Return where a hand comes from.

    Args:
        path: The file that was loaded.
        description: What it says.
        urdf: The URDF.
        collision_model: Its collision geometries.

    Returns:
        The source; a synergy file that can't be read is left out.
    """
    named = {path.name: path, description.urdf: urdf}
    named |= {file: path.parent / file for file in description.synergies.sets.values()}
    texts = []
    for name, file in named.items():
        try:
            texts.append((name, read_text_file(file, MAX_FILE_BYTES)))
        except FileFormatError:
            continue
    kept = tuple(texts) if sum(len(text) for _, text in texts) <= MAX_KEPT_CHARACTERS else ()
    known = (name for name, place in hand_library().items() if place.resolve() == path.resolve())
    paths = sorted({geometry.meshPath for geometry in collision_model.geometryObjects})
    meshes = tuple((mesh, file_hash(mesh)) for mesh in paths if mesh and Path(mesh).is_file())
    parts = [*(hashlib.sha256(text.encode()).hexdigest() for _, text in texts), *(digest for _, digest in meshes)]
    content_hash = hashlib.sha256("".join(parts).encode()).hexdigest()
    return HandSource(next(known, ""), path.absolute(), kept, meshes, content_hash)


def file_hash(path: str) -> str:
    """Return the hash of a file; empty if it can't be read, is none (a device, a pipe) or too large."""
    try:
        return hash_of_file(Path(path), MAX_HASHED_BYTES)
    except (OSError, ValueError, FileFormatError):  # a zero byte in the name is a ValueError
        return ""
