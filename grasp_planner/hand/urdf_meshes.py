"""The mesh files of a URDF: where they are looked for, and what is done about links that have none to collide with."""

from __future__ import annotations

import copy
import re
import xml.etree.ElementTree as ET
from pathlib import Path

MAX_PARENTS = 5
"""How many folders above a URDF are searched for a mesh."""


def package_folders(path: Path, text: str) -> tuple[Path, ...]:
    """Return the folders in which the meshes of a URDF are looked for.

    Args:
        path: The URDF.
        text: Its text; ``package://NAME/…`` is found if a folder NAME lies beside or above the file.

    Returns:
        The file's own folder, then those that hold the named packages.
    """
    names = sorted(set(re.findall(r"package://([\w.-]+)/", text)))
    parents = path.resolve().parents
    holding = {parent for name in names for parent in parents if (parent / name).is_dir()}
    return path.parent, *sorted(holding, key=lambda parent: -len(parent.parts))


def find_mesh(name: str, path: Path, folders: tuple[Path, ...]) -> Path | None:
    """Return the file of a mesh of a URDF; None if it is in none of the usual places.

    Tried are, in this order: the path within the folders; the same without its first part, which names a package,
    beside the URDF and above it; the last two parts and the last one there.

    Args:
        name: The mesh as the URDF names it.
        path: The URDF.
        folders: Folders that hold packages, from :func:`package_folders`.

    Returns:
        The file.
    """
    inner = re.sub(r"^(package|file|model)://", "", name)
    if not inner:
        return None
    parts = Path(inner).parts
    nearby = (path.parent, *path.resolve().parents[: MAX_PARENTS + 1])
    tails = [Path(*parts[start:]) for start in sorted({1, len(parts) - 2, len(parts) - 1}) if 0 < start < len(parts)]
    candidates = [folder / inner for folder in folders]
    candidates += [folder / tail for tail in tails for folder in nearby]
    candidates += [path.parent / "meshes" / parts[-1]]
    try:
        return next((file for file in candidates if file.is_file()), None)
    except (OSError, ValueError):
        return None


def place_meshes(robot: ET.Element, path: Path, text: str) -> list[str]:
    """Write where the meshes of a URDF were found into its XML, those of links that are only seen left out.

    Args:
        robot: Root element, changed in place.
        path: The URDF.
        text: Its text.

    Returns:
        One line for each kind of place that is not where the URDF says.
    """
    folders, moved = package_folders(path, text), []
    for mesh in [mesh for place in robot.iter("collision") for mesh in place.iter("mesh")]:
        name = mesh.get("filename", "")
        found = find_mesh(name, path, folders)
        if found is None:
            continue
        inner = re.sub(r"^(package|file|model)://", "", name)
        if not any((folder / inner).is_file() for folder in folders):
            moved.append(found.name)
        mesh.set("filename", str(found.resolve()))
    if not moved:
        return []
    return [f"{len(moved)} meshes found elsewhere than the URDF says, by their names ({moved[0]}, …)"]


def visuals_for_collision(robot: ET.Element) -> list[str]:
    """Let what is seen of the links collide, where no link of a URDF has collision geometry.

    Args:
        robot: Root element, changed in place.

    Returns:
        The line that says so; empty if nothing was done.
    """
    links = robot.findall("link")
    if any(link.find("collision/geometry") is not None for link in links):
        return []
    count = 0
    for link in links:
        for visual in link.findall("visual"):
            if visual.find("geometry") is None:
                continue
            solid = ET.SubElement(link, "collision")
            solid.extend(copy.deepcopy(part) for part in visual if part.tag in ("origin", "geometry"))
            count += 1
    return [f"no link has collision geometry: the {count} visual ones stand in"] if count else []
