"""One performer and glove: what the engine must know before a take, saved with every take."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from core.calibration.neutral import Neutral
from core.calibration.record import Calibrated
from core.errors import FormatError
from core.frames import SIDES, Side
from core.hand.limits import JointLimits
from core.hand.model import HandModel, template
from core.hand.shape import HandShape, shaped_hand, shaped_points
from core.json_form import checked_form
from core.kinematics.kernels import LARGEST, SMALLEST
from core.markers.layout import FORMAT as LAYOUT_FORMAT
from core.markers.layout import MarkerLayout, layout_names, load_layout
from core.motion.subspace import Subspace, shipped_subspace, subspace_names
from core.printable import printable
from core.props.prop import Prop, props_from
from core.untrusted.json_text import parse_json, read_json
from core.untrusted.values import LONGEST_TEXT, is_number, shown, sides_of, text_of
from core.whole_file import write_whole

FORMAT = "phalanx-profile"
VERSION = 4
READABLE = (1, 2, 3, 4)
"""Version 1 knew neither shape nor subspace, version 2 no network, version 3 nothing of a calibration but its result,
neither neutral trial nor joint limits. A profile is written in the first version that holds all of it, from 2 on: there
an older Phalanx misses nothing."""


@dataclass(frozen=True)
class Profile:
    """A performer with a marker layout.

    layout: its markers on the template. sides: hands to look for. shape: the hand's proportions. scale: uniform size
    on top of the shape, None = found from the motion. subspace: how this performer's digits usually move together.
    props: rigid things with markers, each of its own name, that may be in the volume. network: file of the labelling
    network trained for this glove, None: the one shipped with Phalanx. Whether it can be run shows when it is loaded.
    neutral: where reported angles count from, None: as they are tracked. The engine knows nothing of it. limits: of
    joints that go further, or less far, than the template's. calibrated: what shape and layout were found from, and
    how well they are known; None if they were not found.
    """

    performer: str
    layout: MarkerLayout
    sides: tuple[Side, ...] = SIDES
    scale: float | None = None
    shape: HandShape = field(default_factory=HandShape.generic)
    subspace: Subspace = field(default_factory=lambda: shipped_subspace("generic"))
    props: tuple[Prop, ...] = ()
    network: str | None = None
    neutral: Neutral | None = None
    limits: JointLimits = field(default_factory=JointLimits)
    calibrated: Calibrated | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "performer", printable(self.performer))

    @cached_property
    def hand(self) -> HandModel:
        """The right hand in this shape and with these limits, at scale 1."""
        hand = shaped_hand(template(), self.shape)
        return replace(hand, skeleton=self.limits.on(hand.skeleton))

    @cached_property
    def worn(self) -> MarkerLayout:
        """The layout as it sits on `hand`."""
        layout = self.layout
        positions = shaped_points(template().skeleton, self.shape, layout.joints, layout.positions_m)
        return replace(layout, positions_m=positions)

    def to_dict(self) -> dict[str, Any]:
        """The JSON form of this profile."""
        written: dict[str, Any] = {
            "format": FORMAT,
            "version": self._version,
            "performer": self.performer,
            "sides": list(self.sides),
            "scale": self.scale,
            "shape": self.shape.to_dict(),
            "subspace": self.subspace.name if self._shipped_subspace else self.subspace.to_dict(),
            "layout": self.layout.to_dict(),
            "props": [prop.to_dict() for prop in self.props],
        }
        if self.network is not None:
            written["network"] = self.network
        if self.neutral is not None:
            written["neutral"] = self.neutral.to_dict()
        if self.limits:
            written["limits"] = self.limits.to_dict()
        if self.calibrated is not None:
            written["calibrated"] = self.calibrated.to_dict(self.layout.marker_names)
        return written

    @property
    def _version(self) -> int:
        """The oldest that holds all of it."""
        if self.neutral is not None or self.limits or self.calibrated is not None:
            return VERSION
        return 3 if self.network is not None else 2

    @property
    def _shipped_subspace(self) -> bool:
        return self.subspace.name in subspace_names() and self.subspace is shipped_subspace(self.subspace.name)

    def to_json(self) -> str:
        """Human-readable text of this profile, one file."""
        return json.dumps(self.to_dict(), indent=2, ensure_ascii=False) + "\n"

    def same_hands(self, other: Profile) -> bool:
        """Are the hands of both, and what they wear, the same to the bit? Names, sides, props, networks,
        neutral trials and how well the hands are known aside."""
        one, two = self.layout, other.layout
        mine, its = self.subspace, other.subspace
        return self is other or (
            self.scale == other.scale
            and self.limits == other.limits
            and (one.name, one.marker_names) == (two.name, two.marker_names)
            and np.array_equal(one.joints, two.joints)
            and np.array_equal(one.positions_m, two.positions_m)
            and np.array_equal(self.shape.ratios, other.shape.ratios)
            and np.array_equal(mine.mean_rad, its.mean_rad)
            and np.array_equal(mine.basis, its.basis)
            and np.array_equal(mine.std_rad, its.std_rad)
            and np.array_equal(mine.residual_std_rad, its.residual_std_rad)
        )

    def with_prop(self, prop: Prop) -> Profile:
        """The same performer with one prop more; one of the same name is replaced."""
        others = tuple(other for other in self.props if other.name != prop.name)
        return replace(self, props=(*others, prop))

    def with_hand(self, **parts: Any) -> Profile:
        """The same performer with another hand, glove or subspace, by the names of the fields. A neutral trial was of
        the one before, whose angles were off by other constants: it is gone. So is what a calibration found of another
        shape or glove."""
        same = parts.keys() <= {"performer", "subspace"}
        return replace(self, **{"neutral": None, "calibrated": self.calibrated if same else None, **parts})

    def with_sides(self, sides: tuple[Side, ...]) -> Profile:
        """The same performer, looking for other hands."""
        return replace(self, sides=sides)

    @classmethod
    def from_dict(cls, data: Any, source: str = "profile") -> Profile:
        """Raises FormatError naming `source` and the offending value."""
        data = checked_form(data, source, FORMAT, READABLE, "profile", "save the profile again")
        scale = data.get("scale")
        low, high = SMALLEST, LARGEST
        if scale is not None and not (is_number(scale) and low <= scale <= high):
            raise FormatError(
                f"{source}: hand scale {shown(scale)}.", f"It must lie between {low} and {high}, or be null."
            )
        sides = sides_of(data.get("sides"), source)
        layout = MarkerLayout.from_dict(data.get("layout"), f"{source}: its layout")
        calibrated = data.get("calibrated")
        return cls(
            text_of(data, "performer", source, ""),
            layout,
            sides,
            None if scale is None else float(scale),
            HandShape.generic()
            if data.get("shape") is None
            else HandShape.from_dict(data["shape"], f"{source}: shape"),
            _subspace(data.get("subspace", "generic"), f"{source}: its subspace"),
            props_from(data.get("props", []), f"{source}: its props"),
            _network(data.get("network"), source),
            None if data.get("neutral") is None else Neutral.from_dict(data["neutral"], f"{source}: its neutral trial"),
            JointLimits.from_dict(data.get("limits", {}), f"{source}: its limits"),
            None
            if calibrated is None
            else Calibrated.from_dict(calibrated, layout.marker_names, f"{source}: its calibration"),
        )

    @classmethod
    def from_json(cls, text: str, source: str = "profile") -> Profile:
        """Raises FormatError."""
        return cls.from_dict(parse_json(text, source, "Choose a profile file."), source)


def load_profile(name_or_path: str | Path) -> Profile:
    """A profile file, or a layout on a generic hand: the name of a shipped one or a file (as `--profile` takes).

    Raises FormatError.
    """
    if str(name_or_path) in layout_names():
        return _generic(load_layout(name_or_path))
    source = f"Profile {name_or_path}"
    mend = "Give a profile or layout file, or one of the layouts " + ", ".join(layout_names()) + "."
    data = read_json(Path(name_or_path), source, mend)
    if isinstance(data, dict) and data.get("format") == LAYOUT_FORMAT:
        return _generic(MarkerLayout.from_dict(data, f"Layout file {name_or_path}"))
    return Profile.from_dict(data, source)


def save_profile(profile: Profile, path: Path) -> None:
    """Writes a profile file, in the place of an older one only when it is whole. Raises FormatError."""
    write_whole(path, profile.to_json(), "Profile")


def _subspace(data: Any, source: str) -> Subspace:
    """A shipped one by name, or one written out. Raises FormatError."""
    if not isinstance(data, str):
        return Subspace.from_dict(data, source)
    if data not in subspace_names():
        names = ", ".join(subspace_names())
        raise FormatError(f"{source} {shown(data)} is not known here.", f"Shipped are: {names}.")
    return shipped_subspace(data)


def _network(data: Any, source: str) -> str | None:
    if data is not None and not (isinstance(data, str) and data.strip() and len(data) <= LONGEST_TEXT):
        raise FormatError(f"{source}: network {shown(data)}.", "Name an .onnx file, or leave it out.")
    return data


def _generic(layout: MarkerLayout) -> Profile:
    """Nobody in particular, with this layout on every hand for which it exists."""
    return Profile("", layout, layout.sides)
