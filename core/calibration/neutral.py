"""The zero of each joint angle, from a trial in which the hand was held flat, or at angles that a goniometer read.

A laboratory counts angles from a neutral stance. Where a marker sits and how long a bone is turns a joint's angle by a
constant, of which the deviation says nothing; the angle that was tracked in a known stance tells it. An angle is
reported as it was tracked less its zero. That is all a zero does: the engine, the skeleton and whatever moves by them
(joints.csv, BVH, glTF) know none.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from core.errors import FormatError
from core.frames import SIDES, BoolArray, FloatArray, Side
from core.hand.skeleton import DIGIT_DOF_NAMES, N_ROOT_DOFS
from core.untrusted.values import is_number, shown

LARGEST_RAD = math.pi
_DECIMALS = 9
_LONGEST = 1000  # characters of a text
_AGAIN = 'Take "neutral" out of the file, and calibrate it again (phalanx calibrate neutral).'


@dataclass(frozen=True)
class NeutralHand:
    """One hand's zeros.

    zero_rad: (20,) float64 [rad], what is taken off each digit angle: as it was tracked less as it was given.
    std_rad: (20,) float64 [rad], one standard deviation of each zero, by how well the joint was held. given_rad:
    (20,) float64 [rad], at what each was held, 0 where nothing was said. hidden: names of the angles of which the
    trial told nothing, for their markers were hidden: their zeros are those of before, or 0 with deviation 0.
    source: name of the recording. from_s, to_s: the stretch in it, in seconds from its first frame. date: when it
    was calibrated, ISO 8601. prior: names of the angles that posture statistics told in the trial, and not the
    markers: their zeros are 0, with deviation 0.
    """

    zero_rad: FloatArray
    std_rad: FloatArray
    given_rad: FloatArray
    hidden: tuple[str, ...]
    source: str
    from_s: float
    to_s: float
    date: str
    prior: tuple[str, ...] = ()

    @property
    def told(self) -> BoolArray:
        """(20,) bool, the angles whose zero is of this trial."""
        return np.array([name not in self.hidden and name not in self.prior for name in DIGIT_DOF_NAMES])

    @property
    def words(self) -> str:
        """'the neutral trial of flat.c3d, 2.0 to 4.0 s'."""
        return f"the neutral trial of {self.source}, {self.from_s:.1f} to {self.to_s:.1f} s"

    def to_dict(self) -> dict[str, Any]:
        """The JSON form."""
        return {
            "source": self.source, "from_s": self.from_s, "to_s": self.to_s, "date": self.date,
            "zero_rad": _named(self.zero_rad), "std_rad": _named(self.std_rad), "given_rad": _named(self.given_rad),
            "hidden": list(self.hidden), "prior": list(self.prior),
        }  # fmt: skip

    @classmethod
    def from_dict(cls, data: Any, source: str) -> NeutralHand:
        """Raises FormatError naming `source` and the offending value."""
        if not isinstance(data, dict):
            raise FormatError(f"{source} is {shown(data)}, not an object.", _AGAIN)
        from_s, to_s = (_number(data.get(key), f"{source}: {key}", 0.0, math.inf) for key in ("from_s", "to_s"))
        if to_s < from_s:
            raise FormatError(f"{source} ends at {to_s:g} s, before it begins at {from_s:g} s.", _AGAIN)
        return cls(
            _angles(data.get("zero_rad"), f"{source}: zero_rad", -LARGEST_RAD),
            _angles(data.get("std_rad"), f"{source}: std_rad", 0.0),
            _angles(data.get("given_rad"), f"{source}: given_rad", -LARGEST_RAD),
            _names(data.get("hidden", []), f"{source}: hidden"),
            _text(data.get("source"), f"{source}: source"),
            from_s,
            to_s,
            _text(data.get("date"), f"{source}: date"),
            _names(data.get("prior", []), f"{source}: prior"),
        )


@dataclass(frozen=True)
class Neutral:
    """A performer's zeros: each hand has its own, and perhaps from a trial of its own. hands: at least one."""

    hands: Mapping[Side, NeutralHand]

    def reported(self, side: Side, theta_rad: FloatArray, theta_std: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Parameters of one hand as they are reported, and their deviations.

        theta_rad, theta_std: (..., 26) as in a HandFrame; not written to. An angle is less by its zero, its variance
        more by the zero's. The wrist's six have no zero. Without a trial of this hand both come back as they are.
        """
        hand = self.hands.get(side)
        if hand is None:
            return theta_rad, theta_std
        angles, stds = theta_rad.copy(), theta_std.copy()
        angles[..., N_ROOT_DOFS:] -= hand.zero_rad
        stds[..., N_ROOT_DOFS:] = np.hypot(stds[..., N_ROOT_DOFS:], hand.std_rad)
        return angles, stds

    def words(self, sides: Iterable[Side]) -> str:
        """Where the angles of these hands count from: 'angles from the neutral trial of flat.c3d, 2.0 to 4.0 s'; where
        that differs between them, of each that has a trial; '' where none has."""
        asked = [side for side in SIDES if side in sides]
        told = [self.hands[side].words if side in self.hands else "" for side in asked]
        if len(set(told)) == 1:
            return f"angles from {told[0]}" if told[0] else ""
        return ", ".join(f"{side} angles from {words}" for side, words in zip(asked, told, strict=True) if words)

    def to_dict(self) -> dict[str, Any]:
        """The JSON form: of each hand that has zeros."""
        return {side: self.hands[side].to_dict() for side in SIDES if side in self.hands}

    @classmethod
    def from_dict(cls, data: Any, source: str = "neutral trial") -> Neutral:
        """Raises FormatError naming `source` and the offending value."""
        if not isinstance(data, dict) or not data or any(side not in SIDES for side in data):
            raise FormatError(f"{source} {shown(data)}.", f'It must hold "left", "right" or both. {_AGAIN}')
        return cls({side: NeutralHand.from_dict(data[side], f"{source}: {side}") for side in SIDES if side in data})


def _named(angles: FloatArray) -> dict[str, float]:
    return {name: round(float(value), _DECIMALS) for name, value in zip(DIGIT_DOF_NAMES, angles, strict=True)}


def _angles(data: Any, source: str, least: float) -> FloatArray:
    """(20,) float64 [rad] by name."""
    if not isinstance(data, dict) or set(data) != set(DIGIT_DOF_NAMES):
        raise FormatError(f"{source} {shown(data)} must name all {len(DIGIT_DOF_NAMES)} angles.", _AGAIN)
    return np.array([_number(data[name], f"{source}: {name}", least, LARGEST_RAD) for name in DIGIT_DOF_NAMES])


def _names(data: Any, source: str) -> tuple[str, ...]:
    """Some of DIGIT_DOF_NAMES, in their order."""
    if not isinstance(data, list) or any(name not in DIGIT_DOF_NAMES for name in data):
        raise FormatError(f"{source} {shown(data)}.", f"It must list names of angles. {_AGAIN}")
    return tuple(name for name in DIGIT_DOF_NAMES if name in data)


def _number(value: Any, source: str, least: float, most: float) -> float:
    if not is_number(value) or not least <= value <= most:
        bound = f"between {least:.4g} and {most:.4g}" if math.isfinite(most) else f"{least:g} or more"
        raise FormatError(f"{source} {shown(value)} must be a number {bound}.", _AGAIN)
    return float(value)


def _text(value: Any, source: str) -> str:
    if not isinstance(value, str) or len(value) > _LONGEST:
        raise FormatError(f"{source} {shown(value)} must be a text of at most {_LONGEST:,} characters.", _AGAIN)
    return value
