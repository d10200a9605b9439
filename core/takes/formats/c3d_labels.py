"""Which columns of a C3D file are markers, and what they are called.

Points hold what models computed, too: angles in degrees, moments, powers. Programs name those in POINT:ANGLES and the
like (Vicon, "type groups"); they are no positions.
"""

from __future__ import annotations

from core.takes.formats.c3d_parameters import Parameters

_NO_POSITIONS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "REACTIONS", "SCALARS")


def labels(parameters: Parameters, n_points: int) -> list[str]:
    """A name for each of the points: those of LABELS, LABELS2, ..., then numbers."""
    names = parameters.continued_texts("POINT", "LABELS")[:n_points]
    return names + [f"point {i + 1}" for i in range(len(names), n_points)]


def marker_columns(parameters: Parameters, names: list[str]) -> tuple[list[int], list[str]]:
    """Which of the named columns are positions, and what is to be said of the others, in sentences.

    A subject's name ("Anna:") may stand before the column's name only, or before the one in ANGLES only; that counts
    where no column has the very name.
    """
    folded = [name.casefold() for name in names]
    groups = (parameters.continued_texts("POINT", group) for group in _NO_POSITIONS)
    computed = {text.casefold() for texts in groups for text in texts if text}
    exact = computed.intersection(folded)
    others = computed - exact
    without_subject = {_without_subject(text) for text in others}
    kept = [
        i
        for i, name in enumerate(folded)
        if name not in exact and _without_subject(name) not in (others if ":" in name else without_subject)
    ]
    n_left_out = len(names) - len(kept)
    if n_left_out == 0:
        return kept, []
    if n_left_out == 1:
        return kept, ["1 column is an angle, force, moment, power or scalar, not a marker, and is left out."]
    what = "angles, forces, moments, powers or scalars, not markers"
    return kept, [f"{n_left_out:,} columns are {what}, and are left out."]


def _without_subject(name: str) -> str:
    return name.rpartition(":")[2]
