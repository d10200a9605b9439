"""How large a hand is that the labelling network is asked about.

Points have units, and the network has learnt from hands about as large as the template. Of a hand whose size is known
the points are shown to it at the template's size; of one that is not, at several sizes at once, and the answer is kept
of which it is surest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

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


def named_at(
    sizes: Sequence[float], network: LabelNetwork, points_m: FloatArray, layout: MarkerLayout, side: Side | None
) -> NamedHand:
    """The hand that is looked for among (n, 3) float64 [m] points, asked at each of `sizes`, as many times as large as
    the layout has it: the answer that is surest of its names, the mean over its markers. side: None for any."""
    if side is None and len(layout.sides) == 1:
        side = layout.sides[0]
    answers = network.labels_at(sizes, points_m, layout, side)
    if side is not None:
        return _surest([named(labels, side) for labels in answers])[1]
    sides = [labels.side[0] for labels in answers]
    k, one = _surest([named(labels, told) for labels, told in zip(answers, sides, strict=True)])
    return named(network.labels_at((sizes[k],), points_m, layout, one.side)[0], one.side)


def _surest(hands: Sequence[NamedHand]) -> tuple[int, NamedHand]:
    k = int(np.argmax([hand.confidence.mean() for hand in hands]))
    return k, hands[k]
