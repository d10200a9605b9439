"""Several performers side by side in one volume: what a session with more than one profile tracks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from core.errors import PhalanxError
from core.frames import FloatArray
from core.motion.performer import PERIOD_S, Performer
from core.motion.pose_file import Prop

APART_M = 0.6
"""Between neighbours: no hand reaches the other's."""


class Company:
    """Performers who stand in a row along X, the first leftmost, all facing -Z, each at a performance of his own.

    labels: as each performer's, with his number before: "1_left_ThumbTip", "2_right_PinkyTip".
    places_m: (n, 3) float64 [m], how far each stands from where he would alone. props: what they handle, by name; of
    things of one name the first's. Raises PhalanxError for none.
    """

    def __init__(self, performers: Sequence[Performer], apart_m: float = APART_M) -> None:
        if not performers:
            raise PhalanxError("A company of nobody.", "Give at least one performer.")
        self.performers = tuple(performers)
        self.places_m: FloatArray = np.zeros((len(self.performers), 3))
        self.places_m[:, 0] = apart_m * (np.arange(len(self.performers)) - 0.5 * (len(self.performers) - 1))
        self.labels = tuple(
            f"{number}_{label}" for number, one in enumerate(self.performers, start=1) for label in one.labels
        )
        self.props: dict[str, Prop] = {}
        for one in reversed(self.performers):
            self.props.update(one.props)

    def props_world(self, time_s: float) -> dict[str, FloatArray]:
        """(4, 4) float64 [m] of `props`, by name, at a motion time [s]."""
        placed: dict[str, FloatArray] = {}
        for one, place_m in zip(self.performers, self.places_m, strict=True):
            for name, transform in one.props_world(time_s).items():
                shifted = transform.copy()
                shifted[:3, 3] += place_m
                placed.setdefault(name, shifted)
        return placed

    def positions(self, rate_hz: float) -> Iterator[tuple[float, FloatArray]]:
        """Motion time [s] and (len(labels), 3) float64 marker positions [m], without end."""
        i = 0
        while True:
            time_s = i / rate_hz
            placed = [
                markers_m + place_m
                for one, place_m in zip(self.performers, self.places_m, strict=True)
                for markers_m in one.at(time_s).markers_world_m.values()
            ]
            yield time_s % PERIOD_S, np.concatenate(placed)
            i += 1
