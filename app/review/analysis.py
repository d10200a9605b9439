"""A solved take as arrays over time: what the timeline and the plots draw. Knows no window."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from app.hand_words import performer_titles, side_title
from app.label_trust import trust
from core.cast import Cast, cast_of, hands_of
from core.frames import WHY_LOST, BoolArray, FloatArray, HandKey, HandState, IntArray, Side, TrackedFrame
from core.hand.certainty import guesses
from core.hand.skeleton import N_DOFS
from core.profile import Profile
from core.takes.holes import NO_HOLES, Holes

TELL_EVERY = 500


class Cell(IntEnum):
    """What a lane of the timeline shows at one frame."""

    UNSOLVED = 0
    SEARCHING = 1
    LOST = 2
    TRACKED = 3


_CELLS = {HandState.SEARCHING: Cell.SEARCHING, HandState.LOST: Cell.LOST, HandState.TRACKED: Cell.TRACKED}


@dataclass(frozen=True)
class Analysis:
    """Every frame of a take, for each hand of the profiles.

    hands: (h,). performers: their names where there are several, else (). marker_names: (h,), of each hand; where one
    has fewer markers than another, arrays over markers end in what is nobody's. states: (h, n) uint8 of Cell.
    rms_m: (h, n) float32 [m], NaN where not tracked. scales: (h, n) float32, of the hand, 1 where not tracked.
    theta_rad: (h, n, 26) float32, NaN where not tracked.
    observed: (h, n, m) bool. theta_std: (h, n, 26) float32 [m for 0:3, else rad], marker_std_m: (h, n, m) float32 [m]:
    how sure, as in a HandFrame; NaN where not tracked or not known. guessed_joints: (h, n) uint8, how many joints are a
    guess. trust: (h, n, 2) float32 in 0..1, mean and least confidence of the labels, NaN where not known. why: (h, n)
    uint8, index into WHY_LOST. cast: the performers. holes: where the take has no frames. missing: about how many it
    lacks; they count as not tracked and not seen.

    Angles count from the performers' neutral trials, as in angles.csv, and theta_std with them; what is a guess is not
    told by these but by the solver's own deviations.
    left_out: how many frames were left out of solving by choice; they count as nothing.
    """

    hands: tuple[HandKey, ...]
    performers: tuple[str, ...]
    marker_names: tuple[tuple[str, ...], ...]
    states: NDArray[np.uint8]
    rms_m: NDArray[np.float32]
    scales: NDArray[np.float32]
    theta_rad: NDArray[np.float32]
    observed: BoolArray
    theta_std: NDArray[np.float32]
    marker_std_m: NDArray[np.float32]
    guessed_joints: NDArray[np.uint8]
    trust: NDArray[np.float32]
    why: NDArray[np.uint8]
    cast: Cast
    holes: Holes = NO_HOLES
    missing: int = 0
    left_out: int = 0

    @property
    def sides(self) -> tuple[Side, ...]:
        """(h,)."""
        return tuple(hand.side for hand in self.hands)

    def from_neutral(self, hand: int) -> bool:
        """Whether the angles of a hand count from a neutral trial."""
        neutral = self.cast[self.hands[hand].performer].neutral
        return neutral is not None and self.hands[hand].side in neutral.hands

    def title(self, hand: int) -> str:
        """'Left'; of several performers 'Anna · left'."""
        return side_title(self.performers, self.hands[hand])

    @property
    def n_frames(self) -> int:
        """Frames of the take."""
        return int(self.states.shape[1])

    @cached_property
    def with_pose(self) -> IntArray:
        """Frames of which some hand has a state, in their order: those that were solved."""
        return np.flatnonzero((self.states != Cell.UNSOLVED).any(axis=0))

    def chosen_of(self, frame: int) -> int:
        """n where this frame was left out because every n-th was to be solved, else 0: told by how far apart the frames
        beside it with poses are, for a take only counts those that were left out."""
        posed = self.with_pose
        after = int(np.searchsorted(posed, frame))
        if not self.left_out or not len(posed) or (after < len(posed) and posed[after] == frame):
            return 0
        apart = np.diff(posed)
        usual = int(np.bincount(apart[apart > 1]).argmax()) if (apart > 1).any() else 0
        here = int(apart[after - 1]) if 0 < after < len(posed) else usual
        every_one = self.left_out >= self.n_frames - len(posed)  # none is without a pose for another reason
        return here if every_one or here == usual else 0

    def tracked_share(self, hand: int) -> float:
        """Share of the frames that should be there and have poses in which a hand is tracked, 0..1."""
        wanted = self.n_frames + self.missing - self.left_out
        return float((self.states[hand] == Cell.TRACKED).sum()) / max(wanted, 1)

    def gap_shares(self, hand: int) -> FloatArray:
        """(m,) float64, share of its tracked frames, and of those that are missing, in which each of its markers is not
        seen, 0..1."""
        tracked = self.states[hand] == Cell.TRACKED
        n, m = int(tracked.sum()) + self.missing, len(self.marker_names[hand])
        return 1.0 - self.observed[hand, tracked, :m].sum(axis=0) / n if n else np.zeros(m)

    def guessed_share(self, hand: int) -> float:
        """Share of its tracked frames in which some joint of a hand is a guess, 0..1."""
        tracked = self.states[hand] == Cell.TRACKED
        return float((self.guessed_joints[hand, tracked] > 0).mean()) if tracked.any() else 0.0

    def losses(self, hand: int) -> int:
        """How often a hand was lost."""
        states = self.states[hand]
        lost = states[states != Cell.UNSOLVED] == Cell.LOST
        return int((lost[1:] & ~lost[:-1]).sum() + lost[:1].sum())


def analyse(
    solved: Sequence[TrackedFrame],
    matched: IntArray,
    profiles: Profile | Sequence[Profile],
    progress: Callable[[float, str], bool | None] | None = None,
    holes: Holes = NO_HOLES,
    missing: int = 0,
) -> Analysis | None:
    """Read every solved frame once. matched: as match_solved gives it. holes, missing: as in an Analysis. None if
    `progress` returned False."""
    cast = cast_of(profiles)
    hands = hands_of(cast)
    names = tuple(cast[key.performer].layout.marker_names for key in hands)
    n, m, h = len(matched), max(map(len, names)), len(hands)
    states = np.zeros((h, n), np.uint8)
    rms_m = np.full((h, n), np.nan, np.float32)
    scales = np.ones((h, n), np.float32)
    theta_rad = np.full((h, n, N_DOFS), np.nan, np.float32)
    observed = np.zeros((h, n, m), bool)
    theta_std = np.full((h, n, N_DOFS), np.nan, np.float32)
    marker_std_m = np.full((h, n, m), np.nan, np.float32)
    label_trust = np.full((h, n, 2), np.nan, np.float32)
    why = np.zeros((h, n), np.uint8)
    index = {key: i for i, key in enumerate(hands)}
    for i in range(n):
        if i % TELL_EVERY == 0 and progress is not None and progress(i / n, "Reading the take") is False:
            return None
        if matched[i] < 0:
            continue
        for hand in solved[matched[i]].hands:
            k = index.get(hand.key)
            if k is None:
                continue
            states[k, i] = _CELLS[hand.state]
            why[k, i] = WHY_LOST.index(hand.why) if hand.why in WHY_LOST else 0
            if hand.state is HandState.TRACKED:
                rms_m[k, i] = hand.rms_m
                scales[k, i] = hand.scale
                theta_rad[k, i] = hand.theta_rad
                theta_std[k, i] = hand.theta_std
                label_trust[k, i] = trust(hand)
                if len(hand.point) == len(names[k]):
                    observed[k, i, : len(names[k])] = hand.observed
                    marker_std_m[k, i, : len(names[k])] = hand.marker_std_m
    guessed_joints = guesses(theta_std).sum(axis=-1, dtype=np.uint8)
    for k, key in enumerate(hands):
        neutral = cast[key.performer].neutral
        if neutral is not None:
            theta_rad[k], theta_std[k] = neutral.reported(key.side, theta_rad[k], theta_std[k])
    return Analysis(
        hands, performer_titles(cast), names, states, rms_m, scales, theta_rad, observed, theta_std, marker_std_m,
        guessed_joints, label_trust, why, cast, holes, missing,
    )  # fmt: skip
