"""Subspaces of hand postures: what the joint angles of a hand do together (Schröder 2017, eq. 3).

A subspace is the mean and the first principal components of many postures, one small JSON file:

    {"format": "phalanx-subspace", "version": 1, "name": "generic", "description": "...", "mean_rad": [20 numbers],
     "basis": [l rows of 20 numbers], "std_rad": [l numbers], "residual_std_rad": [20 numbers]}
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from core.errors import FormatError, PhalanxError
from core.frames import FloatArray, IntArray
from core.json_form import checked_form
from core.printable import MOST_OF_TEXT, printable
from core.untrusted.json_text import parse_json, read_json
from core.untrusted.values import numbers, text_of
from core.whole_file import write_whole

FORMAT = "phalanx-subspace"
VERSION = 1
N_ANGLES = 20

LARGEST_RAD = 10.0
"""Above any angle of a joint and any deviation of one."""


@dataclass(frozen=True)
class Subspace:
    """Principal components of digit angles.

    mean_rad: (20,) float64. basis: (20, l) float64, orthonormal columns, the largest variance first.
    std_rad: (l,) float64, standard deviation along each. residual_std_rad: (20,) float64, of each angle about the
    subspace.
    """

    name: str
    description: str
    mean_rad: FloatArray
    basis: FloatArray
    std_rad: FloatArray
    residual_std_rad: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", printable(self.name))
        object.__setattr__(self, "description", printable(self.description, MOST_OF_TEXT))

    @property
    def dimensions(self) -> int:
        """l."""
        return int(self.basis.shape[1])

    def to_dict(self) -> dict[str, Any]:
        """The JSON form of this subspace."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "name": self.name,
            "description": self.description,
            "mean_rad": _rounded(self.mean_rad),
            "basis": [_rounded(column) for column in self.basis.T],
            "std_rad": _rounded(self.std_rad),
            "residual_std_rad": _rounded(self.residual_std_rad),
        }

    @classmethod
    def from_dict(cls, data: Any, source: str = "subspace") -> Subspace:
        """Raises FormatError naming `source` and what is wrong."""
        data = checked_form(data, source, FORMAT, (VERSION,), "subspace", "make the subspace again")
        try:
            rows = numbers(data["basis"], -1, N_ANGLES)
            mean, residual = (numbers(data[key], N_ANGLES) for key in ("mean_rad", "residual_std_rad"))
            std = numbers(data["std_rad"], len(rows))
        except (KeyError, ValueError) as error:
            words = f"it has no {error}" if isinstance(error, KeyError) else str(error)
            raise FormatError(f"{source} cannot be read ({words}).", "Make it again with phalanx subspace.") from error
        largest = max(float(np.abs(values).max(initial=0.0)) for values in (rows, mean, residual, std))
        least = float(min(std.min(initial=0.0), residual.min(initial=0.0)))
        if largest > LARGEST_RAD or least < 0.0:
            wrong = f"a deviation of {least:g}" if least < 0.0 else f"{largest:g}"
            raise FormatError(f"{source} holds {wrong} rad: no hand moves so.", "Make it again with phalanx subspace.")
        if len(rows) > N_ANGLES or np.abs(rows @ rows.T - np.eye(len(rows))).max(initial=0.0) > 1e-4:
            raise FormatError(f"{source}: its basis is not orthonormal.", "Make it again with phalanx subspace.")
        return cls(
            text_of(data, "name", source, source), text_of(data, "description", source, ""), mean, rows.T, std, residual
        )

    def truncated(self, dimensions: int) -> Subspace:
        """Only its first components; what the others spanned joins the residual."""
        rest = self.basis[:, dimensions:] * self.std_rad[dimensions:]
        residual = np.sqrt(self.residual_std_rad**2 + (rest**2).sum(axis=1))
        return Subspace(
            self.name, self.description, self.mean_rad, self.basis[:, :dimensions], self.std_rad[:dimensions], residual
        )

    @property
    def explained(self) -> FloatArray:
        """(l,) float64, share of the variance that its first 1, 2, ... l components explain."""
        variances = self.std_rad**2
        whole = variances.sum() + (self.residual_std_rad**2).sum()
        shares: FloatArray = np.cumsum(variances) / max(float(whole), 1e-300)
        return shares

    def nearest(self, postures_rad: FloatArray) -> FloatArray:
        """(n, 20) float64 [rad], for every posture (n, 20) the nearest one within the subspace."""
        within: FloatArray = self.mean_rad + (postures_rad - self.mean_rad) @ self.basis @ self.basis.T
        return within

    def covariance(self) -> FloatArray:
        """(20, 20) float64 [rad^2], of the postures it was made from, as it models them."""
        scaled = self.basis * self.std_rad
        covariance: FloatArray = scaled @ scaled.T + np.diag(self.residual_std_rad**2)
        return covariance


