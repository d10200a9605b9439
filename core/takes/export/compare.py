"""Comparing what stands in a written file with what should."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from core.errors import ExportError, FormatError
from core.frames import FloatArray

_ACTION = "Check the disk and its free space, and export again."

T = TypeVar("T")


def compare(
    path: Path,
    written: FloatArray,
    expected: FloatArray,
    tolerance: float | FloatArray,
    names: Sequence[str],
    first_frame: int = 1,
    unit: str = "m",
) -> None:
    """Raises ExportError naming file, frame, column and value at the first difference.

    written, expected: (t, m, ...) float64; NaN equals only NaN. tolerance: of the same unit; broadcast.
    names: (m,) of the columns.
    """
    if written.shape != expected.shape:
        raise mismatch(path, f"it holds {_shape(written)} values where {_shape(expected)} were written")
    with np.errstate(invalid="ignore"):
        wrong = ~((np.abs(written - expected) <= tolerance) | (np.isnan(written) & np.isnan(expected)))
    if wrong.any():
        index = tuple(np.argwhere(wrong)[0])
        raise mismatch(
            path,
            f"frame {first_frame + index[0]}, {names[index[1]]}: {written[index]:.9g} {unit} stands where "
            f"{expected[index]:.9g} {unit} was written",
        )


def read_back(path: Path, read: Callable[[Path], T]) -> T:
    """What a reader makes of a written file. Raises ExportError where it is not sound."""
    try:
        return read(path)
    except FormatError as error:
        raise mismatch(path, error.what.rstrip(".")) from error


def mismatch(path: Path, what: str) -> ExportError:
    """The error of a file that does not read back as it was written."""
    return ExportError(f"{path.name} did not read back equal: {what}.", _ACTION)


def _shape(values: FloatArray) -> str:
    return " x ".join(map(str, values.shape))
