"""What each marker on the screen is: seen and named, guessed, not named, or a likely ghost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from itertools import product

import numpy as np

from core.frames import FloatArray, HandFrame, HandState, IntArray, MarkerFrame, Side, TrackedFrame
from core.markers.layout import MarkerLayout
from core.props.mesh import prop_mesh
from core.props.prop import Prop

GHOST_RADIUS_M = 0.04
"""A point without a label this close to a tracked hand's marker is more likely a reflection than another object."""

NO_DIGIT = -1
"""Digit of a point on the back of the hand, or of one that no layout names."""


class MarkerState(IntEnum):
    """The states that the viewport tells apart by colour."""

    LABELLED = 0
    PREDICTED = 1
    UNLABELLED = 2
    GHOST = 3


@dataclass(frozen=True)
class MarkerView:
    """Every marker to draw.

    positions_m: (n, 3) float64 [m], world. states: (n,) int64 of MarkerState. digits: (n,) int64, 0 thumb to
    4 pinky, NO_DIGIT otherwise. hands: (n,) int64, index into the hands of the frame, -1 for none.
    props: (n,) int64, index into the props of the frame, -1 for none. markers: (n,) int64, index into the layout, or
    into the markers of the prop, -1 for none. std_m: (n,) float64 [m], expected error of the position of
    a hand's marker, label_confidence: (n,) float64 in 0..1, how sure its name is; both NaN where unknown and for every
    other point.
    """

    positions_m: FloatArray
    states: IntArray
    digits: IntArray
    hands: IntArray
    props: IntArray
    markers: IntArray
    std_m: FloatArray
    label_confidence: FloatArray

    def counts(self) -> IntArray:
        """(4,) int64, how many of each MarkerState."""
        return np.bincount(self.states, minlength=len(MarkerState)).astype(np.int64)


Layouts = MarkerLayout | Sequence[MarkerLayout] | None
"""What everybody wears, or each performer by number; None if it is not known."""


def layout_of(layouts: Layouts, performer: int) -> MarkerLayout | None:
    """What one performer wears, None if it is not known."""
    if layouts is None or isinstance(layouts, MarkerLayout):
        return layouts
    return layouts[performer] if performer < len(layouts) else None


def marker_view(frame: MarkerFrame | None, tracked: TrackedFrame | None, layouts: Layouts) -> MarkerView:
    """Classify the points of `frame` and the markers of the tracked hands and props in `tracked`.

    The two belong to one sample. Hands and props that are not tracked hold old poses: their markers are left out,
    and their points count as unlabelled.
    """
    points_m = np.empty((0, 3)) if frame is None else frame.points_m
    explained = np.zeros(len(points_m), dtype=bool)
    positions, states, digits, owners, markers, std_m, sure = [], [], [], [], [], [], []
    for i, hand in enumerate(tracked.hands if tracked is not None else ()):
        if hand.state is not HandState.TRACKED:
            continue
        sources = hand.point[(hand.point >= 0) & (hand.point < len(points_m))]
        explained[sources] = True
        n = len(hand.markers_world_m)
        drawable = np.isfinite(hand.markers_world_m).all(axis=1)
        index = np.flatnonzero(drawable)
        positions.append(hand.markers_world_m[drawable])
        states.append(np.where(hand.observed, MarkerState.LABELLED, MarkerState.PREDICTED)[drawable])
        layout = layout_of(layouts, hand.performer)
        joints = layout.joints if layout is not None and len(layout.joints) == n else np.zeros(n, dtype=np.int64)
        digits.append(((joints - 1) // 3)[drawable])
        owners.append(np.full(len(index), i))
        markers.append(index)
        std_m.append(hand.marker_std_m[drawable])
        sure.append(hand.label_confidence[drawable])

    on_hands_m = np.concatenate(positions) if positions else np.empty((0, 3))
    on_props_m, prop_states, prop_owners, prop_markers = [np.empty((0, 3))], [], [], []
    for i, prop in enumerate(tracked.props if tracked is not None else ()):
        if not prop.tracked:
            continue
        explained[prop.point[(prop.point >= 0) & (prop.point < len(points_m))]] = True
        on_props_m.append(prop.markers_world_m)
        prop_states.append(np.where(prop.point >= 0, MarkerState.LABELLED, MarkerState.PREDICTED))
        prop_owners.append(np.full(len(prop.point), i))
        prop_markers.append(np.arange(len(prop.point)))

    free_m = points_m[~explained]
    free_states = np.full(len(free_m), int(MarkerState.UNLABELLED))
    if len(free_m) and len(on_hands_m):
        squared = ((free_m[:, None, :] - on_hands_m[None, :, :]) ** 2).sum(axis=2).min(axis=1)
        free_states[squared < GHOST_RADIUS_M**2] = MarkerState.GHOST
    n_props = sum(map(len, prop_owners))
    no_hand, nothing = np.full(n_props + len(free_m), -1), np.full(len(free_m), -1)
    return MarkerView(
        np.concatenate([on_hands_m, *on_props_m, free_m]),
        np.concatenate([*states, *prop_states, free_states]).astype(np.int64),
        np.concatenate([*digits, np.full(len(no_hand), NO_DIGIT)]).astype(np.int64),
        np.concatenate([*owners, no_hand]).astype(np.int64),
        np.concatenate([np.full(len(on_hands_m), -1), *prop_owners, nothing]).astype(np.int64),
        np.concatenate([*markers, *prop_markers, nothing]).astype(np.int64),
        np.concatenate([*std_m, np.full(len(no_hand), np.nan)]),
        np.concatenate([*sure, np.full(len(no_hand), np.nan)]),
    )


def tracked_hands(tracked: TrackedFrame | None) -> list[HandFrame]:
    """The hands whose pose is that of this frame."""
    return [hand for hand in tracked.hands if hand.state is HandState.TRACKED] if tracked is not None else []


def hand_points_m(tracked: TrackedFrame | None, sides: tuple[Side, ...] = ("left", "right")) -> FloatArray:
    """(n, 3) float64 [m], joints and markers of the tracked hands; n is 0 if there are none."""
    parts = [
        part
        for hand in tracked_hands(tracked)
        if hand.side in sides
        for part in (hand.joints_world[:, :3, 3], hand.markers_world_m)
    ]
    points_m = np.concatenate(parts) if parts else np.empty((0, 3))
    return points_m[np.isfinite(points_m).all(axis=1)]


def prop_points_m(tracked: TrackedFrame | None, props: Sequence[Prop]) -> FloatArray:
    """(n, 3) float64 [m], markers and the corners about the models of the tracked props; n is 0 if there are none."""
    known = {prop.name: prop for prop in props}
    parts = [np.empty((0, 3))]
    for seen in tracked.props if tracked is not None else ():
        if seen.tracked and seen.name in known:
            vertices_m = prop_mesh(known[seen.name])[0]
            low, high = vertices_m.min(axis=0), vertices_m.max(axis=0)
            corners_m = np.array(list(product(*zip(low, high, strict=True))))
            parts += [corners_m @ seen.transform_world[:3, :3].T + seen.transform_world[:3, 3], seen.markers_world_m]
    points_m = np.concatenate(parts)
    return points_m[np.isfinite(points_m).all(axis=1)]
