"""What a recording says of the points somebody picked. Knows no window; runs beside it."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.review.job import Report
from core.errors import CancelledError, PhalanxError
from core.frames import FloatArray, MarkerFrame
from core.props.define import Definition, define, modelled, sphere_through
from core.props.picked import Followed, check_rigid, followed, still_words, stretch_about
from core.props.prop import Prop, Shape
from core.props.symmetry import symmetry_words

ROUND = 1.25
"""A sphere so many times as wide as its markers reach, and no wider, is taken for what they sit on."""

LONG = 3.0
"""A thing so many times as long as thick is taken for a cylinder."""

_STRETCH_SHARE = 0.2  # of the work


@dataclass(frozen=True)
class Examined:
    """samples_m: (t, m, 3) [m], what the definition rests on. warnings: in words, for whoever defines it."""

    samples_m: FloatArray
    definition: Definition
    followed: Followed
    stretch_s: float
    warnings: tuple[str, ...]

    def prop(self, name: str, shape: Shape, size_m: tuple[float, ...] = ()) -> Prop:
        """The prop in this shape; () for the smallest that holds its markers. Raises PhalanxError."""
        return define(name, self.samples_m, shape, size_m).prop

    def usual_size_m(self, shape: Shape) -> tuple[float, ...]:
        """The lengths of the smallest model of this shape that holds the markers [m]."""
        return modelled(self.definition.prop.markers_m, shape)[1].size_m

    @property
    def usual_shape(self) -> Shape:
        """What the markers look most like."""
        markers_m = self.definition.prop.markers_m
        thick_m, long_m = np.sort(np.ptp(markers_m, axis=0))[1:]
        ball = sphere_through(markers_m)  # five points nearly always lie on one, if it is large enough
        if ball is not None and 2.0 * ball[1] <= ROUND * long_m:
            return "sphere"
        return "cylinder" if long_m > LONG * thick_m else "box"


def examine(frames: Sequence[MarkerFrame], at: int, rows: Sequence[int], report: Report) -> Examined:
    """Are the points `rows` of frame `at` one rigid thing, and how would it be tracked through all frames?

    Raises PhalanxError, which says which point is not, and CancelledError once `report` is stopped.
    """

    def tell(share: float) -> bool:
        return report(_STRETCH_SHARE * share, "Following the points")

    stretch = stretch_about(frames, at, rows, tell)
    check_rigid(stretch.samples_m)
    samples_m = stretch.samples_m
    made = define("", samples_m, "none")
    seen = followed(
        frames, len(frames), made.prop,
        lambda share: report(_STRETCH_SHARE + (1.0 - _STRETCH_SHARE) * share, "Tracking it through the frames"),
    )  # fmt: skip
    if report.stopped:
        raise CancelledError
    symmetry = symmetry_words(made.prop.markers_m)
    whole = np.isfinite(seen.samples_m).all(axis=(1, 2))
    # Where ids broke the stretch is short: the prop itself has found its markers again. One that looks the same from
    # two sides may have taken them for each other.
    if not symmetry and whole.sum() > len(samples_m):
        longer_m = np.concatenate([samples_m[:1], seen.samples_m[whole]])
        with contextlib.suppress(PhalanxError):  # not rigid all through: the plot shows where
            made, samples_m = define("", longer_m, "none"), longer_m
    last = stretch.first + len(stretch.samples_m) - 1
    stretch_s = frames[last].times.host_s - frames[stretch.first].times.host_s
    warnings = tuple(filter(None, (still_words(samples_m), symmetry)))
    return Examined(samples_m, made, seen, stretch_s, warnings)
