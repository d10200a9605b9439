"""How far each pose may be off because the performer's measures and marker places are not quite known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.calibration.carried import Carrier, fixed_std
from core.frames import BoolArray, FloatArray, HandFrame, HandKey, HandState
from core.hand.mirror import mirror_theta
from core.takes.export.content import Content, hand_of

SAMPLE = 200
"""Frames, spread over the recording, from which it is seen which markers a hand shows and what its size rests on."""


@dataclass(frozen=True)
class _Known:
    """Of one hand. shown: (m,) bool, markers that the sample shows. covariance: of what its frames share."""

    carrier: Carrier
    shown: BoolArray
    covariance: FloatArray


class FixedErrors:
    """theta_std_fixed of the hands of a recording: one standard deviation of each parameter from what is the same in
    all frames, beside the theta_std of each frame's own noise."""

    def __init__(self, content: Content) -> None:
        carriers = [Carrier(profile) for profile in content.cast]
        self._known = {key: _known(content, key, carriers[key.performer]) for key in content.hands}

    def of(self, hands: Sequence[HandFrame]) -> list[FloatArray]:
        """(26,) float64 [m for 0:3, else rad] of each tracked hand, in their order."""
        found: list[FloatArray] = [np.empty(0)] * len(hands)
        for key in {hand.key for hand in hands}:
            rows = [i for i, hand in enumerate(hands) if hand.key == key]
            known = self._known[key]
            carried = _carried(known.carrier, [hands[i] for i in rows], known.shown)
            for i, std in zip(rows, fixed_std(carried, known.covariance), strict=True):
                found[i] = std
        return found


def _known(content: Content, key: HandKey, carrier: Carrier) -> _Known:
    profile, shown = content.cast[key.performer], content.shown.get(key, ())
    rows = np.unique(np.linspace(0, len(shown) - 1, min(SAMPLE, len(shown))).astype(int)) if shown else ()
    found = [hand_of(content.solved[shown[row]], key) for row in rows]
    hands = [hand for hand in found if hand is not None and hand.state is HandState.TRACKED]
    seen = np.any([hand.observed for hand in hands], axis=0) if hands else np.zeros(len(profile.layout.joints), bool)
    covariance = carrier.covariance
    if profile.scale is None and hands:
        covariance = carrier.sized(_carried(carrier, hands, seen, free_scale=True))
    return _Known(carrier, seen, covariance)


def _carried(carrier: Carrier, hands: Sequence[HandFrame], shown: BoolArray, *, free_scale: bool = False) -> FloatArray:
    """G (f, 26 or 27, n). A marker that is hidden for a while counts: what is known of its digit then is from when it
    was seen, or will be, and as wrong as it is there."""
    thetas = np.stack([mirror_theta(hand.theta_rad) if hand.side == "left" else hand.theta_rad for hand in hands])
    weights = np.stack([(hand.observed | shown).astype(np.float64) for hand in hands])
    return carrier.carried(thetas, np.asarray([hand.scale for hand in hands]), weights, free_scale=free_scale)
