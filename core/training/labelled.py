"""Labelled motion of real hands as training data, or to measure on: frames in which every point has its name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from core.errors import FormatError
from core.frames import BoolArray, FloatArray, IntArray
from core.markers.layout import MarkerLayout
from core.training.clouds import LEFT, RIGHT, Clouds, Scenes, gathered, hidden_of
from core.untrusted.npz import read_npz

FARTHEST_M = 1000.0
"""Of a point from the origin."""

_FORM = "It must hold points (frames, markers, 3) [m], hand (frames,) and marker_names (markers,), as of np.savez."

FLESH_M = 0.02
"""Radius of what stands in for a hand whose bones are not known: it hides a little, and reflections lie on it."""


@dataclass(frozen=True)
class LabelledFrames:
    """points_m: (f, m, 3) float64 [m], NaN where a marker is not seen, in the order of the layout. side: (f,) int64,
    clouds.LEFT or RIGHT."""

    name: str
    points_m: FloatArray
    side: IntArray


def read_labelled(path: Path, layout: MarkerLayout) -> LabelledFrames:
    """An .npz of points (f, m, 3) [m], hand (f,), 0 left and 1 right, and marker_names (m,), as of Han 2018.

    Raises FormatError where it holds something else, or markers that the layout does not have.
    """
    data = read_npz(path, ("points", "hand", "marker_names"), path.name, _FORM)
    points, side, written = (data[key] for key in ("points", "hand", "marker_names"))
    if points.dtype.kind not in "fiu" or side.dtype.kind not in "biu" or written.dtype.kind != "U" or written.ndim != 1:
        raise FormatError(
            f"{path.name}: points are {points.dtype}, hand {side.dtype}, marker_names {written.dtype}.", _FORM
        )
    names = written.tolist()
    if len(set(names)) < len(names):
        raise FormatError(f"{path.name}: {_repeated(names)!r} is the name of several markers.", "Name each once.")
    if points.ndim != 3 or points.shape[1:] != (len(names), 3) or side.shape != points.shape[:1]:
        raise FormatError(
            f"{path.name}: points {points.shape}, hand {side.shape}, {len(names)} names.",
            "They must be (frames, markers, 3), (frames,) and one name per marker.",
        )
    missing = [name for name in layout.marker_names if name not in names]
    if missing:
        raise FormatError(
            f"{path.name} has no marker {missing[0]!r} of layout {layout.name}.", "Choose its own layout."
        )
    order = [names.index(name) for name in layout.marker_names]
    ordered = points[:, order].astype(np.float64)
    if np.isinf(ordered).any() or np.nanmax(np.abs(ordered), initial=0.0) > FARTHEST_M:
        raise FormatError(f"{path.name} holds points further than {FARTHEST_M:g} m away.", "Points are in metres.")
    if (side > RIGHT).any() or (side < LEFT).any():
        raise FormatError(f"{path.name}: hand holds {side.max()}.", f"{LEFT} is a left hand, {RIGHT} a right one.")
    return LabelledFrames(path.name, ordered, side.astype(np.int64))


def _repeated(names: Sequence[str]) -> str:
    return next(name for name in names if names.count(name) > 1)


def labelled_supply(
    seed: int, recordings: Sequence[LabelledFrames], layout: MarkerLayout, each: int
) -> Iterator[Clouds]:
    """Batches of `each` clouds without end: frames drawn at random, of another size, mirrored, with more hidden."""
    random = np.random.default_rng([seed, 3])
    points = np.concatenate([recording.points_m for recording in recordings])
    sides = np.concatenate([recording.side for recording in recordings])
    m = len(layout.joints)
    while True:
        rows = random.integers(len(points), size=each)
        drawn = points[rows] * random.uniform(0.9, 1.1, (each, 1, 1))
        there: BoolArray = np.isfinite(drawn[..., 0])
        drawn = np.where(there[..., None], drawn, 0.0)
        centre = drawn.sum(axis=1) / np.maximum(there.sum(axis=1), 1)[:, None]
        drawn -= centre[:, None]
        none = np.zeros((each, 1, 3))
        scene = Scenes(
            drawn, there, np.tile(np.arange(m), (each, 1)), np.tile(sides[rows, None], (1, m)),
            none, none, np.full((each, 1), FLESH_M), np.tile(layout.positions_m, (each, 1, 1)),
        )  # fmt: skip
        clouds = gathered(random, [layout], [(scene, there & ~hidden_of(random, scene, m))])
        yield clouds.mirrored(random.random(each) < 0.5)
