"""What there is to doubt of a recording that was solved, in sentences: what a green figure does not say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from app.hand_tally import HandFigures
from app.labels import marker_of, owned
from core.cast import Cast, props_of
from core.errors import FormatError
from core.labelling.given import Names
from core.recording import Recording
from core.takes.overview import unit_warnings
from core.takes.wild import coded

FEW = 0.5
"""A hand of which fewer markers are seen than this share, on average, may be none."""

_SHOWN = 5


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


def rests_on_few(hands: Mapping[str, HandFigures]) -> bool:
    """Whether a hand may be none."""
    return any(hand.hidden > FEW for hand in hands.values())


def doubts(
    recording: Recording, cast: Cast, labels: Names | None, withheld: bool, hands: Mapping[str, HandFigures]
) -> tuple[str, ...]:
    """Names that are no markers, a hand that rests on few of them, nothing found. withheld: labels were not used.
    hands: those that were found, by name."""
    told = [] if withheld else _names(recording, cast, labels)
    for name, hand in hands.items():
        if hand.hidden > FEW:
            told.append(
                f"Of the {name} hand {100 * (1 - hand.hidden):.0f} % of the markers were seen on average: look whether "
                "it is one."
            )
    if not hands:
        told += ["No hand was found.", *unit_warnings(recording, coded(recording))]
    return tuple(told)


def _names(recording: Recording, cast: Cast, labels: Names | None) -> list[str]:
    layouts = " and ".join(dict.fromkeys(profile.layout.name for profile in cast))
    if not recording.labels:
        return []
    props = {name for prop in props_of(cast) for name in prop.marker_names}
    known = [
        label in props or ((who := owned(label, cast))[0] is not None and marker_of(who[1], cast[who[0]].layout))
        for label in recording.labels
    ]
    unknown = [label for label, one in zip(recording.labels, known, strict=True) if not one]
    if labels is None:
        return [f"None of its {len(recording.labels)} names is a marker of {layouts}; its points were named anew."]
    if not unknown:
        return []
    are = "is no marker" if len(unknown) == 1 else "are no markers"
    return [f"{len(unknown)} of its {len(recording.labels)} names {are} of {layouts}: {_some(unknown)}."]


def _some(names: Sequence[str]) -> str:
    shown = ", ".join(names[:_SHOWN])
    return shown if len(names) <= _SHOWN else f"{shown} and {len(names) - _SHOWN} more"
