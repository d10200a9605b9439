"""Which names stand in the 3D view, in which words and colours."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass

import numpy as np

from app import theme
from app.hand_words import shortened, side_title
from app.label_trust import DOUBTED, WRONG
from app.viewport import colours
from app.viewport.marker_states import Layouts, MarkerState, MarkerView, layout_of, tracked_hands
from core.frames import FloatArray, TrackedFrame

NEAR_PX = 60.0
"""A hand whose markers are spread less wide on the screen is too far for the names of each."""

LONGEST_NAME = 24
"""Characters of a performer's name, or a prop's, beside the hand."""

TOO_FAR = "zoom in for names"
_CODES = [colours.STATE_CODES[state] for state in MarkerState]
_INK = [_CODES[state] if state is MarkerState.PREDICTED else theme.TEXT for state in MarkerState]


@dataclass(frozen=True)
class Tag:
    """A name. key: whose, the same from frame to frame. bar: colour of what it names; ink: of the words.

    anchor_px: (x, y) of what it names; centre_px: the middle of what that is part of: names go away from there.
    """

    key: Hashable
    text: str
    bar: str
    anchor_px: tuple[float, float]
    centre_px: tuple[float, float]
    ink: str = theme.TEXT


def tags_of_markers(
    view: MarkerView,
    screen: FloatArray,
    tracked: TrackedFrame | None,
    layouts: Layouts,
    by_digit: bool,
    performers: Sequence[str] = (),
) -> list[Tag]:
    """A tag per marker of each hand that is near enough, else one for the hand. Doubted names have a question mark.

    screen: (n, 3), where the markers of `view` are, as OrbitCamera.project gives it. performers: their names where
    there are several.
    """
    tags: list[Tag] = []
    for h, hand in enumerate(tracked.hands if tracked is not None else ()):
        rows = np.flatnonzero((view.hands == h) & (screen[:, 2] > 0.0))
        layout = layout_of(layouts, hand.performer)
        if not len(rows) or layout is None:
            continue
        places = screen[rows, :2]
        low, high = places.min(axis=0), places.max(axis=0)
        middle = tuple(((low + high) / 2).tolist())
        if np.hypot(*(high - low)) < NEAR_PX:
            top = (middle[0], float(low[1]))
            words = f"{side_title(performers, hand.key)}: {TOO_FAR}"
            tags.append(Tag(hand.key, words, theme.hand_colour(hand.key), top, middle))
            continue
        each = (view.states, view.digits, view.markers, view.label_confidence)
        key = hand.key
        for state, digit, marker, sure, (x, y) in zip(
            *(values[rows].tolist() for values in each), places.tolist(), strict=True
        ):
            text, ink = layout.marker_names[marker], _INK[state]
            if sure < DOUBTED:  # not of NaN
                text, ink = f"{text} ?", theme.PROBLEM if sure < WRONG else theme.WARNING
            code = colours.DIGIT_CODES[digit] if by_digit else _CODES[state]
            tags.append(Tag((key, marker), text, code, (x, y), middle, ink))
    return tags


def tags_of_hands(
    tracked: TrackedFrame | None, performers: Sequence[str], on_screen: Callable[[FloatArray], FloatArray]
) -> list[Tag]:
    """Whose each hand is, at its wrist; none where there is one performer."""
    hands = tracked_hands(tracked) if performers else []
    performers = [shortened(name, LONGEST_NAME) for name in performers]
    screen = on_screen(np.array([hand.joints_world[0, :3, 3] for hand in hands]).reshape(-1, 3))
    return [
        Tag(("whose", hand.key), side_title(performers, hand.key), theme.hand_colour(hand.key), (x, y), (x, y - 1.0))
        for hand, (x, y, depth_m) in zip(hands, screen.tolist(), strict=True)
        if depth_m > 0.0
    ]


def tags_of_props(
    poses: Sequence[tuple[str, FloatArray, bool]], on_screen: Callable[[FloatArray], FloatArray]
) -> list[Tag]:
    """A tag per prop and rigid body that is in front of the camera. poses: as `scene.prop_poses` gives them."""
    screen = on_screen(np.array([pose[:3, 3] for _, pose, _ in poses]).reshape(-1, 3))
    return [
        Tag(
            ("prop", name),
            shortened(name, LONGEST_NAME) + ("" if seen else " (not seen)"),
            colours.PROP_CODE,
            (x, y),
            (x - 1.0, y),
        )
        for (name, _, seen), (x, y, depth_m) in zip(poses, screen.tolist(), strict=True)
        if depth_m > 0.0
    ]
