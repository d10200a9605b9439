"""What the labels of a file say: which marker of a layout, on which hand, of whom."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from core.cast import Cast, cast_of, performer_names
from core.frames import HandKey, HandState, Side
from core.labelling.given import Names
from core.markers.layout import MarkerLayout
from core.profile import Profile
from core.recording import Recording
from core.takes.export.naming import subject_names
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


def cast_labels(recording: Recording, profiles: Profile | Sequence[Profile]) -> Names | None:
    """Device id to hand and marker, for one performer or several; None if no label names a marker of theirs.

    Of several performers a label begins with whose marker it is: the name in the profile or the performer's number,
    as exports write it (`Anna:R_ThumbTip`, `2:R_ThumbTip`). Labels that do not say are nobody's.
    """
    cast = cast_of(profiles)
    if len(cast) == 1:
        return label_map(recording, cast[0])
    owners = [owned(label, cast) for label in recording.labels]
    found: dict[int, tuple[Side | HandKey, int]] = {}
    for performer, profile in enumerate(cast):
        own = [column for column, (who, _) in enumerate(owners) if who == performer]
        part = replace(
            recording,
            points_m=recording.points_m[:, own],
            labels=tuple(owners[column][1] for column in own),
            ids=recording.ids[own],
        )
        for identity, (side, marker) in (label_map(part, profile) or {}).items():
            found[identity] = HandKey(performer, side), marker
    return found or None


def owned(label: str, cast: Cast) -> tuple[int | None, str]:
    """Whose marker a label names, None if it does not say, and the label without it."""
    if len(cast) == 1:
        return 0, label
    names = performer_names(cast)
    starts = [
        (start, performer)
        for performer, both in enumerate(zip(names, subject_names(names), strict=True))
        for start in (*both, str(performer + 1))
    ]
    for start, performer in sorted(starts, key=lambda each: -len(each[0])):  # "Anna 2" before "Anna"
        rest = label[len(start) :]
        if rest[:1] in tuple(":_-. ") and label[: len(start)].casefold() == start.casefold():
            return performer, rest[1:]
    return None, label


def marker_of_cast(label: str, cast: Cast) -> tuple[int, Side | None, int] | None:
    """Performer, hand if the label says it, and index of the marker in the layout that a label names; None if none."""
    performer, rest = owned(label, cast)
    marker = None if performer is None else marker_of(rest, cast[performer].layout)
    return None if performer is None or marker is None else (performer, *marker)


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
    """Median RMS over frames spread over the recording [m], infinite where points are no hand, or if none is found."""
    if len(profile.sides) == 1:
        return 0.0
    rows = np.unique(np.linspace(0, recording.n_frames - 1, _TRIAL_FRAMES).astype(int))
    spread = recording.at(rows)
    rms = [
        hand.rms_m if hand.state is HandState.TRACKED else float("inf")
        for frame in solve(spread.frames(), profile, labels=labels)
        for hand in frame.hands
        if hand.state is HandState.TRACKED or hand.why == "out of shape"
    ]
    return float(np.median(rms)) if rms else float("inf")
