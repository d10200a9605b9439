"""Labels that come with the recording: nothing to find out but the pose, and which of them cannot be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from core.cast import cast_of
from core.frames import NO_POINT, BoolArray, FloatArray, HandKey, IntArray, Side
from core.kinematics.solver import HandSolver
from core.labelling.consensus import LEAST_POINTS, Asked, Consensus, Fit
from core.labelling.search import TemplateSearch
from core.labelling.validation import MAX_RMS_M
from core.profile import Profile
from core.track import OUTLIER_RANGE_M, HandTrack, tracking_solver

Names = Mapping[int, tuple[Side | HandKey, int]]
"""Device id to hand and index of the marker in its layout. A side alone is the first performer's."""


def key_of(hand: Side | HandKey) -> HandKey:
    """The hand that a name is of."""
    return HandKey(0, hand) if isinstance(hand, str) else hand


AGAIN = 0.5
"""Share of what leaving out a point costs, if it was left out in the frame before: no flicker."""

EXCHANGED, NEARER = 0.1, 0.3
"""The same for two points that lie where motion led each other's markers: so many times nearer than to their own."""

STRAYED = (1.0, 2.0, 4.0)
"""Points so many times further off from where motion led than any point lies from its marker may be the wrong ones."""


class GivenLabels:
    """Labeller, finder and validator for points whose id says what they are.

    A point that cannot be the marker it is named after is left out: its marker is then hidden. Where no hand fits even
    so, there is none. profiles: of each performer, as the engine has them. tested: False for names that are on trial
    elsewhere; then every pose stands.
    """

    def __init__(self, profiles: Profile | Sequence[Profile], labels: Names, *, tested: bool = True) -> None:
        self._labels = {identity: (key_of(hand), marker) for identity, (hand, marker) in labels.items()}
        self._tested = tested
        cast = cast_of(profiles)
        self._searches = [TemplateSearch.of(profile) for profile in cast]
        # A hand that is looked for is not thought to be in a usual posture, one that is followed is.
        self._found_by = [Consensus(HandSolver(profile.hand.skeleton, profile.worn)) for profile in cast]
        self._followed_by = [Consensus(tracking_solver(profile)) for profile in cast]
        self.reset()

    def reset(self) -> None:
        """Forget what was left out before."""
        self._left_out: dict[HandKey, BoolArray] = {}
        self._half_sized: set[HandKey] = set()

    def skip(self, frames: int) -> None:
        """Nothing is counted."""

    def pass_over(self, ids: frozenset[int], tracks: Sequence[HandTrack]) -> None:
        """Ids say what points are in every frame alike."""

    def keep(self, hands: Mapping[HandKey, HandKey]) -> None:
        """Go on with what was left out of these hands."""
        self._left_out = {hands[key]: out for key, out in self._left_out.items() if key in hands}
        self._half_sized = {hands[key] for key in self._half_sized if key in hands}

    def label(self, points_m: Sequence[FloatArray], ids: IntArray, tracks: Sequence[HandTrack]) -> None:
        """Write `point` of every track from the ids."""
        for track in tracks:
            track.point = self._points_of(track, ids)

    def find(self, points_m: Sequence[FloatArray], ids: IntArray, free: IntArray, tracks: Sequence[HandTrack]) -> None:
        """Begin every track that has labelled points enough which are a hand."""
        for points, track in zip(points_m, tracks, strict=True):
            point = self._points_of(track, ids)
            if (point != NO_POINT).sum() >= LEAST_POINTS:
                self._find(track, points, point, ids)
            else:
                track.why = "too few markers" if (point != NO_POINT).any() else "no points"

    def _find(self, track: HandTrack, points_m: FloatArray, point: IntArray, ids: IntArray) -> None:
        search, scale = self._searches[track.performer], track.known_scale
        pose = search.fit_labelled(points_m, point, scale)
        out = np.zeros(len(point), dtype=np.bool_)
        if self._tested:
            asked = Asked(_targets(points_m, point), point != NO_POINT, np.ones(len(point)), free_scale=scale is None)
            fit = self._found_by[track.performer].best(Fit(pose, asked.given), asked)
            out = asked.given & ~fit.kept
            if out.any():
                point = np.where(out, NO_POINT, point)
                pose = search.fit_labelled(points_m, point, scale)
            if pose.rms_m > MAX_RMS_M:
                track.why = "out of shape"
                return
        track.begin(pose, point, ids)
        self._note(track, out)
        if out.any() and scale is None:
            self._half_sized.add(track.key)

    def accept(self, track: HandTrack, points_m: FloatArray, free: BoolArray) -> bool:
        """Any pose with points enough that are a hand. What cannot be its marker has lost its name."""
        given = track.observed
        out = np.zeros(len(given), dtype=np.bool_)
        enough = bool(given.sum() >= LEAST_POINTS)
        if enough and self._tested:
            out = self._wrong(track, points_m)
            if out.any():
                track.point[out] = NO_POINT
                track.solve_anew(points_m)
            elif track.key in self._half_sized:
                track.review_size(points_m)  # not all of it was there to be measured
                self._half_sized.discard(track.key)
        fits = not self._tested or track.pose.rms_m <= MAX_RMS_M
        self._note(track, out)
        track.why = "" if enough and fits else "out of shape" if enough else "too few markers"
        return enough and fits

    def _wrong(self, track: HandTrack, points_m: FloatArray) -> BoolArray:
        """(m,) bool, markers whose points cannot be theirs."""
        given = track.observed
        whole = Fit(track.pose, given)
        if whole.misfit_m2 <= EXCHANGED * track.outlier_m**2:  # nearly every frame
            return np.zeros(len(given), dtype=np.bool_)
        before = self._left_out.get(track.key)
        if before is None:
            before = np.zeros(len(given), dtype=np.bool_)
        targets_m = _targets(points_m, track.point)
        # From each marker's point to where each marker was expected.
        apart_m = np.linalg.norm(targets_m[:, None] - track.seen_at(track.predicted)[None], axis=2)
        off_m = apart_m.diagonal()
        share = np.where(before, AGAIN, 1.0)
        share[_exchanged(apart_m, given)] = EXCHANGED
        asked = Asked(targets_m, given, share, track.typical_rms_m, track.predicted)
        others = [~before, *(off_m < times * track.outlier_m for times in STRAYED)]
        return given & ~self._followed_by[track.performer].best(whole, asked, others).kept

    def _note(self, track: HandTrack, out: BoolArray) -> None:
        """Take note of what was left out: of such a marker nobody knows whether it is hidden."""
        self._left_out[track.key] = out
        track.label_confidence[:] = np.where(out, np.nan, 1.0)

    def _points_of(self, track: HandTrack, ids: IntArray) -> IntArray:
        point = np.full(len(track.point), NO_POINT, dtype=np.int64)
        own = HandKey(track.performer, track.side)
        for row, device_id in enumerate(ids):
            hand, marker = self._labels.get(int(device_id), (None, 0))
            if hand == own:
                point[marker] = row
        return point


def _exchanged(apart_m: FloatArray, given: BoolArray) -> BoolArray:
    """(m,) bool, markers whose points lie where another's was expected, whose own lies where theirs was.

    apart_m: (m, m) [m], from the point of each marker to where each was expected.
    """
    own_m = apart_m.diagonal()[:, None]
    nearer = (apart_m < NEARER * own_m) & (own_m > OUTLIER_RANGE_M[0]) & given[:, None] & given
    exchanged: BoolArray = np.any(nearer & nearer.T, axis=1)
    return exchanged


def _targets(points_m: FloatArray, point: IntArray) -> FloatArray:
    """(m, 3) float64 [m], the point of each marker, zeros for none."""
    targets_m: FloatArray = np.where((point != NO_POINT)[:, None], points_m[point], 0.0)
    return targets_m
