"""How far each pose may be off because the performer's measures and marker places are not quite known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.calibration.fixed_error import SAMPLE, FixedError
from core.frames import FloatArray, HandFrame, HandKey, HandState
from core.hand.skeleton import N_DOFS
from core.takes.export.content import Content, hand_of
from core.takes.export.counted import neutral_hand


class FixedErrors:
    """theta_std_fixed of the hands of a recording: one standard deviation of each parameter, as it is reported, from
    what is the same in all frames, beside the theta_std of each frame's own noise."""

    def __init__(self, content: Content) -> None:
        self._known = {key: _known(content, key) for key in content.hands}

    def of(self, hands: Sequence[HandFrame]) -> list[FloatArray]:
        """(26,) float64 [m for 0:3, else rad] of each tracked hand, in their order."""
        found: list[FloatArray] = [np.empty(0)] * len(hands)
        for key in {hand.key for hand in hands}:
            rows = [i for i, hand in enumerate(hands) if hand.key == key]
            observed = np.array([hands[i].observed for i in rows])
            for i, std in zip(rows, self._known[key].std(*_poses([hands[i] for i in rows]), observed), strict=True):
                found[i] = std
        return found


def _known(content: Content, key: HandKey) -> FixedError:
    profile, shown = content.cast[key.performer], content.shown.get(key, ())
    rows = np.unique(np.linspace(0, len(shown) - 1, min(SAMPLE, len(shown))).astype(int)) if shown else ()
    found = [hand_of(content.solved[shown[row]], key) for row in rows]
    hands = [hand for hand in found if hand is not None and hand.state is HandState.TRACKED]
    seen = np.any([hand.observed for hand in hands], axis=0) if hands else np.zeros(len(profile.layout.joints), bool)
    return FixedError(profile, key.side, *_poses(hands), seen, neutral_hand(content, key))


def _poses(hands: Sequence[HandFrame]) -> tuple[FloatArray, FloatArray]:
    """theta_rad (f, 26) and scales (f,)."""
    thetas = np.array([hand.theta_rad for hand in hands], dtype=np.float64).reshape(-1, N_DOFS)
    return thetas, np.array([hand.scale for hand in hands], dtype=np.float64)
