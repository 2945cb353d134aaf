"""Meshes and hands that come from the page: kept in a private folder until the viewer ends. No display code here."""

from __future__ import annotations

import hashlib
import tempfile
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

from ..exceptions import InvalidValueError
from ..files.reading import MESH_SUFFIXES
from ..files.writing import write_bytes
from ..hand.loading import LoadedHand, loaded_hand
from ..objects import GraspObject, MeshObject

MAX_UPLOAD_BYTES = 20_000_000
"""Largest mesh or hand that is taken."""
URDF_SUFFIXES = (".urdf",)
UNITS = {"metres": 1.0, "millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254}
"""Units of a mesh file [m]."""


@dataclass(frozen=True)
class UploadedObject:
    """An object from the page.

    Attributes:
        grasp_object: The object.
        notes: What is to be seen of it, one line each: likely wrong units, what was repaired.
    """

    grasp_object: GraspObject
    notes: tuple[str, ...]


class Uploads:
    """A folder that only its owner can read; its name says nothing, and names from the page are no part of a path."""

    def __init__(self) -> None:
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    def mesh(self, name: str, content: bytes, unit: str) -> UploadedObject:
        """Return the object of a mesh.

        Args:
            name: Name of the file, of which only the ending counts.
            content: What it holds.
            unit: One of :data:`UNITS`.

        Raises:
            GraspPlannerError: If it is too large, of another kind, or no solid.
        """
        path = self._keep(name, content, MESH_SUFFIXES)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            found = MeshObject.load(path, scale=UNITS[unit])
        return UploadedObject(found, tuple(str(each.message) for each in said))

    def hand(self, name: str, content: bytes) -> LoadedHand:
        """Return the hand of a URDF, named so that it is taken for no other one.

        Args:
            name: Name of the file, of which only the ending counts.
            content: What it holds.

        Raises:
            GraspPlannerError: If it is too large, malformed, no hand, or needs files that were not sent.
        """
        path = self._keep(name, content, URDF_SUFFIXES)
        loaded = loaded_hand(path)
        described = loaded.hand.description
        own = f"{described.name[:40]}-{path.stem[:6]}"
        return replace(
            loaded, hand=replace(loaded.hand, description=described.model_copy(update={"name": own, "title": own}))
        )

    def close(self) -> None:
        """Remove the folder."""
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None

    def _keep(self, name: str, content: bytes, endings: tuple[str, ...]) -> Path:
        """Write a file into the folder and return it."""
        ending = Path(name).suffix.lower()
        if ending not in endings:
            raise InvalidValueError("file", name, f"a file that ends in {', '.join(endings)}")
        if len(content) > MAX_UPLOAD_BYTES:
            raise InvalidValueError("file", f"{len(content)} bytes", f"at most {MAX_UPLOAD_BYTES // 1_000_000} MB")
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="grasp-")
        path = Path(self._folder.name) / f"{hashlib.sha256(content).hexdigest()[:16]}{ending}"
        write_bytes(path, content)
        return path
