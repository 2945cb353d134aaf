"""Checked numbers: each returns the value or raises one error that names the field and what is allowed."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np
import numpy.typing as npt

from .exceptions import InvalidValueError, NameNotFoundError
from .spatial import Array, readonly

UNIT_ROUNDING = 1e-15
"""How far the length of a unit vector may be off by rounding."""
LARGEST_ENTRY = 1e100
"""Largest number of an array where nothing narrower is known: sums of squares are finite."""


def finite_array(field: str, values: npt.ArrayLike, shape: tuple[int, ...]) -> Array:
    """Return values as a read-only array, checked for shape and finiteness.

    Args:
        field: Name used in the error.
        values: The numbers.
        shape: Required shape.

    Returns:
        Read-only array of that shape.

    Raises:
        InvalidValueError: If the shape differs, or a number is not finite or so large that its square is not.
    """
    try:
        array = readonly(values)
    except (TypeError, ValueError, OverflowError):
        raise InvalidValueError(field, values, f"numbers of shape {shape}") from None
    if array.shape != shape:
        raise InvalidValueError(field, array.shape, f"an array of shape {shape}")
    if not np.isfinite(array).all():
        raise InvalidValueError(field, array.tolist(), "finite numbers")
    if np.abs(array).max(initial=0.0) > LARGEST_ENTRY:
        raise InvalidValueError(field, array.tolist(), f"numbers up to {LARGEST_ENTRY:g} in size")
    return array


def unit_vector(field: str, values: npt.ArrayLike, size: int = 3) -> Array:
    """Return a direction scaled to length one; one that has it already, to rounding, stays as it is.

    Args:
        field: Name used in the error.
        values: The direction, of shape (size,).
        size: Number of components.

    Returns:
        Read-only unit vector, of shape (size,).

    Raises:
        InvalidValueError: If it is zero, not finite or of the wrong size.
    """
    array = finite_array(field, values, (size,))
    length = float(np.linalg.norm(array))
    if length < 1e-12:
        raise InvalidValueError(field, array.tolist(), "a direction that is not zero")
    return array if abs(length - 1.0) < UNIT_ROUNDING else readonly(array / length)


def positive_definite(field: str, values: npt.ArrayLike, size: int) -> Array:
    """Return a symmetric positive definite matrix, checked.

    Args:
        field: Name used in the error.
        values: The matrix.
        size: Number of its rows.

    Returns:
        Read-only matrix of shape (size, size), exactly symmetric.

    Raises:
        InvalidValueError: If it has another shape, or is not finite, symmetric to rounding and positive definite.
    """
    matrix = finite_array(field, values, (size, size))
    largest = np.abs(matrix).max(initial=0.0)
    skewed = np.abs(matrix - matrix.T).max(initial=0.0) > 1e-9 * largest
    if skewed or np.linalg.eigvalsh(matrix).min(initial=np.inf) <= 1e-12 * largest:
        raise InvalidValueError(field, matrix.tolist(), "a symmetric positive definite matrix")
    return readonly(0.5 * (matrix + matrix.T))


LARGEST = 1e9
"""Largest positive number where nothing narrower is known: products of several of them are finite."""


def positive(
    field: str, value: float, *, zero_allowed: bool = False, unit: str = "", at_most: float = LARGEST
) -> float:
    """Return a number checked to be finite and positive.

    Args:
        field: Name used in the error.
        value: The number.
        zero_allowed: Whether zero passes.
        unit: Unit named in the error.
        at_most: Largest number allowed.

    Returns:
        The number as a float.

    Raises:
        InvalidValueError: If it is not.
    """
    allowed = f"a finite number {'>=' if zero_allowed else '>'} 0{f' {unit}' if unit else ''}"
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise InvalidValueError(field, value, allowed) from None
    if not math.isfinite(number) or number < 0.0 or (number == 0.0 and not zero_allowed):
        raise InvalidValueError(field, value, allowed)
    if number > at_most:
        raise InvalidValueError(field, value, f"{allowed}, at most {at_most:g}")
    return number


def positive_whole(name: str, value: object, at_most: int | None = None) -> None:
    """Check that a value is a whole number of at least one, and not above a bound.

    Raises:
        InvalidValueError: If it is not.
    """
    if isinstance(value, bool) or not isinstance(value, int) or value < 1 or (at_most is not None and value > at_most):
        allowed = "a whole number >= 1" if at_most is None else f"a whole number from 1 to {at_most}"
        raise InvalidValueError(name, value, allowed)


def known_names(what: str, names: Sequence[str], known: Collection[str]) -> tuple[str, ...]:
    """Return names that are known; ``all`` alone stands for all of them.

    Args:
        what: What they are names of.
        names: The names.
        known: Those that there are.

    Raises:
        NameNotFoundError: If one is not known.
    """
    chosen = tuple(known) if tuple(names) == ("all",) else tuple(names)
    for name in chosen:
        if name not in known:
            raise NameNotFoundError(what, name, (*known, "all"))
    return chosen
