"""What every reader does at the end: check what it read and make a Recording of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from core.errors import FormatError
from core.frames import BoolArray, FloatArray, IntArray
from core.gaps import FARTHEST_M, open_gaps, present
from core.printable import printable
from core.recording import Recording
from core.takes.formats.clock import FASTEST_HZ, rate_of, times_of, usable

_MOST_NAMED = 3

MAX_VALUES = 1 << 28
"""Most coordinates of one recording: 2 GiB in memory, two hours of 100 markers at 120 Hz."""


def assemble(
    name: str,
    rate_hz: float,
    points_m: FloatArray,
    labels: Sequence[str],
    frame_numbers: FloatArray | None = None,
    times_s: FloatArray | None = None,
    ids: IntArray | None = None,
    display_name: str = "",
    to_y_up: FloatArray | None = None,
    used: BoolArray | None = None,
    warnings: Sequence[str] = (),
) -> Recording:
    """A recording of points (t, m, 3) float64 [m], NaN for gaps, in the file's axes.

    name: the file's, for errors. rate_hz: NaN if the file does not say; then the times tell it.
    frame_numbers, times_s: (t,) as the file gives them; where times do not increase, the numbers and the rate tell
    them; where those do not, rows are counted.
    ids: (t, m) int64 of unlabelled points; labelled trajectories are numbered from 0.
    to_y_up: (3, 3) rotation of the file's axes to the house's; None if they are the same.
    used: (t, m) bool, where an unlabelled recording should have a point. warnings: of the reader, in sentences.
    Raises FormatError.
    """
    n_frames, n_columns = points_m.shape[:2]
    if n_frames == 0:
        raise FormatError(f"{name} holds no frames, only a header.", "Export it again.")
    if n_columns == 0 and ids is None:
        raise FormatError(f"{name} holds no markers.", "Export it with its labelled or unlabelled markers.")
    labels = tuple(map(printable, labels))
    told = [*warnings, *_names_again(labels), *_no_names(labels)]
    labels = unique_labels(labels)
    told += _far_points(name, points_m, labels)
    gaps = open_gaps(points_m, used)
    rate_hz = _rate(name, rate_hz, times_s)
    if to_y_up is not None:
        points_m = np.ascontiguousarray(points_m @ to_y_up.T)
    return Recording(
        name=display_name or name,
        rate_hz=rate_hz,
        times_s=times_of(n_frames, rate_hz, frame_numbers, times_s, told),
        frame_numbers=_frame_numbers(n_frames, frame_numbers, told),
        points_m=points_m,
        labels=labels,
        ids=np.arange(n_columns, dtype=np.int64) if ids is None else ids,
        gaps=gaps,
        warnings=tuple(told),
        source_s=times_s if usable(times_s) else None,
    )


def unique_labels(labels: Sequence[str]) -> tuple[str, ...]:
    """The labels, with a number added where one comes again or is empty."""
    taken: set[str] = set()
    unique: list[str] = []
    counts: dict[str, int] = {}
    for i, label in enumerate(labels):
        base = label.strip() or f"marker {i + 1}"
        candidate, count = base, counts.get(base, 1)
        while candidate in taken:
            count += 1
            candidate = f"{base} {count}"
        counts[base] = count  # the numbers below are taken: thousands of one name are not counted through each time
        taken.add(candidate)
        unique.append(candidate)
    return tuple(unique)


def check_size(name: str, n_frames: int, n_columns: int) -> None:
    """Raises FormatError where a recording would not fit in memory."""
    if n_frames * n_columns * 3 > MAX_VALUES:
        raise FormatError(
            f"{name} holds {n_frames:,} frames of up to {n_columns:,} points, too many to open at once.",
            f"Export a part of it; {MAX_VALUES // (3 * max(n_columns, 1))} frames of that many points can be read.",
        )


def _names_again(labels: Sequence[str]) -> list[str]:
    """A warning where labels come more than once."""
    again = [label for label, n in Counter(label.strip() for label in labels).items() if label and n > 1]
    if not again:
        return []
    others = f" and {len(again) - _MOST_NAMED} more" if len(again) > _MOST_NAMED else ""
    are = "is the name of several markers" if len(again) == 1 else "are each the name of several markers"
    return [f"{', '.join(again[:_MOST_NAMED])}{others} {are}: from the second on they get a number."]


def _no_names(labels: Sequence[str]) -> list[str]:
    """A warning where labels are empty."""
    called = [f"marker {i + 1}" for i, label in enumerate(labels) if not label.strip()]
    if not called:
        return []
    if len(called) == 1:
        return [f"A marker has no name; it is called {called[0]}, by its place."]
    others = f" and {len(called) - _MOST_NAMED} more" if len(called) > _MOST_NAMED else ""
    return [f"{len(called)} markers have no name; they are called {', '.join(called[:_MOST_NAMED])}{others}, by place."]


def _far_points(name: str, points_m: FloatArray, labels: Sequence[str]) -> list[str]:
    """A warning where points lie out of range. Raises FormatError where most do: one may be damage, most are a wrong
    unit."""
    given = ~np.isnan(points_m).any(axis=2) & points_m.any(axis=2)
    far = given & ~present(points_m)
    n_far = int(far.sum())
    if not n_far:
        return []
    frame, column = np.argwhere(far)[0]
    axis = int(np.argmax(np.abs(points_m[frame, column])))
    who = labels[column] if labels else f"point {column + 1}"
    place = f"{who} at {'xyz'[axis]} = {points_m[frame, column, axis]:g} m"
    if 2 * n_far > int(given.sum()):
        raise FormatError(
            f"{name}, frame {frame + 1}: {place}, and most others are as far out.",
            f"Positions must lie within {FARTHEST_M:g} m; check the unit of the export.",
        )
    which = f"in frame {frame + 1}" if n_far == 1 else f"the first in frame {frame + 1}"
    points = "1 point lies" if n_far == 1 else f"{n_far:,} points lie"
    are = "is left out as a gap" if n_far == 1 else "are left out as gaps"
    return [f"{points} beyond {FARTHEST_M:g} m and {are}, {which}: {place}."]


def _rate(name: str, rate_hz: float, times_s: FloatArray | None) -> float:
    if 0.0 < rate_hz <= FASTEST_HZ:
        return float(rate_hz)
    rate = rate_of(times_s)
    if 0.0 < rate <= FASTEST_HZ:
        return rate
    if np.isfinite(rate):
        raise FormatError(
            f"{name} has times that would mean {rate:,.0f} Hz.",
            "Export it again with its times in seconds, or its rate.",
        )
    said = f" (its header says {rate_hz:g} Hz)" if np.isfinite(rate_hz) else ""
    raise FormatError(
        f"{name} does not tell its frame rate{said}, and has no times that would.",
        "Export it again with its times or its rate.",
    )


def _frame_numbers(n_frames: int, numbers: FloatArray | None, told: list[str]) -> IntArray:
    if numbers is not None and np.all(np.abs(numbers) < 2**53):
        if np.all(np.diff(numbers) > 0):
            return numbers.astype(np.int64)
        told.append("Its frame numbers do not increase; frames are counted instead.")
    return np.arange(n_frames, dtype=np.int64)
