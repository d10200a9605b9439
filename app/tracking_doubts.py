"""What there is to doubt of a recording that was solved, in sentences: what a green figure does not say."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from app.hand_tally import HandFigures
from app.labels import marker_of, marker_of_cast
from app.least import LEAST_TRACKED
from app.name_words import fault_words
from app.size_words import size_words
from core.cast import Cast, hands_of, props_of
from core.errors import FormatError
from core.labelling.given import Names, key_of
from core.labelling.name_check import NameFault
from core.recording import Recording
from core.takes.overview import unit_warnings
from core.takes.wild import coded

FEW = 0.5
"""A hand of which fewer markers are seen than this share, on average, may be none."""

MOST_LEFT_OUT = 0.1
"""A name that is left out of more of its frames than this share is not that of its marker."""

FEW_NAMED = 0.5
"""A file that names fewer markers of a layout than this share is of another."""

_SHOWN = 5
_NO_NAME = re.compile(r"\W*(u|un\w*|m|marker|p|point|c|tr|traj\w*)?[\W_]*\d+\W*", re.IGNORECASE)
"""What programs call a trajectory that nobody has named: 'Unlabeled 17', '*12', 'marker 3', 'U4'."""


@dataclass(frozen=True)
class Doubt:
    """kind: "unit", "side", "names", "layout", "hand" (none was found), "tracked" (in few frames), "markers" (few seen,
    or names that are none), "size" (no hand is of that size, or nobody has two such hands) or "holes". lost: what was
    asked for is not there, or not what it says: status 3."""

    kind: str
    text: str
    lost: bool = True


def check_performers(file_name: str, recording: Recording, cast: Cast) -> None:
    """Raises FormatError where a file names hands of several performers and there is the profile of one."""
    if len(cast) > 1:
        return
    subjects: dict[object, set[str]] = {}
    for label in recording.labels:
        marker = marker_of(label, cast[0].layout)
        if marker is not None and ":" in label:
            subjects.setdefault(marker, set()).add(label.rpartition(":")[0])
    several = max(subjects.values(), key=len, default=set())
    if len(several) > 1:
        raise FormatError(
            f"{file_name} names markers of {len(several)} performers ({_some(sorted(several))}), and the profile of "
            "one was given.",
            "Give --profile once for each performer; labels begin with the name in the profile, or with 1, 2, ...",
        )


def doubts(
    recording: Recording,
    cast: Cast,
    labels: Names | None,
    withheld: bool,
    hands: Mapping[str, HandFigures],
    faults: Sequence[NameFault] = (),
    left_out: Mapping[str, int] | None = None,
    least: float = LEAST_TRACKED,
) -> tuple[Doubt, ...]:
    """Names that are no markers or cannot be right, a hand that rests on few markers or is tracked in few frames,
    a size that no hand has, nothing found.

    withheld: labels were not used. hands: those that were found, by name. faults: of the labels. left_out: points whose
    label was not borne out, by label. least: share of the frames in which a hand must be tracked, 0..1.
    """
    told = [Doubt(fault.kind, fault_words(fault, recording, cast)) for fault in faults]
    if not withheld:
        told += _names(recording, cast, labels)
        told += _sides(cast, labels or {})
        told += _left_out(recording, left_out or {}, _doubted(recording, labels or {}, faults))
    for name, hand in hands.items():
        if hand.hidden > FEW:
            seen = f"Of the {name} hand {100 * (1 - hand.hidden):.0f} % of the markers were seen on average"
            told.append(Doubt("markers", f"{seen}: look whether it is one."))
    for name, hand in hands.items():
        if hand.tracked < least:
            share = f"The {name} hand is tracked in {_percent(hand.tracked)} of the frames"
            told.append(Doubt("tracked", f"{share}, in less than {100 * least:g} %."))
    told += [Doubt("size", text) for text in size_words(hands, cast)]
    if not hands:
        told.append(Doubt("hand", "No hand was found."))
    kinds = {doubt.kind for doubt in told}
    if kinds & {"hand", "tracked"} and "unit" not in kinds:
        told += [Doubt("unit", text) for text in unit_warnings(recording, coded(recording))]
    return tuple(told)


def _names(recording: Recording, cast: Cast, labels: Names | None) -> Iterator[Doubt]:
    """What the file calls its points and the layout its markers."""
    if not recording.labels or (labels is None and all(_NO_NAME.fullmatch(label) for label in recording.labels)):
        return
    layouts = " and ".join(dict.fromkeys(profile.layout.name for profile in cast))
    sets = (
        f"The file has {_some(recording.labels)}; {layouts} has "
        f"{_some([name for profile in cast for name in profile.layout.marker_names])}."
    )
    if labels is None:
        none = f"None of its {len(recording.labels)} names is a marker of {layouts}; its points were named anew."
        yield Doubt("layout", f"{none} {sets}")
        return
    props = {name for prop in props_of(cast) for name in prop.marker_names}
    markers = [marker_of_cast(label, cast) for label in recording.labels]
    least = min(len(profile.layout.marker_names) for profile in cast)
    named: dict[tuple[object, ...], set[int]] = {}
    for marker in markers:
        if marker is not None:
            named.setdefault(marker[:2], set()).add(marker[2])
    most = max(map(len, named.values()), default=0)
    if most < FEW_NAMED * least:
        of = f"Of the {least} markers of {layouts} the file names {most}: it is hardly of this layout."
        yield Doubt("layout", f"{of} {sets}")
    unknown = [
        label for label, marker in zip(recording.labels, markers, strict=True) if marker is None and label not in props
    ]
    if unknown:
        are = "is no marker" if len(unknown) == 1 else "are no markers"
        said = f"{len(unknown)} of its {len(recording.labels)} names {are} of {layouts}: {_some(unknown)}."
        yield Doubt("markers", said, lost=False)


def _sides(cast: Cast, labels: Names) -> Iterator[Doubt]:
    """Hands that the file names and the profiles do not look for."""
    named = {key_of(hand) for hand, _ in labels.values()}
    for key in sorted(named - set(hands_of(cast))):
        whose = f"{cast[key.performer].performer}'s " if len(cast) > 1 else "the "
        sides = " and ".join(cast[key.performer].sides)
        yield Doubt("side", f"The file names {whose}{key.side} hand, and the profile looks for the {sides} one alone.")


def _doubted(recording: Recording, labels: Names, faults: Sequence[NameFault]) -> set[str]:
    """The labels of which it is said already that they cannot be right."""
    if not faults or not labels:  # names that were found here are nothing that the file says
        return set()
    wrong = {(fault.hand, marker) for fault in faults for marker in fault.markers}
    return {
        label
        for label, identity in zip(recording.labels, recording.ids.tolist(), strict=True)
        if identity in labels and (key_of(labels[identity][0]), labels[identity][1]) in wrong
    }


def _left_out(recording: Recording, counts: Mapping[str, int], known: set[str]) -> Iterator[Doubt]:
    given = (~np.isnan(recording.points_m[:, :, 0])).sum(axis=0).tolist()
    for label, seen in zip(recording.labels, given, strict=False):
        share = counts.get(label, 0) / max(seen, 1)
        if share > MOST_LEFT_OUT and label not in known:
            out = f"{label} was left out of {_percent(share)} of the frames that have it"
            yield Doubt("names", f"{out}: its points cannot be that marker.")


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def _some(names: Sequence[str]) -> str:
    shown = ", ".join(names[:_SHOWN])
    return shown if len(names) <= _SHOWN else f"{shown} and {len(names) - _SHOWN} more"
