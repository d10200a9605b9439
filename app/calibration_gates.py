"""What keeps a recording from being calibrated from: the doubts that `phalanx track` ends with status 3 on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from core.errors import FormatError

if TYPE_CHECKING:
    from core.frames import IntArray, MarkerFrame, Side, TrackedFrame
    from core.labelling.given import Names
    from core.labelling.name_check import NameFault
    from core.profile import Profile
    from core.recording import Recording

_REMEDIES = {
    "unit": "Export the recording in another unit.",
    "side": "Give the profile of the hand that was held, or mend the names in the file.",
    "names": "Mend the names in the file, or leave them out with --unlabelled.",
    "layout": "Give the profile of the layout that was worn, or leave the names of the file out with --unlabelled.",
    "markers": "Give the profile of the layout that was worn, or choose the other hand alone with --side.",
}
"""By kind of doubt. The others, a hand that is not tracked, are told of the held stretch by itself."""


def refuse_doubtful(
    path: Path,
    recording: Recording,
    rows: IntArray,
    solved: Sequence[TrackedFrame],
    profile: Profile,
    sides: Sequence[Side],
    labels: Names | None,
    faults: Sequence[NameFault],
    unlabelled: bool,
) -> None:
    """Raises FormatError where `phalanx track` would say of a stretch that what is tracked in it is another hand,
    another layout, in another unit, or by wrong names.

    rows: the frames of the stretch. solved: all frames. sides: the hands that are wanted; what is wrong with the other
    one is nothing here, as is what is wrong outside of the stretch. labels: as the file gives them, None for none.
    faults: of these, or of the names found here. unlabelled: labels were not used.
    """
    from app.name_words import fault_words
    from app.tracking_doubts import Doubt, doubts
    from app.tracking_figures import figures, frames_and_columns
    from core.labelling.given import key_of

    stretch = recording.at(rows)
    _, columns = frames_and_columns(stretch)
    ours = None if labels is None else {i: name for i, name in labels.items() if key_of(name[0]).side in sides}
    told = figures(path, stretch, profile, [solved[row] for row in rows], columns, ours)
    hands = {name: hand for name, hand in told.hands.items() if name in sides}
    wrong = [fault for fault in faults if fault.hand.side in sides and _touches(fault, rows)]
    whole = [fault for fault in wrong if fault.rows is None]
    # Parts are told in the frames and seconds of the recording; that their names are left out, too, says no more.
    found = [Doubt(fault.kind, fault_words(fault, recording, (profile,))) for fault in wrong if fault.rows is not None]
    left_out = {} if found else told.labels_left_out
    found += doubts(stretch, (profile,), ours or labels, unlabelled, hands, whole, left_out)
    said = [doubt for doubt in found if doubt.lost and doubt.kind in _REMEDIES]
    if said:
        remedies = dict.fromkeys(_REMEDIES[doubt.kind] for doubt in said)
        words = " ".join(dict.fromkeys(doubt.text for doubt in said))
        raise FormatError(f"{path.name}: {words}", f"No zero was set. {' '.join(remedies)}")


def named_wrongly(
    frames: Sequence[MarkerFrame], recording: Recording, profile: Profile, labels: Names | None
) -> list[str]:
    """What cannot be right about given names that are used all the same, in sentences. recording: these frames."""
    from app.name_words import fault_words
    from core.labelling.name_check import check_names

    if labels is None:
        return []
    faults = check_names(frames, recording.rate_hz, profile, labels)
    return [fault_words(fault, recording, (profile,), done=_USED) for fault in faults]


_USED = "The names were used as they are: mend them and calibrate again, or leave them out with --unlabelled."


def _touches(fault: NameFault, rows: IntArray) -> bool:
    return fault.rows is None or (fault.rows[0] <= rows[-1] and rows[0] <= fault.rows[1])
