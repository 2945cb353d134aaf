"""Hand synergies: a mean posture and directions in joint space, named by joint, with PCA and files.

[Mavrogiannis2014] eq. (4): the reference posture is q_r = S σ + q̄.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..checks import finite_array
from ..exceptions import FileFormatError, InvalidValueError, NameNotFoundError, shown
from ..files.text import finite_number, read_text_file
from ..files.writing import write_text
from ..spatial import Array, readonly
from ..values import Value

MAX_SYNERGY_BYTES = 1_000_000
"""Largest synergy file that is read."""


@dataclass(frozen=True, eq=False, repr=False)
class SynergySpace(Value):
    """A space of postures q̄ + S σ.

    Attributes:
        joint_names: Joints, in the order of the rows.
        mean: Mean posture q̄ [rad], of shape (n_q,).
        basis: Synergy matrix S, unit columns of full rank, of shape (n_q, n).
        variance: Variance along each synergy [rad²], of shape (n,), or None if not known.
        name: Name of the set.
        provenance: Where the numbers come from.
    """

    joint_names: tuple[str, ...]
    mean: Array
    basis: Array
    variance: Array | None = None
    name: str = ""
    provenance: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        n_q = len(self.joint_names)
        if len(set(self.joint_names)) != n_q:
            raise InvalidValueError("joint_names", self.joint_names, "every joint once")
        basis = np.asarray(self.basis, dtype=float)
        if basis.ndim != 2 or not 1 <= basis.shape[1] <= n_q:
            raise InvalidValueError("basis", basis.shape, f"({n_q}, n) with 1 <= n <= {n_q}")
        object.__setattr__(self, "mean", finite_array("mean", self.mean, (n_q,)))
        object.__setattr__(self, "basis", finite_array("basis", basis, (n_q, basis.shape[1])))
        if not np.allclose(np.linalg.norm(basis, axis=0), 1.0, atol=1e-9):
            raise InvalidValueError("basis", "columns of other length", "columns of length 1")
        if np.linalg.matrix_rank(basis) < basis.shape[1]:
            raise InvalidValueError("basis", "rank-deficient", "linearly independent columns")
        if self.variance is not None:
            variance = finite_array("variance", self.variance, (basis.shape[1],))
            if (variance < 0.0).any():
                raise InvalidValueError("variance", variance.tolist(), "numbers >= 0")
            object.__setattr__(self, "variance", variance)

    @property
    def n_joints(self) -> int:
        """Number of joints n_q."""
        return len(self.joint_names)

    @property
    def n_synergies(self) -> int:
        """Number of synergies n."""
        return self.basis.shape[1]

    def truncated(self, n: int) -> SynergySpace:
        """Return the space of the first n synergies.

        Raises:
            InvalidValueError: If n is not from 1 to the number of synergies.
        """
        if isinstance(n, bool) or not isinstance(n, int) or not 1 <= n <= self.n_synergies:
            raise InvalidValueError("n_synergies", n, f"a whole number from 1 to {self.n_synergies}")
        variance = None if self.variance is None else self.variance[:n]
        return replace(self, basis=self.basis[:, :n], variance=variance)

    def joint_angles(self, sigma: npt.ArrayLike) -> Array:
        """Return q̄ + S σ [rad], of shape (n_q,), for σ [rad] of shape (n,); eq. (4)."""
        return self.mean + self.basis @ finite_array("sigma", sigma, (self.n_synergies,))

    def coordinates(self, q: npt.ArrayLike) -> Array:
        """Return the σ whose posture is closest to q in the least-squares sense [rad], of shape (n,)."""
        angles = finite_array("q", q, (self.n_joints,))
        return np.linalg.lstsq(self.basis, angles - self.mean, rcond=None)[0]

    def complement(self) -> Array:
        """Return S_⊥, an orthonormal basis of the complement of range(S), of shape (n_q, n_q − n)."""
        q_factor, _ = np.linalg.qr(self.basis, mode="complete")
        return q_factor[:, self.n_synergies :]

    def reordered(self, joint_names: Sequence[str]) -> SynergySpace:
        """Return the space with its rows in another order of joints, dropping joints not asked for.

        Raises:
            NameNotFoundError: If a joint is missing.
            InvalidValueError: If joints would be dropped.
        """
        index = {name: row for row, name in enumerate(self.joint_names)}
        for name in joint_names:
            if name not in index:
                raise NameNotFoundError("joint of synergy set " + (self.name or "?"), name, self.joint_names)
        if len(joint_names) != self.n_joints:
            raise InvalidValueError("joint_names", list(joint_names), f"all of {', '.join(self.joint_names)}")
        rows = [index[name] for name in joint_names]
        return replace(self, joint_names=tuple(joint_names), mean=self.mean[rows], basis=self.basis[rows])

    def explained_variance(self) -> Array:
        """Return the cumulative share of variance of the first 1, 2, … synergies, of shape (n,).

        Raises:
            InvalidValueError: If the variances are not known.
        """
        if self.variance is None or not self.variance.sum() > 0.0:
            raise InvalidValueError("variance", None, "a synergy set with variances")
        return np.cumsum(self.variance) / self.variance.sum()


def synergies_from_covariance(
    joint_names: Sequence[str],
    mean: npt.ArrayLike,
    covariance: npt.ArrayLike,
    *,
    name: str = "",
    provenance: str = "",
) -> SynergySpace:
    """Return all principal components of a covariance, by falling variance.

    Args:
        joint_names: Joints.
        mean: Mean posture [rad], of shape (n_q,).
        covariance: Covariance [rad²], symmetric, of shape (n_q, n_q).
        name: Name of the set.
        provenance: Where the numbers come from.

    Returns:
        n_q synergies; the entry of largest size of each is positive.
    """
    n_q = len(joint_names)
    matrix = finite_array("covariance", covariance, (n_q, n_q))
    if not np.allclose(matrix, matrix.T, atol=1e-9 * max(1.0, float(np.abs(matrix).max()))):
        raise InvalidValueError("covariance", "not symmetric", "a symmetric matrix")
    values, vectors = np.linalg.eigh(matrix)
    basis = vectors[:, ::-1]
    largest = np.abs(basis).argmax(axis=0)
    basis = basis * np.sign(basis[largest, np.arange(n_q)])
    variance = np.maximum(values[::-1], 0.0)
    return SynergySpace(tuple(joint_names), finite_array("mean", mean, (n_q,)), basis, variance, name, provenance)


def synergies_from_postures(
    joint_names: Sequence[str], postures: npt.ArrayLike, *, name: str = "", provenance: str = ""
) -> SynergySpace:
    """Return the principal components of postures.

    Args:
        joint_names: Joints.
        postures: Joint angles [rad], one posture a row, of shape (N, n_q), N ≥ 2.
        name: Name of the set.
        provenance: Where the numbers come from.

    Returns:
        n_q synergies, by falling variance.

    Raises:
        InvalidValueError: If there are fewer than two postures or numbers are not finite.
    """
    rows = np.atleast_2d(np.asarray(postures, dtype=float))
    if rows.shape[0] < 2:
        raise InvalidValueError("postures", rows.shape, f"at least 2 rows of {len(joint_names)} joint angles")
    angles = finite_array("postures", rows, (rows.shape[0], len(joint_names)))
    covariance = np.atleast_2d(np.cov(angles, rowvar=False))
    return synergies_from_covariance(joint_names, angles.mean(axis=0), covariance, name=name, provenance=provenance)


def save_synergies(space: SynergySpace, path: Path) -> None:
    """Write a synergy set as CSV: comment lines ``# name`` and ``# provenance``, then a row a joint.

    Args:
        space: The set.
        path: File to write.

    Raises:
        InvalidValueError: If a name can't be written so that it would be read back.
        FileFormatError: If the file can't be written.
    """
    for joint in (*space.joint_names, space.name):
        if any(character in joint for character in ',"\r\n') or joint.startswith("#") or joint == "variance":
            raise InvalidValueError("name", joint, "names without comma, quote or line break, not # or variance")
    lines = [f"# name: {space.name}", *(f"# provenance: {line}" for line in space.provenance.splitlines())]
    lines.append(",".join(["joint", "mean_rad", *(f"s{k + 1}" for k in range(space.n_synergies))]))
    for joint, mean, row in zip(space.joint_names, space.mean, space.basis, strict=True):
        lines.append(",".join([joint, f"{mean:.17g}", *(f"{value:.17g}" for value in row)]))
    if space.variance is not None:
        lines.append(",".join(["variance", "", *(f"{value:.17g}" for value in space.variance)]))
    write_text(path, "\n".join(lines) + "\n")


def load_synergies(path: Path) -> SynergySpace:
    """Read a synergy set written by :func:`save_synergies`.

    Args:
        path: CSV file.

    Returns:
        The set.

    Raises:
        FileFormatError: If it can't be read or a row or number is malformed; the reason names it.
    """
    text = read_text_file(path, MAX_SYNERGY_BYTES)
    notes = [line[1:].strip() for line in text.splitlines() if line.startswith("#")]
    table = _table(path, text)
    n = len(table[0]) - 2 if table else 0
    if n < 1 or table[0] != ["joint", "mean_rad", *(f"s{k + 1}" for k in range(n))]:
        raise FileFormatError(path, "the header row has to be joint,mean_rad,s1,s2,…")
    names, means, rows, variance = [], [], [], None
    for number, row in enumerate(table[1:], start=2):
        if len(row) != n + 2:
            raise FileFormatError(path, f"table row {number}: {len(row)} columns instead of {n + 2}")
        if variance is not None:
            raise FileFormatError(path, f"table row {number}: nothing may follow the variances")
        if row[0] == "variance":
            variance = [_number(path, number, table[0][k + 2], row[k + 2]) for k in range(n)]
            continue
        names.append(row[0])
        means.append(_number(path, number, "mean_rad", row[1]))
        rows.append([_number(path, number, table[0][k + 2], row[k + 2]) for k in range(n)])
    try:
        return SynergySpace(
            tuple(names),
            readonly(means),
            readonly(rows).reshape(len(names), n),
            None if variance is None else readonly(variance),
            name=_note(notes, "name"),
            provenance=_note(notes, "provenance"),
        )
    except InvalidValueError as error:
        raise FileFormatError(path, str(error)) from None


def _table(path: Path, text: str) -> list[list[str]]:
    """Return the rows of the table, without comment lines."""
    lines = (line for line in text.splitlines() if line.strip() and not line.startswith("#"))
    try:
        return list(csv.reader(lines, strict=True))
    except csv.Error as error:
        raise FileFormatError(path, f"not a table of comma-separated values: {error}") from None


def _number(path: Path, row: int, column: str, text: str) -> float:
    """Return a finite number of the table."""
    return finite_number(path, f"table row {row}, column {shown(column)}", text)


def _note(notes: list[str], key: str) -> str:
    """Return the lines of a comment key, joined."""
    return "\n".join(note.partition(":")[2].strip() for note in notes if note.startswith(f"{key}:"))
