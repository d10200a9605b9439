"""Labelled markers on an even grid of frames, as C3D and TRC hold them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from core.cast import props_of
from core.frames import NO_POINT, BoolArray, FloatArray
from core.hand.skeleton import N_JOINTS, TIP_NAMES
from core.hand.tips import tips_world
from core.takes.export.content import Content, hand_of
from core.takes.export.progress import Progress
from core.takes.formats.assemble import unique_labels
from core.takes.formats.computed import joint_labels

_AT_ONCE = 4096


@dataclass(frozen=True)
class MarkerTable:
    """Points over an even grid of time, one column per marker.

    labels: (m,) with side, and where there are several the performer, before each name. points_m: (t, m, 3) float64
    [m], NaN where the hand is not tracked or the frame was lost. measured: (t, m) bool, seen by the device; else the
    model's prediction, or between two frames of which one is. subjects: performers' names as labels begin with them,
    ("",) for a single one.
    """

    labels: tuple[str, ...]
    points_m: FloatArray
    measured: BoolArray
    subjects: tuple[str, ...] = ("",)

    def rows(self, frames: slice) -> MarkerTable:
        """Some of the frames."""
        return replace(self, points_m=self.points_m[frames], measured=self.measured[frames])

    def measured_only(self, n_markers: int) -> MarkerTable:
        """The same with gaps where one of the first `n_markers` was predicted; joints behind them stay."""
        points_m = self.points_m
        points_m[:, :n_markers][~self.measured[:, :n_markers]] = np.nan
        return replace(self, points_m=points_m)


def marker_labels(content: Content) -> tuple[str, ...]:
    """The markers of every hand and prop, then the joint centres and fingertips if they are asked for."""
    labels = [
        content.prefix(hand) + name
        for hand in content.hands
        for name in content.cast[hand.performer].layout.marker_names
    ]
    labels += [name for prop in props_of(content.cast) for name in prop.marker_names]
    if content.options.joints:
        for hand in content.hands:
            labels += joint_labels(content.prefix(hand))
    return unique_labels([" ".join(label.split()) for label in labels])  # no tabs or line breaks in a name


def n_marker_columns(content: Content) -> int:
    """Columns of markers, which come before those of joint centres."""
    on_hands = sum(len(content.cast[hand.performer].layout.marker_names) for hand in content.hands)
    return on_hands + sum(len(prop.markers_m) for prop in props_of(content.cast))


def marker_table(content: Content, progress: Progress) -> MarkerTable:
    """The whole recording in memory, as the options ask for it."""
    columns, timeline, resampled = _columns(content), content.timeline, content.options.rate_hz is not None
    labels = marker_labels(content)
    n_rows = timeline.n_frames if resampled else timeline.n_slots
    points = np.full((n_rows, len(labels), 3), np.nan)
    measured = np.zeros((n_rows, len(labels)), dtype=np.bool_)
    rows = np.arange(timeline.n_frames) if resampled else timeline.slots
    frames = progress.over(content.solved, "Collecting markers", timeline.n_frames)
    for row, frame in zip(rows, frames, strict=False):
        for key in content.hands:
            hand = hand_of(frame, key)
            if hand is None:
                continue
            points[row, columns[key]] = hand.markers_world_m
            measured[row, columns[key]] = hand.observed
            if content.options.joints:
                skeleton = content.cast[key.performer].hand.skeleton
                tips_m = tips_world(skeleton, key.side, hand.joints_world, hand.scale)
                points[row, columns[key, "joints"]] = np.concatenate([hand.joints_world[:, :3, 3], tips_m])
        for seen in frame.props:
            if seen.tracked and seen.name in columns:
                points[row, columns[seen.name]] = seen.markers_world_m
                measured[row, columns[seen.name]] = seen.point != NO_POINT
    if content.options.measured:
        n_markers = n_marker_columns(content)
        points[:, :n_markers][~measured[:, :n_markers]] = np.nan  # before blending: no prediction may go into a point
    if resampled:
        points, measured = _blended(points, measured, content)
    return MarkerTable(labels, points, measured, content.subjects)


def _columns(content: Content) -> dict[object, slice]:
    """Where the markers of each hand, by key, and of each prop, by name, stand; joints by (key, "joints")."""
    columns: dict[object, slice] = {}
    end = 0

    def add(name: object, n: int) -> None:
        nonlocal end
        columns[name] = slice(end, end + n)
        end += n

    for key in content.hands:
        add(key, len(content.cast[key.performer].layout.marker_names))
    for prop in props_of(content.cast):
        add(prop.name, len(prop.markers_m))
    if content.options.joints:
        for key in content.hands:
            add((key, "joints"), N_JOINTS + len(TIP_NAMES))
    return columns


def _blended(points_m: FloatArray, measured: BoolArray, content: Content) -> tuple[FloatArray, BoolArray]:
    """The places of the grid, from (n, m, 3) and (n, m) of the frames: in a straight line between two frames in which
    the point is there, and a gap where it is missing in either."""
    grid = content.grid
    placed = np.full((len(grid), *points_m.shape[1:]), np.nan)
    for start in range(0, len(grid), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        before, after, share = grid.before[part], grid.after[part], grid.share[part, None, None]
        between = (1.0 - share) * points_m[before] + share * points_m[after]
        placed[part] = np.where(share > 0.0, between, points_m[before])
    placed[~grid.present] = np.nan
    seen = measured[grid.before] & measured[grid.after] & grid.present[:, None]
    return placed, seen
