"""Props: rigid things with markers on them, that hands take up (Schröder 2017, "Fully automatic tracking").

A prop is a small JSON file, or part of a profile:

    {"format": "phalanx-prop", "version": 1, "name": "pen", "model": {"shape": "cylinder", "size_m": [0.01, 0.15]},
     "markers_m": [[x, y, z], ...]}

The prop's frame lies in the middle of its model; a cylinder stands along z.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from scipy.spatial.transform import Rotation

from core.errors import FormatError
from core.frames import FloatArray
from core.json_form import checked_form
from core.printable import printable
from core.untrusted.json_text import read_json
from core.untrusted.values import LONGEST_NAME, numbers, shown, text_of
from core.whole_file import write_whole

FORMAT = "phalanx-prop"
VERSION = 1

Shape = Literal["cylinder", "sphere", "box", "none"]
SHAPES: tuple[Shape, ...] = get_args(Shape)
N_LENGTHS: dict[Shape, int] = {"cylinder": 2, "sphere": 1, "box": 3, "none": 0}

MOST_PROPS = 100
"""Of a profile."""

LEAST_MARKERS, MOST_MARKERS = 3, 16
LEAST_DISTANCE_M = 0.004
"""Markers nearer to each other merge in the images."""

LEAST_WIDTH_M = 0.004
"""Markers that all lie nearer to one line (root mean square) do not show how the prop is turned about it."""

FARTHEST_M = 2.0


@dataclass(frozen=True)
class PropModel:
    """What a prop looks like: a cylinder of (diameter, length) along z, a sphere of (diameter,), a box of its edges
    along (x, y, z), all [m]; or "none": only its markers are known."""

    shape: Shape = "none"
    size_m: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class Prop:
    """A rigid set of markers.

    markers_m: (m, 3) float64 [m] in the prop's frame, 3 to 16 of them. home: (3, 3) float64, how it lay in the world
    when it was defined: settles which side is seen first of a prop that looks the same from several. None: unknown.
    """

    name: str
    markers_m: FloatArray
    model: PropModel = field(default_factory=PropModel)
    home: FloatArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", printable(self.name))

    @property
    def marker_names(self) -> tuple[str, ...]:
        """The prop's name and a number from 1 on."""
        return tuple(f"{self.name}{i + 1}" for i in range(len(self.markers_m)))

    def placed_m(self, transform_world: FloatArray) -> FloatArray:
        """(m, 3) float64 [m]: the markers in the world. transform_world: (4, 4)."""
        placed: FloatArray = self.markers_m @ transform_world[:3, :3].T + transform_world[:3, 3]
        return placed

    def to_dict(self) -> dict[str, Any]:
        """The JSON form; positions to the micrometre."""
        written: dict[str, Any] = {
            "format": FORMAT,
            "version": VERSION,
            "name": self.name,
            "model": {"shape": self.model.shape, "size_m": [round(length, 6) for length in self.model.size_m]},
            "markers_m": np.round(self.markers_m, 6).tolist(),
        }
        if self.home is not None:
            quaternion = Rotation.from_matrix(self.home).as_quat(scalar_first=True, canonical=True)
            written["home_wxyz"] = np.round(quaternion, 6).tolist()
        return written

    @classmethod
    def from_dict(cls, data: Any, source: str = "Prop") -> Prop:
        """Raises FormatError naming `source` and the offending value."""
        data = checked_form(data, source, FORMAT, (VERSION,), "prop", "define the prop again")
        name = text_of(data, "name", source, most=LONGEST_NAME)
        if not name.strip():
            raise FormatError(f"{source}: name {name!r}.", "Give the prop a name.")
        try:
            markers = numbers(data.get("markers_m"), -1, 3)
        except ValueError as error:
            raise FormatError(f"{source}: its markers_m cannot be read: {error}.", "List [x, y, z] of each.") from error
        check_markers(markers, f"{source} ({name})")
        return cls(name, markers, _model(data.get("model"), f"{source} ({name})"), _home(data, f"{source} ({name})"))


