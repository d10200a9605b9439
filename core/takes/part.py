"""A part of a solved recording, as a solution of its own: its times count from its first frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from core.errors import ExportError
from core.frames import FloatArray, MarkerFrame, TrackedFrame
from core.takes.matching import match_solved
from core.takes.solution import Solution
from core.takes.store import Frames

_NEAR_S = 1e-6  # a time read from a file and typed again means the same frame


def part_of(solution: Solution, from_s: float | None, to_s: float | None) -> Solution:
    """From one moment to another, both included, in seconds from the first frame; None: from its beginning, or to its
    end. Raises ExportError where no frame lies between them."""
    if from_s is None and to_s is None:
        return solution
    times_s = _times_s(solution.raw if len(solution.raw) else solution.solved)
    begin_s = -np.inf if from_s is None else from_s - _NEAR_S
    end_s = np.inf if to_s is None else to_s + _NEAR_S
    inside = np.flatnonzero((times_s >= begin_s) & (times_s <= end_s))
    if not len(inside):
        there = f"its frames are from 0 to {times_s.max():.3f} s" if len(times_s) else "it has none at all"
        end = "its end" if to_s is None else f"{to_s:g} s"
        raise ExportError(
            f"{solution.name} has no frames from {from_s or 0.0:g} s to {end}: {there}.",
            "Choose another part.",
        )
    return frames_of(solution, int(inside[0]), int(inside[-1]))


def frames_of(solution: Solution, first: int, last: int) -> Solution:
    """Raw frames `first` to `last`, both included, with their solved ones, holes and marks; of a solution without raw
    frames, solved ones."""
    if not len(solution.raw):
        times_s, solved = _times_s(solution.solved), solution.solved[first : last + 1]
        return _cut(solution, (), solved, times_s[first : last + 1], len(times_s))
    times_s = _times_s(solution.raw)
    matched = match_solved(times_s, _times_s(solution.solved, solution.raw[0]))[first : last + 1]
    used = matched[matched >= 0]
    solved = solution.solved[int(used.min()) : int(used.max()) + 1] if len(used) else solution.solved[:0]
    return _cut(solution, solution.raw[first : last + 1], solved, times_s[first : last + 1], len(times_s))


def _cut(
    solution: Solution,
    raw: Sequence[MarkerFrame],
    solved: Sequence[TrackedFrame],
    times_s: FloatArray,
    n_before: int,
) -> Solution:
    if not len(times_s) or len(times_s) == n_before:
        return replace(solution, raw=raw, solved=solved)
    begin_s, end_s = float(times_s[0]), float(times_s[-1])
    marks = [
        replace(mark, time_s=mark.time_s - begin_s)
        for mark in solution.marks
        if begin_s - _NEAR_S <= mark.time_s <= end_s + _NEAR_S
    ]
    return replace(
        solution,
        raw=raw,
        solved=solved,
        holes=solution.holes.within(begin_s, end_s).shifted(-begin_s),
        marks=tuple(marks),
        start_s=solution.start_s + begin_s,
    )


def _times_s(frames: Sequence[MarkerFrame] | Sequence[TrackedFrame], first: MarkerFrame | None = None) -> FloatArray:
    """(n,) float64 [s], from the first frame, or from `first`; those of a take are known without reading it."""
    if isinstance(frames, Frames):
        return frames.times_s
    host_s = np.array([frame.times.host_s for frame in frames], dtype=np.float64)
    begin_s = first.times.host_s if first is not None else host_s[0] if len(host_s) else 0.0
    return host_s - begin_s
