"""Clouds of one frame made of real poses: markers hidden, reflections added, and what is counted of the answers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from core.errors import FormatError
from core.frames import NO_POINT, FloatArray, IntArray, Side
from core.labelling.network import NamedHand
from core.markers.layout import MarkerLayout
from core.untrusted.npz import read_npz

Users = Sequence[tuple[FloatArray, IntArray]]
"""Of each user: (f, m, 3) [m] and (f,), 1 for a right hand."""

MOST_HIDDEN, MOST_GHOSTS = 5, 2
MARGIN = 0.1
"""Ghosts lie anywhere in the box of the hand's markers, which is larger than they are by this share on every side."""


@dataclass(frozen=True)
class Cloud:
    """points_m: (n, 3) [m] in random order. point: (m,), the true index of each marker, NO_POINT if it is hidden."""

    points_m: FloatArray
    point: IntArray
    side: Side


@dataclass
class Score:
    """Sums over clouds, of all markers of the layout and all points."""

    labels: int = 0
    right: int = 0
    frames: int = 0
    frames_right: int = 0
    hidden: int = 0
    hidden_said: int = 0
    hidden_right: int = 0
    ghosts: int = 0
    ghosts_said: int = 0
    ghosts_right: int = 0
    sides_right: int = 0
    confidence: float = 0.0

    def add(self, cloud: Cloud, hand: NamedHand) -> None:
        """One cloud, and what was made of it."""
        good = hand.point == cloud.point
        self.labels += len(good)
        self.right += int(good.sum())
        self.frames += 1
        self.frames_right += bool(good.all())
        lost, said = cloud.point == NO_POINT, hand.point == NO_POINT
        self.hidden += int(lost.sum())
        self.hidden_said += int(said.sum())
        self.hidden_right += int((lost & said).sum())
        rows = np.arange(len(cloud.points_m))
        ghosts, left = ~np.isin(rows, cloud.point), ~np.isin(rows, hand.point)
        self.ghosts += int(ghosts.sum())
        self.ghosts_said += int(left.sum())
        self.ghosts_right += int((ghosts & left).sum())
        self.sides_right += hand.side == cloud.side
        self.confidence += float(hand.confidence.sum())

    def figures(self) -> dict[str, float]:
        """Shares, 0..1, NaN where there is nothing to share."""
        return {
            "labels": _share(self.right, self.labels),
            "frames": _share(self.frames_right, self.frames),
            "hidden_precision": _share(self.hidden_right, self.hidden_said),
            "hidden_recall": _share(self.hidden_right, self.hidden),
            "ghost_precision": _share(self.ghosts_right, self.ghosts_said),
            "ghost_recall": _share(self.ghosts_right, self.ghosts),
            "sides": _share(self.sides_right, self.frames),
            "confidence": _share(self.confidence, self.labels),
        }


def perturbed(
    random: np.random.Generator, points_m: FloatArray, sides: IntArray, count: int, most_hidden: int, most_ghosts: int
) -> Iterator[Cloud]:
    """`count` frames of (f, m, 3) [m], each with 0 to most_hidden markers gone and 0 to most_ghosts points added."""
    m = points_m.shape[1]
    for row in random.integers(len(points_m), size=count):
        markers = points_m[row]
        hidden = random.permutation(m)[: int(random.integers(most_hidden + 1))]
        shown = np.setdiff1d(np.arange(m), hidden)
        low, high = markers.min(axis=0), markers.max(axis=0)
        margin = MARGIN * (high - low)
        n_ghosts = int(random.integers(most_ghosts + 1))
        ghosts = random.uniform(low - margin, high + margin, (n_ghosts, 3))
        points = np.concatenate([markers[shown], ghosts])
        order = random.permutation(len(points))
        point = np.full(m, NO_POINT, dtype=np.int64)
        point[shown] = np.argsort(order)[: len(shown)]
        yield Cloud(points[order], point, "right" if sides[row] else "left")


def path_of(folder: Path, user: int) -> Path:
    """The recording of a user, in the folder or its han2018/."""
    path = folder / f"han_user{user}.npz"
    return path if path.is_file() else folder / "han2018" / path.name


def frames_of(folder: Path, user: int, layout: MarkerLayout, second: bool = False) -> tuple[FloatArray, IntArray]:
    """(f, 19, 3) [m] in the order of the layout, and (f,), 1 for a right hand. second: of every second sequence alone,
    those that `sequences` does not calibrate from. Raises FormatError."""
    path = path_of(folder, user)
    mend = "Give --data the folder with the recordings of Han et al. 2018."
    data = read_npz(path, ("marker_names", "points", "hand"), str(path), mend, optional=("sequence",))
    try:
        names = [str(name) for name in data["marker_names"]]
        order = [names.index(name) for name in layout.marker_names]
        points, sides = data["points"], data["hand"].astype(np.int64)
        kept = np.ones(len(sides), dtype=np.bool_)
        if second:  # left hands are right ones mirrored, in sequences of their own in the same order
            sequence = data["sequence"]
            kept = np.isin(sequence, np.concatenate([np.unique(sequence[sides == side])[1::2] for side in (0, 1)]))
        return points[kept][:, order].astype(np.float64), sides[kept]
    except (ValueError, LookupError) as error:
        raise FormatError(f"{path} cannot be read ({error}).", mend) from error


def thinned(layout: MarkerLayout, kept: list[int]) -> MarkerLayout:
    """The layout with these markers alone."""
    return replace(
        layout,
        name=f"{layout.name} thinned to {len(kept)}",
        marker_names=tuple(layout.marker_names[k] for k in kept),
        joints=layout.joints[kept],
        positions_m=layout.positions_m[kept],
    )


def _share(part: float, whole: float) -> float:
    return part / whole if whole else float("nan")
