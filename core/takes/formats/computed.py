"""Points that Phalanx computed for its own exports: joint centres and fingertips beside the markers. They are no
markers when such a file is read again: as points they would lie inside the hand, where no camera saw any.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from core.hand.skeleton import JOINT_NAMES, TIP_NAMES

_ENDING = "_joint"
_FIRST = JOINT_NAMES[0] + _ENDING
_OF_A_HAND = re.compile(rf"(?:.*:)?[LR]_{_FIRST}", re.DOTALL)


def joint_labels(prefix: str) -> tuple[str, ...]:
    """(21,) of one hand's joint centres, then its fingertips. prefix: "L_", with several performers "Anna:L_"."""
    return tuple(f"{prefix}{name}{_ENDING}" for name in (*JOINT_NAMES, *TIP_NAMES))


def computed_labels(labels: Iterable[str]) -> frozenset[str]:
    """Those of the labels that are a hand's joint centres and fingertips, as `joint_labels` has them.

    Only where all of a hand are there: a layout may have a marker called `wrist_joint`.
    """
    there = frozenset(labels)
    hands = (joint_labels(label.removesuffix(_FIRST)) for label in there if _OF_A_HAND.fullmatch(label))
    return frozenset(label for hand in hands if there.issuperset(hand) for label in hand)
