"""What is wrong with the names of a recording, in sentences."""

from __future__ import annotations

from core.cast import Cast, hand_names
from core.frames import HandKey
from core.labelling.name_check import NameFault
from core.recording import Recording

_OTHER = {"left": "right", "right": "left"}
_NOT_SOLVED = "The hand was not solved."


def fault_words(fault: NameFault, recording: Recording, cast: Cast, done: str | None = None) -> str:
    """One fault, with what was done about it. done: a sentence on that; None: the names were not used."""
    hand = hand_names(cast)[fault.hand]
    if fault.kind == "unit":
        return (
            f"The points named as the {hand} hand's lie {_mm(fault.rms_m)} from one another, the markers of a hand "
            f"about {_mm(fault.better_m)} (medians): check the unit of the export. {done or _NOT_SOLVED}"
        )
    fit = f"RMS {_mm(fault.rms_m)} as named, {_mm(fault.better_m)} otherwise"
    if fault.kind == "side":
        side = _OTHER[fault.hand.side]
        moved = _moved(fault, cast)
        also = f" by other names ({', '.join(moved)})" if moved else ""
        said = f"What is named or taken as the {hand} hand is a {side} one{also}: {fit}."
        return f"{said} {done or _NOT_SOLVED} {_remedy(fault.hand, cast)}"
    moved = _moved(fault, cast)
    pairs = _pairs(fault, cast)
    look = f"{' and '.join(pairs)} look exchanged" if pairs else f"names look shifted or exchanged, {', '.join(moved)}"
    done = done or (_NOT_SOLVED if len(fault.markers) > len(moved) else "These names were not used.")
    return f"Of the {hand} hand {look}{_when(fault, recording)}: {fit}. {done}"


def _remedy(hand: HandKey, cast: Cast) -> str:
    if _OTHER[hand.side] in cast[hand.performer].sides:
        return "Mend the names in the file."
    return f"Choose a profile of a {_OTHER[hand.side]} hand."


def _moved(fault: NameFault, cast: Cast) -> list[str]:
    """'IndexTip is MiddleTip', for each."""
    names = cast[fault.hand.performer].layout.marker_names
    each = zip(fault.markers, fault.wanted, strict=True)
    return [f"{names[marker]} is {names[wanted]}" for marker, wanted in each if marker != wanted]


def _pairs(fault: NameFault, cast: Cast) -> list[str]:
    """'IndexTip and MiddleTip', for each; none where more than two have one another's names."""
    names, wanted = cast[fault.hand.performer].layout.marker_names, dict(zip(fault.markers, fault.wanted, strict=True))
    moved = {marker: other for marker, other in wanted.items() if marker != other}
    if any(moved.get(other) != marker for marker, other in moved.items()):
        return []
    return [f"{names[marker]} and {names[other]}" for marker, other in moved.items() if marker < other]


def _when(fault: NameFault, recording: Recording) -> str:
    if fault.rows is None:
        return ""
    first, last = fault.rows
    numbers, times_s = recording.frame_numbers, recording.times_s - recording.times_s[0]
    return f" in frames {numbers[first]} to {numbers[last]} ({times_s[first]:.2f} to {times_s[last]:.2f} s)"


def _mm(length_m: float) -> str:
    return f"{1000 * length_m:,.1f} mm" if length_m < 0.1 else f"{1000 * length_m:,.0f} mm"
