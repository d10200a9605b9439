"""How a hand is doing, and why it is lost, in words that say what to do. Knows no window."""

from __future__ import annotations

import math

import numpy as np

from core.frames import FloatArray, HandFrame, HandKey, HandState, IntArray, MarkerFrame, TrackedFrame
from core.labelling.finder import LEAST_SHARE, NEAR_M
from core.takes.disk import duration_text
from devices.device import Level

GOOD_RMS_M = 0.004
"""A hand that fits worse is tracked, but not as it should be."""

TOLD_FROM_S = 1.0
"""A hand that is missed for less is missed only now."""

LONG_S = 3.0
"""A search that takes so long does not end by waiting."""


SHORT_WORDS = {
    "no points": "none of its markers seen",
    "too few markers": "too few of its markers seen",
    "out of shape": "no such hand fits its points",
    "two hands alike": "left or right not yet told",
    "searching": "looked for",
    "left the volume": "it left the volume",
}
"""Why a hand is not tracked, of a take: there is nothing to be done about it any more."""


class Missing:
    """Since when each hand is not tracked."""

    def __init__(self) -> None:
        self._since_s: dict[HandKey, float] = {}

    def take(self, frame: TrackedFrame) -> None:
        """The next frame."""
        for hand in frame.hands:
            if hand.state is HandState.TRACKED:
                self._since_s.pop(hand.key, None)
            elif math.isfinite(frame.times.host_s):
                self._since_s.setdefault(hand.key, frame.times.host_s)

    def seconds(self, hand: HandKey, frame: TrackedFrame) -> float:
        """How long it is missed [s], 0 if it is tracked."""
        missed_s = frame.times.host_s - self._since_s.get(hand, frame.times.host_s)
        return missed_s if missed_s > 0.0 else 0.0  # the time of a frame may be unknown

    def forget(self) -> None:
        """Frames of something else follow."""
        self._since_s.clear()


def unnamed_points(frame: MarkerFrame, solved: TrackedFrame) -> IntArray:
    """(k,) int64, the points of `frame` that no tracked hand or prop of `solved` explains."""
    free = np.isfinite(frame.points_m).all(axis=1)
    for thing in (*solved.hands, *solved.props):
        tracked = thing.state is HandState.TRACKED if isinstance(thing, HandFrame) else thing.tracked
        if tracked:
            free[thing.point[(thing.point >= 0) & (thing.point < len(free))]] = False
    return np.flatnonzero(free)


def points_seen(hand: HandFrame, frame: MarkerFrame, solved: TrackedFrame) -> int:
    """How many points could be markers of a hand that is not tracked: near where it was lost, else anywhere."""
    free_m: FloatArray = frame.points_m[unnamed_points(frame, solved)]
    last_m = hand.markers_world_m[np.isfinite(hand.markers_world_m).all(axis=1)]
    if hand.state is HandState.LOST and len(last_m):
        near = np.linalg.norm(free_m - last_m.mean(axis=0), axis=1) < NEAR_M
        if near.any():
            return int(near.sum())
    return len(free_m)


def needed_markers(n_markers: int) -> int:
    """How many markers of a layout must be seen for its hand to be found."""
    return math.ceil(LEAST_SHARE * n_markers)


def why_words(hand: HandFrame, seen: int, missed_s: float = 0.0) -> str:
    """'Lost for 3 s: 6 of 19 markers seen, needs 12. Is the hand in view?' of a hand that is not tracked.

    seen: as `points_seen` counts them. missed_s: how long it is missed already [s].
    """
    title = "Lost" if hand.state is HandState.LOST else "Searching"
    since = f" for {duration_text(missed_s)}" if missed_s >= TOLD_FROM_S else ""
    return f"{title}{since}: {_reason(hand, seen, missed_s)}"


def _reason(hand: HandFrame, seen: int, missed_s: float) -> str:
    n, needed = len(hand.point), needed_markers(len(hand.point))
    if hand.why == "no points":
        return "none of its markers is seen. Is the hand in view?"
    if hand.why == "too few markers":
        if seen < needed:
            return f"{seen} of {n} markers seen, needs {needed}. Is the hand in view?"
        return f"{seen} points seen, but not {needed} of one hand together. Is the whole hand in view?"
    if hand.why == "out of shape":
        return f"{seen} points seen, but no such hand fits them. Check hand size and marker layout."
    if hand.why == "two hands alike":
        return "left or right cannot be told yet. Open the hand and turn it a little."
    if hand.why == "left the volume":
        return "it left the volume. Bring it back into view."
    if hand.why == "searching":
        if missed_s >= LONG_S:
            return f"{seen} points are tried, nothing fits yet. Open the hand; check hand size and layout."
        return f"{seen} points are tried. Hold the hand open and relaxed."
    if hand.state is HandState.LOST:
        return "show the hand open, it is found again by itself."
    return "hold the hand open and relaxed in view."


def hand_state(hand: HandFrame, seen: int = 0, missed_s: float = 0.0) -> tuple[Level, str]:
    """The light of a hand and its reason in words. seen, missed_s: as for `why_words`."""
    if hand.state is not HandState.TRACKED:
        return Level.PROBLEM if hand.state is HandState.LOST else Level.WARNING, why_words(hand, seen, missed_s)
    n_seen, all_of_them = int(hand.observed.sum()), len(hand.point)
    if hand.rms_m > GOOD_RMS_M:
        return Level.WARNING, "Tracked, but the fit is loose: check hand size and marker layout."
    if hand.why:
        return Level.WARNING, "Tracked, but it fits worse than it did: its labels are looked over."
    if n_seen < all_of_them / 2:
        return Level.WARNING, f"Tracked by {n_seen} of {all_of_them} markers: the others are hidden."
    return Level.GOOD, "Tracked"


def state_in(hand: HandFrame, frame: MarkerFrame, solved: TrackedFrame, missed_s: float = 0.0) -> tuple[Level, str]:
    """The same of a hand of `solved`, with its points counted in `frame`."""
    return hand_state(hand, points_seen(hand, frame, solved), missed_s)
