"""How well a recording was tracked: share of frames, residuals, and labels against those the file gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from app.hand_tally import HandFigures, HandTally
from app.labels import marker_of_cast
from app.left_out import LeftOutTally
from app.tracking_doubts import Doubt
from core.cast import Cast, cast_of
from core.frames import NO_ID, NO_POINT, HandState, IntArray, MarkerFrame, TrackedFrame
from core.labelling.given import Names
from core.profile import Profile
from core.recording import Recording
from core.takes.holes import NO_HOLES, Holes, holes_of


@dataclass(frozen=True)
class TrackFigures:
    """One recording. hands: only those found at all, as "right", of several performers as "Anna right".

    labels_right: share of the points of hand markers that carry their true label, 0..1; a point without a label counts
    as wrong. NaN if the file names none, and where labels_given: the engine was told them, and cannot but agree.
    labelled_points: how many such points there are. labels_left_out: given labels whose
    points could not be their markers, and how many points, in frames in which their hand was tracked. filled: share of
    the frames in which a gap was filled, 0..1. holes: where it has no frames; what is missing counts as not tracked.
    warnings: those of the file's reader. gaps: points that it does not have (core.gaps.Gaps.figures). speed: seconds of
    the recording solved per second, NaN if not measured. files: what was written; notes: what there is to say of them;
    failed: why a format could not be written. neutral: the neutral trials that angles.csv counts from. rate_hz: of the
    recording, NaN if unknown. losses: why the command ends with status 3.

    sources: share of the 26 numbers of tracked hands that are measured, prior, filled or at a limit
    (core.sources.SOURCES), 0..1, {} where no hand was found; sources_by_angle: the same of each. not_told: what the
    layouts cannot tell apart, in words.
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
    labels_left_out: dict[str, int] = field(default_factory=dict)
    filled: float = 0.0
    sources: Mapping[str, float] = field(default_factory=dict)
    sources_by_angle: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    not_told: tuple[str, ...] = ()
    holes: Holes = NO_HOLES
    warnings: tuple[str, ...] = ()
    gaps: Mapping[str, float] = field(default_factory=dict)
    speed: float = float("nan")
    files: tuple[Path, ...] = ()
    notes: tuple[str, ...] = ()
    failed: dict[str, str] = field(default_factory=dict)
    neutral: tuple[str, ...] = ()
    rate_hz: float = float("nan")
    losses: tuple[Doubt, ...] = ()


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
    given: Names | None = None,
    holes: Holes | None = None,
) -> TrackFigures:
    """What became of a recording. columns: as `frames_and_columns` gave them. given: the labels that the engine was
    told, None for none. holes: as a take says; None: by its times."""
    cast = cast_of(profiles)
    if holes is None:
        holes = holes_of(recording.times_s, recording.rate_hz)
    expected = max(len(solved) + holes.missing, 1)
    tally = HandTally(cast)
    for frame in solved:
        tally.add(frame)
    right, points = _labels(recording, cast, solved, columns)
    return TrackFigures(
        path,
        len(solved),
        recording.duration_s + holes.seconds,
        tally.tracked / expected,
        tally.rms_m,
        tally.hands(recording.times_s, expected),
        right / points if points and given is None else float("nan"),
        points,
        given is not None,
        {} if given is None else _left_out(recording, given, solved, columns),
        holes=holes,
        warnings=recording.warnings,
        gaps=recording.gap_figures,
    )


def _labels(
    recording: Recording, cast: Cast, solved: Sequence[TrackedFrame], columns: Sequence[IntArray]
) -> tuple[int, int]:
    """Points of hand markers that carry their true label, and points of hand markers."""
    truth = [marker_of_cast(label, cast) for label in recording.labels]
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


def _left_out(
    recording: Recording, given: Names, solved: Sequence[TrackedFrame], columns: Sequence[IntArray]
) -> dict[str, int]:
    """Points whose given label is not borne out, by label, in the order of the file."""
    tally = LeftOutTally(recording, given)
    for frame, origins in zip(solved, columns, strict=True):
        tally.add(recording.ids[origins], frame)
    return tally.counts
