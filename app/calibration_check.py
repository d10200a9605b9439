"""`phalanx calibrate hand --check`: the same hand from other seconds, and what that makes of its angles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from core.errors import FormatError
from core.hand.skeleton import DIGIT_DOF_NAMES

if TYPE_CHECKING:
    from core.calibration.retest import Retest
    from core.frames import FloatArray

LEAST_S = 2.0
"""A stretch shorter than this shows no finger whole."""


@dataclass(frozen=True)
class Stretches:
    """Seconds [begin, end) of a recording that two calibrations are made from.

    halves: the first is not the calibration asked for, but the first half of its seconds.
    """

    first: tuple[float, float]
    second: tuple[float, float]
    halves: bool

    @property
    def words(self) -> str:
        """What is compared with what."""
        one, other = (f"{begin:.1f} to {end:.1f} s" for begin, end in (self.first, self.second))
        return f"two halves, {one} and {other}" if self.halves else f"{one} and {other}"


def stretches(first: tuple[float, float], check_s: float, span_s: float) -> Stretches:
    """The seconds that were calibrated from, and as many as are asked for that do not overlap them: those right after,
    or else those right before, or else the two halves of the first. span_s: of the recording.

    Raises FormatError if what is asked for is too short for anything.
    """
    begin, end = first[0], min(first[1], span_s)
    if check_s < LEAST_S or end - begin < 2.0 * LEAST_S:
        raise FormatError(
            f"--check {check_s:g} with a calibration from {end - begin:.1f} s.",
            f"Check with {LEAST_S:g} s or more, and calibrate from at least {2.0 * LEAST_S:g} s.",
        )
    if end + check_s <= span_s:
        return Stretches((begin, end), (end, end + check_s), halves=False)
    if begin >= check_s:
        return Stretches((begin, end), (begin - check_s, begin), halves=False)
    middle = 0.5 * (begin + end)
    return Stretches((begin, middle), (middle, end), halves=True)


def print_retest(compared: Stretches, found: Retest) -> None:
    """A line per angle, in degrees."""
    print(f"\nTest and retest: calibrated from {compared.words}; angles of {found.hands:,} hands solved with both")
    print("                              differ [degrees]   stated std [degrees]   within")
    print("                              mean        most       test    retest   two std")
    rows = zip(*_degrees(found), found.within, strict=True)
    for name, (mean, most, one, other, within) in zip(DIGIT_DOF_NAMES, rows, strict=True):
        print(f"  {name:24}{mean:9.1f}{most:12.1f}{one:11.1f}{other:10.1f}{100 * within:8.0f} %")
    mean, most, one, other = _degrees(found)
    print(
        f"  {'all':24}{mean.mean():9.1f}{most.max():12.1f}{_rms(one):11.1f}{_rms(other):10.1f}"
        f"{100 * found.within.mean():8.0f} %"
    )


def retest_figures(compared: Stretches, found: Retest) -> dict[str, Any]:
    """The same for --json."""
    return {
        "first_s": list(compared.first),
        "second_s": list(compared.second),
        "halves": compared.halves,
        "hands": found.hands,
        "within_two_std": float(found.within.mean()),
        "angles": {
            name: {
                "differ_mean_deg": mean,
                "differ_most_deg": most,
                "stated_test_deg": one,
                "stated_retest_deg": other,
                "within_two_std": within,
            }
            for name, mean, most, one, other, within in zip(
                DIGIT_DOF_NAMES, *(values.tolist() for values in (*_degrees(found), found.within)), strict=True
            )
        },
    }


def _degrees(found: Retest) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    one, other = found.stated_rad
    return np.degrees(found.mean_rad), np.degrees(found.most_rad), np.degrees(one), np.degrees(other)


def _rms(values: FloatArray) -> float:
    return math.sqrt(float(np.square(values).mean()))
