"""Names for tracklets, beginning with those beyond doubt: each round stands upon the one before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from core.cast import Cast
from core.engine import Engine
from core.frames import NO_ID, BoolArray, FloatArray, IntArray, MarkerFrame
from core.labelling.given import GivenLabels
from core.relabel.choice import best_names
from core.relabel.cloud import Cloud
from core.relabel.evidence import Witness, with_names
from core.relabel.names import NOBODY, Naming
from core.relabel.teller import Teller
from core.relabel.votes import FULL, mirrored

SURE_S = 0.15
"""Reflections rarely live so long. Without ids a tracklet ends wherever it is not certain how it goes on, not where its
point vanishes: how long it is says nothing then."""

SURE_SHARE = 0.8
"""Of the votes, for a name that is beyond doubt; and of the votes of one whole pass."""

SURE_NOBODY, SURE_NOBODY_S = 0.95, 0.5
"""The same for a tracklet that is no marker of a hand."""

LEAD_S = 1.0
"""The hand is solved for so long before what is in doubt: by then it is known how it moves."""

MOST_ROUNDS = 2
"""A third costs as much as the second and changes nothing."""

UNFIT_M = 0.004
"""A tracklet so much further from its marker than tracklets of this marker usually are is not this marker."""

MISLED = 0.05
"""Share of votes that may be wrong all together: what led one frame astray led the next."""

VOTE_S, MOST_VOTES = 0.3, 2.0
"""Votes of frames so near in time are one opinion; and there are no more than so many opinions."""

FLICKER_S, MOST_FLICKER, BARELY = 0.1, 4.0, 2.0
"""Reflections flicker: log of the odds that a point which is seen for so long is a marker."""

DECIDED = 0.95
"""Certainty of a name that the next round builds upon."""


class Settling:
    """Settles the names of all tracklets."""

    def __init__(
        self, frames: Sequence[MarkerFrame], cast: Cast, naming: Naming, cloud: Cloud, votes: IntArray,
        scales: Sequence[float | None], teller: Teller,
    ) -> None:  # fmt: skip
        self._frames, self._naming, self._cloud = frames, naming, cloud
        self._teller = teller
        self._votes = votes[:, :-1].astype(np.float64)
        self._total = votes.sum(axis=1)
        self._begin, self._end = cloud.spans()
        self._usual_s = float(np.median(np.diff(cloud.time_s))) if cloud.n_frames > 1 else 0.0
        self._seconds = cloud.time_s[self._end] - cloud.time_s[self._begin] + self._usual_s
        self._cast = tuple(
            profile if scale is None or profile.scale is not None else replace(profile, scale=scale)
            for profile, scale in zip(cast, scales, strict=True)
        )
        self._n_frames = self._end - self._begin + 1
        self._lives_told = any((frame.ids != NO_ID).any() for frame in frames)

    def run(self) -> tuple[IntArray, FloatArray]:
        """Round after round, each with more that is settled, until nothing changes: the name of each tracklet, int64,
        NOBODY for none, and the probability that this is so."""
        name = self.by_votes()
        settled, nobody = self._beyond_doubt(name), self._surely_nobody()
        certainty = np.where(settled | nobody, _certainty(name, self._odds(0.0)), 0.0)
        rejected = np.zeros(len(name), dtype=np.bool_)
        for round_ in range(MOST_ROUNDS):
            doubted = ~settled & ~nobody
            if not doubted.any():
                break
            known = np.where(settled, name, NOBODY)
            witness = self._heard(known, doubted, round_)
            unfit = settled & self._unfit(name, witness.off_m())
            # Rounded, so that the order in which frames were added up does not count.
            gain = np.round(self._gain(witness.evidence()), 6)
            new = best_names(self._begin, self._end, gain, known)
            certainty[doubted] = _certainty(new, gain)[doubted]
            more = doubted & (new != NOBODY) & (certainty > DECIDED) & ~rejected
            done = not unfit.any() and (np.array_equal(new, name) or not more.any())
            name = new
            if done:
                break
            rejected |= unfit
            settled = (settled & ~unfit) | more
        return name, certainty

    def by_votes(self) -> IntArray:
        """(n_tracklets,) int64, names by votes alone: a name gains those for it less half of all others."""
        return best_names(self._begin, self._end, 1.5 * self._votes - 0.5 * self._total[:, None])

    def _beyond_doubt(self, name: IntArray) -> BoolArray:
        own = np.where(name != NOBODY, self._votes[np.arange(len(name)), np.maximum(name, 0)], 0.0)
        agreed = (own >= SURE_SHARE * self._total) & (own >= SURE_SHARE * FULL * self._n_frames)
        long = self._seconds >= (SURE_S if self._lives_told else 0.0)
        sure: BoolArray = agreed & long & (name != NOBODY)
        return sure

    def _surely_nobody(self) -> BoolArray:
        """Tracklets that both passes refused for long, and all that were never near a hand but for short ones."""
        refused = self._total - self._votes.sum(axis=1)
        nobody: BoolArray = (refused >= SURE_NOBODY * self._total) & (self._seconds >= SURE_NOBODY_S)
        return nobody

    def _heard(self, name: IntArray, doubted: BoolArray, round_: int) -> Witness:
        """The hands solved with these names alone, in both directions, and what they say of all that is in doubt."""
        witness = Witness(self._cloud, self._naming, self._cast, name, doubted)
        given = GivenLabels(self._cast, self._naming.labels, tested=False)
        for back in (False, True):
            stretches = self._stretches(doubted, back)
            numbers = (i for stretch in stretches for i in stretch)
            begins = {stretch[0] for stretch in stretches}
            until = 0.7 + 0.3 * (round_ + (1.0 if back else 0.5)) / MOST_ROUNDS
            for i in self._teller.through(numbers, "Weighing what is in doubt", until):
                if i in begins:
                    engine = Engine(self._cast, labeller=given, finder=given, validator=given)
                frame = mirrored(self._frames[i]) if back else self._frames[i]
                named = with_names(frame, name[self._cloud.tracklet[self._cloud.rows(i)]])
                witness.see(i, frame.points_m, engine.step(named), back)
        return witness

    def _stretches(self, doubted: BoolArray, back: bool) -> list[range]:
        """Numbers of the frames in which anything is in doubt, in the order in which they are solved, each stretch with
        what leads to it."""
        lead = round(LEAD_S / self._usual_s) if self._usual_s > 0.0 else 0
        needed = np.zeros(self._cloud.n_frames + 1, dtype=np.int64)
        np.add.at(needed, np.maximum(self._begin[doubted] - (0 if back else lead), 0), 1)
        np.add.at(needed, np.minimum(self._end[doubted] + 1 + (lead if back else 0), self._cloud.n_frames), -1)
        inside = np.concatenate([[0], (np.cumsum(needed[:-1]) > 0).astype(np.int8), [0]])
        edges = np.flatnonzero(np.diff(inside)).reshape(-1, 2).tolist()
        return [range(end - 1, begin - 1, -1) if back else range(begin, end) for begin, end in edges]

    def _gain(self, evidence: FloatArray) -> FloatArray:
        """Odds of place and votes together; where the place is not known, votes alone."""
        opinions = np.minimum(self._seconds / VOTE_S, MOST_VOTES)[:, None]
        odds = opinions * self._odds(MISLED)
        prior = self._lives_told * (np.minimum(self._seconds / FLICKER_S, MOST_FLICKER)[:, None] - BARELY)
        gain: FloatArray = np.where(np.isnan(evidence), odds, evidence + odds + prior)
        return gain

    def _odds(self, misled: float) -> FloatArray:
        """(n_tracklets, n_names) log of the odds of each name against none by votes alone, of which a share `misled`
        says nothing."""
        floor = (misled * self._total + 0.1 * FULL)[:, None]
        nobody = (self._total - self._votes.sum(axis=1))[:, None]
        odds: FloatArray = np.log((self._votes + floor) / (nobody + floor))
        return odds

    def _unfit(self, name: IntArray, off_m: FloatArray) -> BoolArray:
        unfit = np.zeros(len(name), dtype=np.bool_)
        for k in range(self._naming.n_names):
            own = np.flatnonzero((name == k) & np.isfinite(off_m))
            if len(own):
                usual = _middle(off_m[own], self._n_frames[own])
                unfit[own] = off_m[own] > max(2.0 * usual, usual + UNFIT_M)
        return unfit


def _middle(values: FloatArray, weights: IntArray) -> float:
    """Weighted median."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, 0.5 * total[-1])])


def _certainty(name: IntArray, gain: FloatArray) -> FloatArray:
    """(t,) float64, probability of each name against every other and none. gain: log of the odds against none."""
    odds = np.concatenate([gain, np.zeros((len(gain), 1))], axis=1)
    weight = np.exp(odds - odds.max(axis=1, keepdims=True))
    share: FloatArray = weight[np.arange(len(name)), name] / weight.sum(axis=1)  # NOBODY is the last
    return share