def subspace_of(
    postures_rad: FloatArray, name: str, description: str = "", *, variance: float = 0.95, dimensions: int | None = None
) -> Subspace:
    """PCA of postures (n, 20) float64 [rad]; so many dimensions, or as many as explain the share `variance`.

    The largest entry of every component is positive. Raises PhalanxError for fewer than two postures.
    """
    if len(postures_rad) < 2:
        raise PhalanxError(
            f"A subspace cannot be made of {len(postures_rad)} postures.", "Give more motion: a minute, better five."
        )
    mean = postures_rad.mean(axis=0)
    _, singular, rows = np.linalg.svd(postures_rad - mean, full_matrices=False)
    rows *= np.sign(rows[np.arange(len(rows)), np.abs(rows).argmax(axis=1)])[:, None]
    variances = singular**2 / max(len(postures_rad) - 1, 1)
    share = np.cumsum(variances) / max(float(variances.sum()), 1e-300)
    kept = dimensions if dimensions is not None else int(np.searchsorted(share, variance - 1e-12) + 1)
    whole = Subspace(name, description, mean, rows.T, np.sqrt(variances), np.zeros(N_ANGLES))
    return whole.truncated(kept)


THINNED_RAD = 0.2
"""A posture counts again when the hand has moved so far since the last that counted, over all angles together."""


def thinned(postures_rad: FloatArray, apart_rad: float = THINNED_RAD) -> IntArray:
    """(k,) int64, of a motion's postures (n, 20) in the order of time those to learn from: each `apart_rad` [rad] from
    the one before, so that a pose held for a minute weighs no more than one that is passed through."""
    kept, last = [], np.full(N_ANGLES, np.inf)
    for i, posture in enumerate(postures_rad):
        away = posture - last
        if not away @ away < apart_rad**2:
            kept.append(i)
            last = posture
    return np.asarray(kept, dtype=np.int64)


def subspace_names() -> tuple[str, ...]:
    """Names of the subspaces shipped with Phalanx."""
    return tuple(sorted(f.name[:-5] for f in (files("resources") / "subspaces").iterdir() if f.name.endswith(".json")))


@cache
def shipped_subspace(name: str) -> Subspace:
    """A shipped subspace by name. Raises KeyError for an unknown one."""
    if name not in subspace_names():
        raise KeyError(name)
    text = (files("resources") / "subspaces" / f"{name}.json").read_text(encoding="utf-8")
    return Subspace.from_dict(parse_json(text, f"Subspace {name}", "Install Phalanx again."), f"Subspace {name}")


def load_subspace(name_or_path: str | Path) -> Subspace:
    """A shipped subspace by name, or a user's own file. Raises FormatError."""
    if str(name_or_path) in subspace_names():
        return shipped_subspace(str(name_or_path))
    source = f"Subspace file {name_or_path}"
    mend = "Choose a subspace file, or one of Phalanx: " + ", ".join(subspace_names()) + "."
    return Subspace.from_dict(read_json(Path(name_or_path), source, mend), source)


def save_subspace(subspace: Subspace, path: Path) -> None:
    """Writes a subspace file, in the place of an older one only when it is whole. Raises FormatError."""
    write_whole(path, json.dumps(subspace.to_dict(), indent=1, ensure_ascii=False) + "\n", "Subspace")


def _rounded(values: FloatArray) -> list[float]:
    return [round(float(value), 7) for value in values]
