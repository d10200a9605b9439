"""What is under the pointer, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from app.hand_words import side_title
from app.label_trust import percent
from app.pose_words import plus_minus_mm
from app.viewport.marker_states import Layouts, MarkerState, MarkerView, layout_of
from core.frames import FloatArray, TrackedFrame

REACH_PX = 9.0

LEGEND = (
    "Labelled: seen, and known which marker of the hand it is.\n"
    "Predicted: hidden; the ring is as wide as the error to expect.\n"
    "Guessed joints: drawn as pale blue glass, for too few markers say how they are bent.\n"
    "Unlabelled: seen, and part of no hand or prop; another object, perhaps.\n"
    "Ghost: within 4 cm of a tracked hand, but none of its markers; a reflection, perhaps.\n"
    "On props: markers of props, those that are seen of all.\n"
    "D colours hands by digit or by state, N writes the names of markers."
)


def marker_under(screen: FloatArray, x: float, y: float) -> int | None:
    """The nearest marker within reach. screen: (n, 3), x and y [pixels] and depth [m], as OrbitCamera.project gives."""
    if not len(screen):
        return None
    distances_px = np.hypot(screen[:, 0] - x, screen[:, 1] - y)
    distances_px[screen[:, 2] <= 0.0] = np.inf
    nearest = int(distances_px.argmin())
    return nearest if distances_px[nearest] <= REACH_PX else None


def marker_words(
    view: MarkerView, i: int, tracked: TrackedFrame | None, layouts: Layouts, performers: Sequence[str] = ()
) -> str:
    """One marker: whose it is, whether it is seen, the error to expect of its place, and how sure its name is.

    performers: their names where there are several.
    """
    state = MarkerState(view.states[i])
    if state is MarkerState.UNLABELLED:
        return "Unlabelled: part of no hand"
    if state is MarkerState.GHOST:
        return "Ghost: beside a hand, but none of its markers"
    assert tracked is not None
    words = "seen" if state is MarkerState.LABELLED else "hidden, predicted"
    if view.props[i] >= 0:
        return f"{tracked.props[view.props[i]].name}, marker {view.markers[i] + 1}: {words}"
    hand = tracked.hands[view.hands[i]]
    layout = layout_of(layouts, hand.performer)
    name = layout.marker_names[view.markers[i]] if layout is not None else f"marker {view.markers[i] + 1}"
    said = f"{side_title(performers, hand.key)} {name}: {words}{plus_minus_mm(view.std_m[i])}"
    if np.isnan(view.label_confidence[i]):
        return said
    what = "its label is right" if state is MarkerState.LABELLED else "it is really hidden"
    return f"{said}\n{percent(view.label_confidence[i])} sure that {what}"
