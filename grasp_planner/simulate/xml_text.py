"""Writing numbers into MJCF without losing any of their digits."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

Element = ElementTree.Element


def attribute_text(values: Iterable[float]) -> str:
    """Return numbers as text that reads back to the same doubles."""
    return " ".join(repr(float(value)) for value in values)


def add(parent: Element, tag: str, **attributes: str | float | Iterable[float]) -> Element:
    """Add an element; numbers are written in full."""
    texts = {}
    for name, value in attributes.items():
        if isinstance(value, str):
            text = value
        elif isinstance(value, int | float | np.floating):
            text = repr(float(value)) if not isinstance(value, int) else str(value)
        else:
            text = attribute_text(value)
        texts[name] = text
    return ElementTree.SubElement(parent, tag, texts)


def pose_attributes(pose: Any) -> dict[str, list[float]]:
    """Return ``pos`` and ``quat`` (w, x, y, z) of a pin.SE3."""
    x, y, z, w = (float(value) for value in pin.Quaternion(np.array(pose.rotation)).normalized().coeffs())
    return {"pos": [float(value) for value in pose.translation], "quat": [w, x, y, z]}
