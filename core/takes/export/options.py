"""What an export is asked for beside its formats."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from core.errors import ExportError
from core.takes.export.bone_names import BONE_SCHEMES

Up = Literal["y", "z"]

UNITS_M: dict[str, float] = {"mm": 0.001, "cm": 0.01, "m": 1.0}
"""Units of length that files of markers and BVH can be written in, in metres."""

LEAST_RATE_HZ, MOST_RATE_HZ = 0.1, 100_000.0


@dataclass(frozen=True)
class ExportOptions:
    """The same for all formats; one that cannot follow an option says so.

    joints: C3D and TRC also hold the joint centres and fingertips. measured: files of markers hold no prediction.
    up: the axis of the file that points up; with "z" x, y, z of a file are x, -z, y of the world. unit: of length,
    one of UNITS_M; None for what is usual in each format. rate_hz: frames are put on an even grid of this rate; None
    for the recording's own. from_s, to_s: the part to write, both ends included, counted as `time_s` elsewhere [s].
    bones: what BVH and glTF call the joints, one of BONE_SCHEMES. neutral: angles.csv counts from the zeros of the
    profile's neutral trial, where it has one; else angles are as they were tracked.
    """

    joints: bool = False
    measured: bool = False
    up: Up = "y"
    unit: str | None = None
    rate_hz: float | None = None
    from_s: float | None = None
    to_s: float | None = None
    bones: str = "phalanx"
    neutral: bool = True

    def __post_init__(self) -> None:
        """Raises ExportError for what cannot be asked for."""
        if self.up not in ("y", "z"):
            raise ExportError(f"{self.up!r} is no axis to point up.", "Choose y or z.")
        if self.unit is not None and self.unit not in UNITS_M:
            raise ExportError(f"{self.unit!r} is no unit of length here.", f"Choose of {', '.join(UNITS_M)}.")
        if self.rate_hz is not None and not LEAST_RATE_HZ <= self.rate_hz <= MOST_RATE_HZ:
            raise ExportError(
                f"{self.rate_hz:g} Hz is no rate to export at.", f"Choose {LEAST_RATE_HZ:g} to {MOST_RATE_HZ:g} Hz."
            )
        if self.bones not in BONE_SCHEMES:
            raise ExportError(f"{self.bones!r} is no way to name bones.", f"Choose of {', '.join(BONE_SCHEMES)}.")
        for value in (self.from_s, self.to_s):
            if value is not None and not math.isfinite(value):
                raise ExportError(f"{value} s is no time.", "Give seconds from the first frame.")
        if self.from_s is not None and self.to_s is not None and self.to_s < self.from_s:
            raise ExportError(
                f"The part to export would end, at {self.to_s:g} s, before it begins, at {self.from_s:g} s.",
                "Give a later end.",
            )


DEFAULT = ExportOptions()
