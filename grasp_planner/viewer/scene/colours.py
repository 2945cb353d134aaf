"""Colours of what the page draws many of at once: arrows, dots and cones."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def instance_colours(colours: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Return colours as the page's library wants them where it draws many copies of one mesh.

    It takes them for linear light there, and for sRGB everywhere else: unchanged they would come out pale.

    Args:
        colours: sRGB from 0 to 255, of shape (3,) or (n, 3).

    Returns:
        Linear light from 0 to 255, of the same shape.
    """
    shares = np.asarray(colours, dtype=float) / 255.0
    # The transfer function of IEC 61966-2-1.
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    return np.round(255.0 * linear).astype(np.uint8)