def check_markers(markers_m: FloatArray, source: str) -> None:
    """Raises FormatError for markers from which a pose could not be told."""
    if markers_m.ndim != 2 or markers_m.shape[1] != 3 or not LEAST_MARKERS <= len(markers_m) <= MOST_MARKERS:
        raise FormatError(
            f"{source}: markers of shape {'x'.join(map(str, markers_m.shape))}.",
            f"Give {LEAST_MARKERS} to {MOST_MARKERS} markers of three coordinates each.",
        )
    if not np.isfinite(markers_m).all() or np.abs(markers_m).max() > FARTHEST_M:
        raise FormatError(f"{source}: a marker lies further than {FARTHEST_M:g} m from the prop.", "Define it again.")
    apart = np.linalg.norm(markers_m[:, None] - markers_m[None], axis=2) + np.diag(np.full(len(markers_m), np.inf))
    if apart.min() < LEAST_DISTANCE_M:
        a, b = np.unravel_index(int(apart.argmin()), apart.shape)
        raise FormatError(
            f"{source}: markers {a + 1} and {b + 1} are {apart.min() * 1e3:.1f} mm apart.",
            f"Keep {LEAST_DISTANCE_M * 1e3:g} mm between any two; was one marker given twice?",
        )
    width_m = np.linalg.svd(markers_m - markers_m.mean(axis=0), compute_uv=False)[1] / np.sqrt(len(markers_m))
    if width_m < LEAST_WIDTH_M:
        raise FormatError(
            f"{source}: its markers lie within {width_m * 1e3:.1f} mm of one line.",
            "Set one marker further aside: how the prop is turned could not be seen.",
        )


def load_prop(path: str | Path) -> Prop:
    """A prop file. Raises FormatError."""
    source = f"Prop file {path}"
    data = read_json(Path(path), source, "Choose a prop file, or make one with phalanx prop define.")
    return Prop.from_dict(data, source)


def save_prop(prop: Prop, path: Path) -> None:
    """Writes a prop file, in the place of an older one only when it is whole. Raises FormatError."""
    write_whole(path, json.dumps(prop.to_dict(), indent=2, ensure_ascii=False) + "\n", "Prop")


def props_from(data: Any, source: str) -> tuple[Prop, ...]:
    """The props of a profile. Raises FormatError, also where two have one name."""
    if not isinstance(data, list) or len(data) > MOST_PROPS:
        raise FormatError(f"{source} {shown(data)}.", f"List up to {MOST_PROPS} props, or leave them out.")
    props = tuple(Prop.from_dict(entry, f"{source}, {i + 1}") for i, entry in enumerate(data))
    for i, prop in enumerate(props):
        if any(prop.name == other.name for other in props[:i]):
            raise FormatError(f"{source}: {prop.name!r} stands there twice.", "Give every prop its own name.")
    return props


def _model(data: Any, source: str) -> PropModel:
    shape, size = (data.get("shape"), data.get("size_m", [])) if isinstance(data, dict) else (None, [])
    if shape not in SHAPES:
        raise FormatError(f"{source}: model {shown(data)}.", "Its shape must be one of " + ", ".join(SHAPES) + ".")
    try:
        lengths = tuple(numbers(size, N_LENGTHS[shape]).tolist())
    except ValueError:
        lengths = (-1.0,)
    if not all(0.0 < length <= FARTHEST_M for length in lengths):
        raise FormatError(
            f"{source}: size_m {shown(size)} of a {shape}.",
            f"It takes {N_LENGTHS[shape]} lengths above 0 and up to {FARTHEST_M:g} m.",
        )
    return PropModel(shape, lengths)


def _home(data: dict[str, Any], source: str) -> FloatArray | None:
    quaternion = data.get("home_wxyz")
    if quaternion is None:
        return None
    try:
        values = numbers(quaternion, 4)
    except ValueError:
        values = np.zeros(4)
    if np.abs(values).max() > 2.0 or abs(float(np.linalg.norm(values)) - 1.0) > 1e-3:
        raise FormatError(f"{source}: home_wxyz {shown(quaternion)}.", "Give a unit quaternion, or leave it out.")
    matrix: FloatArray = Rotation.from_quat(values, scalar_first=True).as_matrix()
    return matrix
