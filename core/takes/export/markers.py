"""Labelled markers on an even grid of frames, as C3D and TRC hold them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.cast import props_of
from core.frames import NO_POINT, BoolArray, FloatArray, HandKey
from core.hand.skeleton import JOINT_NAMES, N_JOINTS
from core.takes.export.content import Content, hand_of
from core.takes.export.progress import Progress
from core.takes.formats.assemble import unique_labels


@dataclass(frozen=True)
class MarkerTable:
    """Points over an even grid of time, one column per marker.

    labels: (m,) with side, and where there are several the performer, before each name. points_m: (t, m, 3) float64
    [m], NaN where the hand is not tracked or the frame was lost. measured: (t, m) bool, seen by the device; else the
    model's prediction. subjects: performers' names as labels begin with them, ("",) for a single one.
    """

    labels: tuple[str, ...]
    points_m: FloatArray
    measured: BoolArray
    subjects: tuple[str, ...] = ("",)


def marker_labels(content: Content) -> tuple[str, ...]:
    """The markers of every hand and prop, then the joint centres if they are asked for."""
    labels = [
        content.prefix(hand) + name
        for hand in content.hands
        for name in content.cast[hand.performer].layout.marker_names
    ]
    labels += [name for prop in props_of(content.cast) for name in prop.marker_names]
    if content.options.joints:
        labels += [f"{content.prefix(hand)}{name}_joint" for hand in content.hands for name in JOINT_NAMES]
    return unique_labels([" ".join(label.split()) for label in labels])  # no tabs or line breaks in a name


def n_marker_columns(content: Content) -> int:
    """Columns of markers, which come before those of joint centres."""
    on_hands = sum(len(content.cast[hand.performer].layout.marker_names) for hand in content.hands)
    return on_hands + sum(len(prop.markers_m) for prop in props_of(content.cast))


def marker_table(content: Content, progress: Progress) -> MarkerTable:
    """The whole recording in memory."""
    labels, timeline = marker_labels(content), content.timeline
    first_of_hand: dict[HandKey, int] = {}
    first_of_prop: dict[str, int] = {}
    column = 0
    for key in content.hands:
        first_of_hand[key] = column
        column += len(content.cast[key.performer].layout.marker_names)
    for prop in props_of(content.cast):
        first_of_prop[prop.name] = column
        column += len(prop.markers_m)
    points = np.full((timeline.n_slots, len(labels), 3), np.nan)
    measured = np.zeros((timeline.n_slots, len(labels)), dtype=np.bool_)
    frames = progress.over(content.solved, "Collecting markers", timeline.n_frames)
    for slot, frame in zip(timeline.slots, frames, strict=False):
        for i, key in enumerate(content.hands):
            hand = hand_of(frame, key)
            if hand is None:
                continue
            columns = slice(first_of_hand[key], first_of_hand[key] + len(hand.point))
            points[slot, columns] = hand.markers_world_m
            measured[slot, columns] = hand.observed
            if content.options.joints:
                first = column + i * N_JOINTS
                points[slot, first : first + N_JOINTS] = hand.joints_world[:, :3, 3]
        for seen in frame.props:
            if seen.tracked and seen.name in first_of_prop:
                columns = slice(first_of_prop[seen.name], first_of_prop[seen.name] + len(seen.point))
                points[slot, columns] = seen.markers_world_m
                measured[slot, columns] = seen.point != NO_POINT
    return MarkerTable(labels, points, measured, content.subjects)
