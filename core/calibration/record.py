"""What a profile keeps of its calibration: from which seconds of what it was made, when, and how well it is known."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import date
from typing import Any

from core.calibration.fixed import FixedCovariance
from core.errors import FormatError
from core.untrusted.values import is_number, shown

MOST_LINES = 64
MOST_CHARACTERS = 10_000
"""Of the name of a file, or of a sentence on what was not seen: it may name every marker of the largest layout."""

_MEND = "Calibrate again with phalanx calibrate hand."


@dataclass(frozen=True)
class Calibrated:
    """covariance: of the profile's shape and markers, as the calibration left them.

    noise_m: standard deviation of one coordinate of a point about the model [m]. independent: how many keyframes with
    errors of their own would tell as much as these (core.calibration.alike). key_rms_m, held_out_rms_m: residual
    RMS on the keyframes and on frames not used [m], None where there were none. not_seen: what the recording did not
    tell, in sentences. sources: names of the recordings' files; from_s, to_s: which seconds of them; made_on: ISO date,
    such as 2026-05-31. () and None where nobody said.
    """

    covariance: FixedCovariance
    noise_m: float
    keyframes: int
    independent: float
    key_rms_m: float | None
    held_out_rms_m: float | None
    not_seen: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()
    from_s: float | None = None
    to_s: float | None = None
    made_on: str | None = None

    def to_dict(self, marker_names: tuple[str, ...]) -> dict[str, Any]:
        """The JSON form. marker_names: of the profile's layout."""
        return {
            "sources": list(self.sources),
            "from_s": self.from_s,
            "to_s": self.to_s,
            "date": self.made_on,
            "keyframes": self.keyframes,
            "independent_keyframes": self.independent,
            "noise_m": self.noise_m,
            "rms_m": {"keyframes": self.key_rms_m, "frames_not_used": self.held_out_rms_m},
            "not_seen": list(self.not_seen),
            **self.covariance.to_dict(marker_names),
        }

    @classmethod
    def from_dict(cls, data: Any, marker_names: tuple[str, ...], source: str) -> Calibrated:
        """Raises FormatError naming `source` and the offending value."""
        if not isinstance(data, dict):
            raise FormatError(f"{source} is {shown(data)}.", _MEND)
        rms = data.get("rms_m")
        if not isinstance(rms, dict):
            raise FormatError(f"{source}: rms_m {shown(rms)}.", _MEND)
        keyframes = data.get("keyframes")
        if isinstance(keyframes, bool) or not isinstance(keyframes, int) or not 1 <= keyframes <= 1_000_000:
            raise FormatError(f"{source}: keyframes {shown(keyframes)}.", _MEND)
        noise_m = _number(data, "noise_m", 1.0, source)
        independent = _number(data, "independent_keyframes", 1e6, source)
        if noise_m is None or independent is None:
            raise FormatError(f"{source}: noise_m {noise_m}, independent_keyframes {independent}.", _MEND)
        made_on = data.get("date")
        if made_on is not None:
            try:
                date.fromisoformat(made_on)
            except (TypeError, ValueError) as error:
                raise FormatError(f"{source}: date {shown(made_on)}.", "Write it as 2026-05-31.") from error
        return cls(
            FixedCovariance.from_dict(data, marker_names, source),
            noise_m,
            keyframes,
            independent,
            _number(rms, "keyframes", 1.0, source),
            _number(rms, "frames_not_used", 1.0, source),
            _lines(data, "not_seen", source),
            _lines(data, "sources", source),
            _number(data, "from_s", 1e9, source),
            _number(data, "to_s", 1e9, source),
            made_on,
        )


def _number(data: dict[str, Any], name: str, most: float, source: str) -> float | None:
    """0 to `most`, or None. Raises FormatError."""
    value = data.get(name)
    if value is None:
        return None
    if not is_number(value) or not 0.0 <= value <= most:
        raise FormatError(f"{source}: {name} {shown(value)}.", f"It must lie between 0 and {most:g}. {_MEND}")
    return float(value)


def _lines(data: dict[str, Any], name: str, source: str) -> tuple[str, ...]:
    """Short texts. Raises FormatError."""
    lines = data.get(name, [])
    if (
        not isinstance(lines, list)
        or len(lines) > MOST_LINES
        or any(not isinstance(line, str) or len(line) > MOST_CHARACTERS for line in lines)
    ):
        raise FormatError(
            f"{source}: {name} must list at most {MOST_LINES} texts of {MOST_CHARACTERS} characters.", _MEND
        )
    return tuple(lines)


def finite(value: float) -> float | None:
    """A figure for a file, which knows no NaN."""
    return float(value) if math.isfinite(value) else None
