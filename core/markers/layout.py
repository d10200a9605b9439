"""Marker layouts: where markers sit on the hand.

A layout is a small JSON file, in resources/layouts or of a user's own:

    {"format": "phalanx-layout", "version": 1, "name": "han19", "description": "...", "sides": ["left", "right"],
     "markers": [{"name": "ThumbCMC", "joint": "thumb_cmc", "position_m": [x, y, z]}, ...]}

`position_m` is the marker's centre on a right hand of scale 1 at rest, in the hand frame (core.hand.skeleton);
`joint` is the joint whose bone carries it.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from core.errors import FormatError
from core.frames import SIDES, FloatArray, IntArray, Side
from core.hand.skeleton import JOINT_NAMES
from core.json_form import checked_form
from core.printable import MOST_OF_TEXT, printable
from core.untrusted.json_text import parse_json, read_json
from core.untrusted.values import LONGEST_NAME, numbers, shown, sides_of, text_of

FORMAT = "phalanx-layout"
VERSION = 1
MAX_MARKERS = 64

ALONG_M, NORMAL_M = 0.006, 0.003
"""Standard deviation of a marker's place along the surface and along its normal: markers are put on by eye, but how
high one stands is known."""


@dataclass(frozen=True)
class MarkerLayout:
    """Markers on a right hand of scale 1.

    joints: (m,) int64, index of the joint that carries each marker.
    positions_m: (m, 3) float64 [m], at rest in the hand frame.
    sides: the hands for which this set exists (a single glove has one).
    """

    name: str
    description: str
    sides: tuple[Side, ...]
    marker_names: tuple[str, ...]
    joints: IntArray
    positions_m: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", printable(self.name))
        object.__setattr__(self, "description", printable(self.description, MOST_OF_TEXT))
        object.__setattr__(self, "marker_names", tuple(map(printable, self.marker_names)))

    def to_dict(self) -> dict[str, Any]:
        """The JSON form of this layout."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "name": self.name,
            "description": self.description,
            "sides": list(self.sides),
            "markers": [
                {"name": name, "joint": JOINT_NAMES[joint], "position_m": [round(float(v), 6) for v in position]}
                for name, joint, position in zip(self.marker_names, self.joints, self.positions_m, strict=True)
            ],
        }

    @classmethod
    def from_dict(cls, data: Any, source: str = "layout") -> MarkerLayout:
        """Raises FormatError naming `source` and the offending value."""
        data = checked_form(data, source, FORMAT, (VERSION,), "marker layout", "save the layout again")
        markers = data.get("markers")
        if not isinstance(markers, list) or not 1 <= len(markers) <= MAX_MARKERS:
            raise FormatError(f"{source} must list 1 to {MAX_MARKERS} markers.")
        names: list[str] = []
        joints: list[int] = []
        positions = np.empty((len(markers), 3))
        for i, marker in enumerate(markers):
            try:
                if marker["joint"] not in JOINT_NAMES:
                    raise ValueError(f"{shown(marker['joint'])} is no joint")
                joint = JOINT_NAMES.index(marker["joint"])
                positions[i] = numbers(marker["position_m"], 3)
                name = text_of(marker, "name", f"{source}: marker {i + 1}", most=LONGEST_NAME)
            except (TypeError, KeyError, ValueError) as error:
                words = f"it has no {error}" if isinstance(error, KeyError) else str(error)
                raise FormatError(
                    f"{source}: marker {i + 1} cannot be read ({words}): {shown(marker)}.",
                    "Each needs a name, a joint of " + ", ".join(JOINT_NAMES) + ", and position_m [x, y, z].",
                ) from error
            if name in names or np.abs(positions[i]).max() > 1.0:
                raise FormatError(
                    f"{source}: marker {name!r} at {positions[i].tolist()} m.",
                    "Names must differ and positions lie within 1 m of the wrist.",
                )
            names.append(name)
            joints.append(joint)
        return cls(
            text_of(data, "name", source, source),
            text_of(data, "description", source, ""),
            sides_of(data.get("sides", SIDES), source),
            tuple(names),
            np.asarray(joints, dtype=np.int64),
            positions,
        )


def layout_names() -> tuple[str, ...]:
    """Names of the layouts shipped with Phalanx."""
    return tuple(sorted(f.name[:-5] for f in (files("resources") / "layouts").iterdir() if f.name.endswith(".json")))


def is_shipped(layout: MarkerLayout) -> bool:
    """Does every marker sit where the shipped layout of this name has it?"""
    if layout.name not in layout_names():
        return False
    shipped = load_layout(layout.name)
    return layout.marker_names == shipped.marker_names and np.array_equal(layout.positions_m, shipped.positions_m)


def load_layout(name_or_path: str | Path) -> MarkerLayout:
    """A shipped layout by name, or a user's own file. Raises FormatError."""
    if str(name_or_path) in layout_names():
        text = (files("resources") / "layouts" / f"{name_or_path}.json").read_text(encoding="utf-8")
        source = f"Layout {name_or_path}"
        return MarkerLayout.from_dict(parse_json(text, source, "Install Phalanx again."), source)
    source = f"Layout file {name_or_path}"
    mend = "Choose a layout file, or one of Phalanx: " + ", ".join(layout_names()) + "."
    return MarkerLayout.from_dict(read_json(Path(name_or_path), source, mend), source)
