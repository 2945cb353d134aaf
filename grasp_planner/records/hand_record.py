"""The hand in the JSON form of a grasp: where its files were, what was in them, and the way back to the hand."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path, PurePosixPath

from pydantic import BaseModel, ConfigDict, Field

from ..exceptions import FileFormatError, GraspPlannerError
from ..files.writing import make_folder, write_text
from ..hand.description import ContactDescription
from ..hand.hand import Hand
from ..hand.loading import URDF_ENDINGS, load_hand
from ..hand.skin import with_contact_sets
from ..hand.source import HandSource, file_hash

MAX_DEPTH = 8
"""Most folders that a description's files may lie above it."""


class HandChangedWarning(UserWarning):
    """A grasp is opened with a hand whose files are gone or are not those it was planned with."""


class HandSourceRecord(BaseModel):
    """The files of the hand when the grasp was planned."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    path: str | None = Field(description="the file that was loaded; null for a hand of the package")
    sha256: str = Field(description="hash of the content of description, URDF, synergy sets and collision meshes")
    texts: dict[str, str] = Field(
        default={}, description="files by path relative to the first; empty for a hand of the package or if too long"
    )
    meshes: dict[str, str] = Field(default={}, description="hash of each collision mesh by its path")
    locked: dict[str, float] = Field(default={}, description="joints that were fixed, with their values; rad or m")
    contact_sets: dict[str, dict[str, ContactDescription]] = Field(
        default={}, description="contacts in use of a hand whose description was derived from a URDF"
    )


def hand_source_record(hand: Hand) -> HandSourceRecord | None:
    """Return the record of a hand's files; None for a hand that was not loaded from any."""
    source = hand.source
    if source is None:
        return None
    if source.library:
        return HandSourceRecord(path=None, sha256=source.content_hash)
    return HandSourceRecord(
        path=str(source.path),
        sha256=source.content_hash,
        texts=dict(source.texts),
        meshes=dict(source.meshes),
        locked=hand.description.locked,
        contact_sets=hand.description.contact_sets if source.path.suffix.lower() in URDF_ENDINGS else {},
    )


def hand_from_record(name: str, record: HandSourceRecord | None, hand: Hand | None = None) -> Hand:
    """Return the hand of a grasp.

    Its file is loaded from where it was; if it is gone, it is rebuilt from the texts in the record. Warns with
    :class:`HandChangedWarning`, in one line, if the file is gone or the hand is not the one the grasp was planned with.

    Args:
        name: Name of the hand.
        record: Its files; None if they are not known, then it is loaded by its name.
        hand: The hand to take instead.

    Raises:
        GraspPlannerError: If it can't be loaded, or its file is gone and it can't be rebuilt.
    """
    if record is None:
        return hand or load_hand(name)
    if hand is None and record.path is not None and not Path(record.path).is_file():
        rebuilt = _rebuilt(name, record)
        _warn(f"hand {name}: {record.path} is gone; it is rebuilt from the grasp's file")
        return _with_contacts(rebuilt, record)
    found = hand or load_hand(name if record.path is None else Path(record.path), record.locked)
    if found.source is not None and found.source.content_hash != record.sha256:
        place = "the hand of the package" if found.source.library else str(found.source.path)
        _warn(f"hand {name}: {place} is not what the grasp was planned with; everything is computed with it as it is")
        return found
    return _with_contacts(found, record)


def _with_contacts(hand: Hand, record: HandSourceRecord) -> Hand:
    """Return a hand of the same files with the contacts it had: they may have been moved since they were derived."""
    if not record.contact_sets or record.contact_sets == hand.description.contact_sets:
        return hand
    return with_contact_sets(hand, record.contact_sets)


def _warn(message: str) -> None:
    """Warn of a hand that is not what it was."""
    warnings.warn(message, HandChangedWarning, stacklevel=4)


def _rebuilt(name: str, record: HandSourceRecord) -> Hand:
    """Return the hand of the texts of a record, written to the user's cache by their content."""
    import platformdirs

    assert record.path is not None
    lost = FileFormatError(record.path, f"is gone, and the grasp's file has too little of hand {name}; name it again")
    paths = [PurePosixPath(text) for text in record.texts]
    depth = max((path.parts.count("..") for path in paths), default=0)
    if not paths or depth > MAX_DEPTH or any(path.is_absolute() or "\\" in str(path) for path in paths):
        raise lost
    for path, digest in record.meshes.items():
        if not digest or file_hash(path) != digest:
            raise FileFormatError(path, f"is gone or changed, a mesh of hand {name}; name the hand again")
    if re.fullmatch(r"[0-9a-f]{64}", record.sha256) is None:
        raise lost
    root = Path(platformdirs.user_cache_dir("grasp_planner", appauthor=False)) / "hands" / record.sha256
    folder = root.joinpath(*("in",) * depth)
    for relative, text in record.texts.items():
        place = Path(_normal(folder / relative))
        if ":" in relative or not place.is_relative_to(root):
            continue  # a URDF of an installed package is read there
        make_folder(place.parent)
        write_text(place, _with_meshes(text, record.meshes) if place.suffix == ".urdf" else text)
    try:
        hand = load_hand(folder / paths[0], record.locked)
    except GraspPlannerError as error:
        raise FileFormatError(record.path, f"is gone, and rebuilding hand {name} failed: {error}") from None
    texts, meshes = tuple(record.texts.items()), tuple(record.meshes.items())
    return replace(hand, source=HandSource("", Path(record.path), texts, meshes, record.sha256))  # written as before


def _normal(path: Path) -> Path:
    """Return a path without ``..``, as text alone: nothing is looked up."""
    parts: list[str] = []
    for part in path.parts:
        if part == ".." and parts:
            parts.pop()
        else:
            parts.append(part)
    return Path(*parts)


def _with_meshes(text: str, meshes: Mapping[str, str]) -> str:
    """Return the text of a URDF with its meshes named by where they lie."""

    def place(found: re.Match[str]) -> str:
        inner = [part for part in PurePosixPath(re.sub(r"^\w+://", "", found[2])).parts if part not in ("..", "/")]
        known = (path for path in meshes if list(Path(path).parts[-len(inner) :]) == inner)
        return f"{found[1]}{next(known, found[2])}{found[3]}"

    return re.sub(r'(filename\s*=\s*["\'])([^"\']+)(["\'])', place, text)
