"""Which columns of a C3D file are markers, which of their points were measured, and what they are called.

Points hold what models computed, too: angles in degrees, moments, powers. Programs name those in POINT:ANGLES and the
like (Vicon, "type groups"); they are no positions. Joint centres in files of our own are named in PHALANX:COMPUTED.
"""

from __future__ import annotations

import numpy as np

from core.frames import BoolArray, FloatArray
from core.takes.formats.c3d_parameters import Parameters
from core.takes.formats.computed import computed_labels

OWN_GROUP, COMPUTED = "PHALANX", "COMPUTED"
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


def computed_columns(parameters: Parameters, names: list[str]) -> frozenset[str]:
    """Which of the names are joint centres and fingertips that Phalanx computed.

    The group PHALANX has them; files that Phalanx wrote before it did, and those that another program wrote again
    without it, are known by the names alone.
    """
    stated = parameters.continued_texts(OWN_GROUP, COMPUTED)
    return frozenset(stated).intersection(names) if stated else computed_labels(names)


def predicted(parameters: Parameters, residuals: FloatArray) -> BoolArray:
    """(t, m) bool of the residuals of markers (t, m) float64: which of them no camera saw, as Phalanx writes it.

    Zero means calculated, as the format is defined, but many programs write it for every point. So it counts in files
    of our own only, and there only as long as any point has more: some program may have written them again.
    """
    is_own = any(group == OWN_GROUP for group, _ in parameters.values)
    found: BoolArray = residuals == 0.0
    return found if is_own and bool((residuals > 0.0).any()) else np.zeros_like(found)


def _without_subject(name: str) -> str:
    return name.rpartition(":")[2]
