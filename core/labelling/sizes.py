"""How large a hand is that the labelling network is asked about.

Points have units, and the network has learnt from hands about as large as the template. Of a hand whose size is known
the points are shown to it at the template's size; of one that is not, at several sizes at once, and the answer is kept
of which it is surest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from core.frames import FloatArray, Side
from core.hand.shape import FIRST_BONE, FIRST_GIRTH, HandShape
from core.labelling.network import LabelNetwork, NamedHand, named
from core.markers.layout import MarkerLayout
from core.profile import Profile

SIZES = (0.66, 0.81, 1.0, 1.235)
"""Of hands, in sizes of the template: what is asked where nothing is known. The network names hands from 0.9 to 1.14 of
the size that it is asked at as well as any (within a point with 13 markers), so these serve hands from 0.6 to 1.4
of the template: 110 to 260 mm long. Chosen on users 1 to 3 of Han 2018, not on user 4."""


def size_of(shape: HandShape) -> float:
    """How large a hand is against the template: the geometric mean of its bones, and of length and width of the palm.
    Girths do not move markers much."""
    lengths = np.concatenate([shape.ratios[:2], shape.ratios[FIRST_BONE:FIRST_GIRTH]])
    return float(np.exp(np.log(lengths).mean()))


def told_of(profile: Profile) -> MarkerLayout:
    """The layout as the performer wears it, on a hand of this shape as large as the template."""
    worn = profile.worn
    return replace(worn, positions_m=worn.positions_m / size_of(profile.shape))


@dataclass(frozen=True)
class Sized:
    """How large the hand in a cloud is, in sizes of the template, and whether it is a right one: how sure that is."""

    size: float
    right: float


def sized(network: LabelNetwork, points_m: FloatArray, told: MarkerLayout) -> Sized:
    """The hand in (n, 3) float64 [m] points, of either side, asked at all SIZES at once: that of which the network is
    surest of its names, the mean over markers. The answer for points in the mirror is the same, with the other side."""
    answers = network.labels_at(SIZES, points_m, told)
    best = int(np.argmax([named(labels, "right").confidence.mean() for labels in answers]))
    side, sure = answers[best].side
    return Sized(SIZES[best], sure if side == "right" else 1.0 - sure)


def named_unsized(
    network: LabelNetwork, points_m: FloatArray, layout: MarkerLayout, side: Side | None = None
) -> NamedHand:
    """The hand of unknown size that is looked for among (n, 3) float64 [m] points. layout: on a hand as large as the
    template. side: None for any."""
    found = sized(network, points_m, layout)
    if side is None:
        told: Side = "right" if found.right >= 0.5 else "left"
        side = told if len(layout.sides) > 1 else layout.sides[0]
    return named(network.labels_at((found.size,), points_m, layout, side)[0], side)
