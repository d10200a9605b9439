"""What the labels of a file say: which marker of a layout, on which hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from core.frames import HandState, Side
from core.markers.layout import MarkerLayout
from core.profile import Profile
from core.recording import Recording
from core.takes.reprocess import solve

SidedMarker = tuple[Side | None, int]
"""Hand, None where the label does not say, and index of the marker in the layout."""

_WORDS: dict[Side, tuple[str, ...]] = {"left": ("left", "l"), "right": ("right", "r")}
_TRIAL_FRAMES = 100


def marker_of(label: str, layout: MarkerLayout) -> SidedMarker | None:
    """The marker that a label names: `ThumbTip`, `glove:ThumbTip`, `left_ThumbTip`, `L:ThumbTip`; None if none."""
    names = {name.lower(): i for i, name in enumerate(layout.marker_names)}
    whole = label.lower()
    subject, _, rest = whole.rpartition(":")
    for text in (whole, rest):
        if text in names:
            return next((side for side, words in _WORDS.items() if subject in words), None), names[text]
        for side, words in _WORDS.items():
            for word in words:
                stem = text.removeprefix(word)
                if stem != text and stem[1:] in names and stem[0] in "_-. ":
                    return side, names[stem[1:]]
    return None


def label_map(recording: Recording, profile: Profile) -> dict[int, tuple[Side, int]] | None:
    """Device id to hand and marker, for the labels that name markers of the profile's layout; None if none does.

    Where labels do not say which hand, it is the profile's only one, or the one that fits the points better: a hand
    and its mirror image differ in shape.
    """
    if not recording.labels:
        return None
    found = {
        int(identity): marker
        for identity, label in zip(recording.ids, recording.labels, strict=True)
        if (marker := marker_of(label, profile.layout)) is not None
    }
    if not found:
        return None
    if all(side is not None for side, _ in found.values()):
        return _on(found, profile.sides[0])
    return min((_on(found, side) for side in profile.sides), key=lambda labels: _misfit(recording, profile, labels))


def _on(found: Mapping[int, SidedMarker], otherwise: Side) -> dict[int, tuple[Side, int]]:
    return {identity: (side or otherwise, marker) for identity, (side, marker) in found.items()}


def _misfit(recording: Recording, profile: Profile, labels: Mapping[int, tuple[Side, int]]) -> float:
    """Median RMS over frames spread over the recording [m]; infinite if no hand is found."""
    if len(profile.sides) == 1:
        return 0.0
    rows = np.unique(np.linspace(0, recording.n_frames - 1, _TRIAL_FRAMES).astype(int))
    spread = replace(
        recording,
        times_s=recording.times_s[rows],
        frame_numbers=recording.frame_numbers[rows],
        points_m=recording.points_m[rows],
    )
    rms = [
        hand.rms_m
        for frame in solve(spread.frames(), profile, labels=labels)
        for hand in frame.hands
        if hand.state is HandState.TRACKED
    ]
    return float(np.median(rms)) if rms else float("inf")
