"""How well a recording was tracked: share of frames, residuals, and labels against those the file gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from app.labels import marker_of, owned
from core.cast import Cast, cast_of, hand_names, hands_of
from core.frames import NO_ID, NO_POINT, HandKey, HandState, IntArray, MarkerFrame, Side, TrackedFrame
from core.profile import Profile
from core.recording import Recording
from core.takes.holes import NO_HOLES, Holes, holes_of


@dataclass(frozen=True)
class HandFigures:
    """One hand over a recording.

    tracked: share of the frames that should be there with a pose, 0..1. first_s: time of its first pose [s]. rms_m:
    over all observed markers [m]. hidden: share of its markers that no point explained while it was tracked, 0..1.
    """

    tracked: float
    first_s: float
    rms_m: float
    hidden: float


@dataclass(frozen=True)
class TrackFigures:
    """One recording. hands: only those found at all, as "right", of several performers as "Anna right".

    labels_right: share of the points of hand markers that carry their true label, 0..1, NaN if the file names none;
    a point without a label counts as wrong. labelled_points: how many such points there are. labels_given: the engine
    was told the labels, so that these figures say nothing of its own labelling. filled: share of the frames in which
    a gap was filled, 0..1. holes: where it has no frames; what is missing counts as not tracked. warnings: those of the
    file's reader. gaps: points that it does not have (core.gaps.Gaps.figures). speed: seconds of the recording solved
    per second, NaN if not measured. files: what was written; notes: what there is to say of them; failed: why a format
    could not be written.
    """

    file: Path
    frames: int
    duration_s: float
    tracked: float
    rms_m: float
    hands: dict[str, HandFigures] = field(default_factory=dict)
    labels_right: float = float("nan")
    labelled_points: int = 0
    labels_given: bool = False
    filled: float = 0.0
    holes: Holes = NO_HOLES
    warnings: tuple[str, ...] = ()
    gaps: Mapping[str, float] = field(default_factory=dict)
    speed: float = float("nan")
    files: tuple[Path, ...] = ()
    notes: tuple[str, ...] = ()
    failed: dict[str, str] = field(default_factory=dict)


def frames_and_columns(
    recording: Recording, unlabelled: bool = False, seed: int = 0, no_ids: bool = False
) -> tuple[list[MarkerFrame], list[IntArray]]:
    """The frames of a recording, and for each of their points the column of the recording that it came from.

    unlabelled: withhold the labels. A labelled file's columns are its labels, so the points of each frame then come
    in random order and without ids; the ids of points without labels are no labels and stay. no_ids: they go, too.
    """
    frames = list(recording.frames())
    columns = [np.flatnonzero(seen) for seen in ~np.isnan(recording.points_m[:, :, 0])]
    if no_ids or (unlabelled and recording.labels):
        frames, orders = without_ids(frames, seed)
        columns = [column[order] for column, order in zip(columns, orders, strict=True)]
    return frames, columns


def without_ids(frames: Sequence[MarkerFrame], seed: int = 0) -> tuple[list[MarkerFrame], list[IntArray]]:
    """The points of each frame in random order and without ids, and for each of them its row before."""
    random = np.random.default_rng(seed)
    orders = [random.permutation(len(frame.ids)) for frame in frames]
    bare = [
        replace(
            frame,
            points_m=frame.points_m[order],
            ids=np.full(len(order), NO_ID, dtype=np.int64),
            residuals_m=frame.residuals_m[order],
        )
        for frame, order in zip(frames, orders, strict=True)
    ]
    return bare, orders


def figures(
    path: Path,
    recording: Recording,
    profiles: Profile | Sequence[Profile],
    solved: Sequence[TrackedFrame],
    columns: Sequence[IntArray],
    labels_given: bool,
    holes: Holes | None = None,
) -> TrackFigures:
    """What became of a recording. columns: as `frames_and_columns` gave them. holes: as a take says; None: by its
    times."""
    cast = cast_of(profiles)
    if holes is None:
        holes = holes_of(recording.times_s, recording.rate_hz)
    expected = max(len(solved) + holes.missing, 1)
    each = {name: _hand_figures(key, recording, solved, expected) for key, name in hand_names(cast).items()}
    hands = {name: hand for name, hand in each.items() if hand is not None}
    tracked = [frame for frame in solved if any(hand.state is HandState.TRACKED for hand in frame.hands)]
    right, points = _labels(recording, cast, solved, columns)
    return TrackFigures(
        path,
        len(solved),
        recording.duration_s + holes.seconds,
        len(tracked) / expected,
        _rms(solved, hands_of(cast)),
        hands,
        right / points if points else float("nan"),
        points,
        labels_given,
        holes=holes,
        warnings=recording.warnings,
        gaps=recording.gap_figures,
    )


def _hand_figures(
    key: HandKey, recording: Recording, solved: Sequence[TrackedFrame], expected: int
) -> HandFigures | None:
    tracked = observed = markers = 0
    first = float("nan")
    for time_s, frame in zip(recording.times_s, solved, strict=True):
        for hand in frame.hands:
            if hand.key == key and hand.state is HandState.TRACKED:
                first = float(time_s - recording.times_s[0]) if not tracked else first
                tracked += 1
                observed += int(hand.observed.sum())
                markers += len(hand.point)
    if not tracked:
        return None
    return HandFigures(tracked / expected, first, _rms(solved, (key,)), 1.0 - observed / max(markers, 1))


def _rms(solved: Sequence[TrackedFrame], hands: Sequence[HandKey]) -> float:
    """Over every observed marker of every tracked frame [m]."""
    total, count = 0.0, 0
    for frame in solved:
        for hand in frame.hands:
            if hand.key in hands and hand.state is HandState.TRACKED and np.isfinite(hand.rms_m):
                n = int(hand.observed.sum())
                total += n * hand.rms_m**2
                count += n
    return float(np.sqrt(total / count)) if count else float("nan")


def _labels(
    recording: Recording, cast: Cast, solved: Sequence[TrackedFrame], columns: Sequence[IntArray]
) -> tuple[int, int]:
    """Points of hand markers that carry their true label, and points of hand markers."""
    truth = [_truth(label, cast) for label in recording.labels]
    if not any(truth):
        return 0, 0
    right = points = 0
    for frame, origins in zip(solved, columns, strict=True):
        given = {
            int(point): (hand.key, marker)
            for hand in frame.hands
            if hand.state is HandState.TRACKED
            for marker, point in enumerate(hand.point)
            if point != NO_POINT
        }
        for point, column in enumerate(origins):
            true = truth[column]
            if true is None:
                continue
            points += 1
            performer, side, marker = true
            key, named = given.get(point, (None, -1))
            right += key is not None and named == marker and key.performer == performer and side in (None, key.side)
    return right, points


def _truth(label: str, cast: Cast) -> tuple[int, Side | None, int] | None:
    """Performer, side if the label says it, and index of the marker that a label names; None if none."""
    performer, rest = owned(label, cast)
    marker = None if performer is None else marker_of(rest, cast[performer].layout)
    return None if performer is None or marker is None else (performer, *marker)
