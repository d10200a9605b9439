"""Labelled markers on an even grid of frames, as C3D and TRC hold them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.frames import NO_POINT, BoolArray, FloatArray
from core.hand.skeleton import JOINT_NAMES, N_JOINTS
from core.takes.export.content import PREFIX, Content, hand_of
from core.takes.export.progress import Progress
from core.takes.formats.assemble import unique_labels


@dataclass(frozen=True)
class MarkerTable:
    """Points over an even grid of time, one column per marker.

    labels: (m,) with the side before each name. points_m: (t, m, 3) float64 [m], NaN where the hand is not tracked
    or the frame was lost. measured: (t, m) bool, seen by the device; else the model's prediction.
    """

    labels: tuple[str, ...]
    points_m: FloatArray
    measured: BoolArray


def marker_labels(content: Content) -> tuple[str, ...]:
    """The markers of every hand and prop of the profile, then the joint centres if they are asked for."""
    sides = content.solution.profile.sides
    labels = [PREFIX[side] + name for side in sides for name in content.solution.profile.layout.marker_names]
    labels += [name for prop in content.solution.profile.props for name in prop.marker_names]
    if content.with_joints:
        labels += [f"{PREFIX[side]}{name}_joint" for side in sides for name in JOINT_NAMES]
    return unique_labels([" ".join(label.split()) for label in labels])  # no tabs or line breaks in a name


def n_marker_columns(content: Content) -> int:
    """Columns of markers, which come before those of joint centres."""
    profile = content.solution.profile
    on_hands = len(profile.sides) * len(profile.layout.marker_names)
    return on_hands + sum(len(prop.markers_m) for prop in profile.props)


def marker_table(content: Content, progress: Progress) -> MarkerTable:
    """The whole recording in memory."""
    sides = content.solution.profile.sides
    labels = marker_labels(content)
    n_markers = len(content.solution.profile.layout.marker_names)
    timeline = content.timeline
    first_of, column = {}, len(sides) * n_markers
    for prop in content.solution.profile.props:
        first_of[prop.name] = column
        column += len(prop.markers_m)
    points = np.full((timeline.n_slots, len(labels), 3), np.nan)
    measured = np.zeros((timeline.n_slots, len(labels)), dtype=np.bool_)
    frames = progress.over(content.solved, "Collecting markers", timeline.n_frames)
    for slot, frame in zip(timeline.slots, frames, strict=False):
        for i, side in enumerate(sides):
            hand = hand_of(frame, side)
            if hand is None:
                continue
            columns = slice(i * n_markers, (i + 1) * n_markers)
            points[slot, columns] = hand.markers_world_m
            measured[slot, columns] = hand.observed
            if content.with_joints:
                first = n_marker_columns(content) + i * N_JOINTS
                points[slot, first : first + N_JOINTS] = hand.joints_world[:, :3, 3]
        for seen in frame.props:
            if seen.tracked and seen.name in first_of:
                columns = slice(first_of[seen.name], first_of[seen.name] + len(seen.point))
                points[slot, columns] = seen.markers_world_m
                measured[slot, columns] = seen.point != NO_POINT
    return MarkerTable(labels, points, measured)
