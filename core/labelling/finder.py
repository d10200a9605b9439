"""Looks for hands among the points that no tracked hand explains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.frames import NO_POINT, FloatArray, HandState, IntArray
from core.labelling.clusters import clusters
from core.labelling.search import Hypothesis, TemplateSearch, explanation_cost_m2
from core.labelling.validation import MAX_RMS_M
from core.profile import Profile
from core.track import HandTrack

LEAST_SHARE = 0.6
"""Share of a layout's markers that must be seen for a hand to be recognised."""

LONGEST_PAUSE = 12
"""Frames between two attempts when nothing was found: a search costs as much as many frames of tracking."""

BETTER = 0.25
"""What a new explanation must gain, in points without a marker, or labels would flicker."""

BROKEN_ID = 0.25
"""What a device id that changes its marker costs, in points without a marker: two fingers whose names were exchanged
as they crossed must be able to change them back."""

HISTORY_BONUS = 0.6
"""A hand that was lost is likelier to come back than to turn into the other."""


class TemplateFinder:
    """Clusters the free points and matches the hand to each cluster, over the sides that are missing."""

    def __init__(self, profiles: Sequence[Profile]) -> None:
        self._searches = [TemplateSearch.of(profile) for profile in profiles]
        self.reset()

    def reset(self) -> None:
        """Forget what was tried before."""
        self._pause = 0
        self._wait = 0

    def find(self, points_m: Sequence[FloatArray], ids: IntArray, free: IntArray, tracks: Sequence[HandTrack]) -> None:
        """Begin every track whose hand is found; the best match of a side and a cluster first."""
        if self._wait > 0:
            self._wait -= 1
            return
        n_markers = max(len(track.point) for track in tracks)
        groups = [free[group] for group in clusters(points_m[0][free], n_markers)]
        matches: list[tuple[float, int, int, Hypothesis]] = []
        for g, rows in enumerate(groups):
            for i, (points, track) in enumerate(zip(points_m, tracks, strict=True)):
                found = self._best(track, points[rows])
                if found is not None and self._convincing(found, len(track.point)):
                    history = HISTORY_BONUS if track.state is HandState.LOST else 1.0
                    matches.append((history * found.cost_m2, g, i, found))
        used_groups: set[int] = set()
        for _, g, i, found in sorted(matches, key=lambda match: match[:3]):
            if g in used_groups or tracks[i].tracked:
                continue
            used_groups.add(g)
            tracks[i].begin(found.pose, _rows(found.point, groups[g]))
        self._pause = 0 if used_groups or not groups else min(max(1, 2 * self._pause), LONGEST_PAUSE)
        self._wait = self._pause

    def improve(self, track: HandTrack, points_m: FloatArray, rows: IntArray, thorough: bool) -> bool:
        """Search anew among `rows`, near the present pose or (thorough) anywhere; take up what is clearly better."""
        points = points_m[rows]
        cap_m = track.outlier_m
        inside = _inverse_rows(track.point, rows)
        present = explanation_cost_m2(track.pose, points, inside, cap_m)
        if thorough:
            hypotheses = [self._searches[track.performer].find(points, track.known_scale)]
        else:
            exchanged = self._searches[track.performer].find_exchanged(points, track.pose, inside)
            hypotheses = [self._searches[track.performer].find_near(points, track.pose), exchanged]
        best, best_cost = None, present - BETTER * cap_m**2
        for found in hypotheses:
            if found is None:
                continue
            # Device ids rarely change their marker while they live.
            broken = int((track.carried & (found.point != inside)).sum())
            cost = explanation_cost_m2(found.pose, points, found.point, cap_m)
            cost += BROKEN_ID * broken * cap_m**2
            if cost <= best_cost:
                best, best_cost = found, cost
        if best is None:
            return False
        track.mend(best.pose, _rows(best.point, rows))
        track.solve(points_m)
        return True

    def _best(self, track: HandTrack, points_m: FloatArray) -> Hypothesis | None:
        found = [self._searches[track.performer].find(points_m, track.known_scale)]
        if track.state is HandState.LOST:
            found.append(self._searches[track.performer].find_near(points_m, track.pose))
        return min((h for h in found if h is not None), key=lambda h: h.cost_m2, default=None)

    @staticmethod
    def _convincing(found: Hypothesis, n_markers: int) -> bool:
        return found.pose.rms_m <= MAX_RMS_M and found.n_labelled >= LEAST_SHARE * n_markers


def _rows(point: IntArray, rows: IntArray) -> IntArray:
    """Indices into a cluster as indices into the frame."""
    return np.where(point == NO_POINT, NO_POINT, rows[point])


def _inverse_rows(point: IntArray, rows: IntArray) -> IntArray:
    """Indices into the frame as indices into sorted `rows`, which hold them all."""
    return np.where(point == NO_POINT, NO_POINT, np.searchsorted(rows, point))
