"""What a layout can tell of a hand while all of its markers are seen, and what it cannot tell apart.

For each angle, over the library of poses: in how many of them the points decide it (core.sources, the same measure as
for every value of a recording), and how closely points of 1 mm tell it by themselves. In words it is said which angles
posture statistics stand in for, and why.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from core.cast import Cast
from core.frames import FloatArray
from core.hand.skeleton import DIGIT_DOF_NAMES, DIGITS, DOF_JOINTS, DOF_NAMES, JOINT_NAMES, N_ROOT_DOFS
from core.kinematics.prior import NOISE_M
from core.kinematics.solver import HandPose
from core.markers.layout import MarkerLayout
from core.motion.library import LIBRARY
from core.profile import Profile
from core.sources import Information
from core.track import tracking_solver
from core.words import listed

MEASURED_IN, STATISTICS_BELOW = 0.9, 0.5
"""An angle counts as measured if the points decide it in this share of usual postures or more, as posture statistics
if in less than that share, and else as measured in part."""

ACROSS_M = 0.005
"""Markers on the back that lie within this of one line (root mean square) do not tell how it turns about the line."""

_FINGER = {"thumb": "thumb", "pinky": "little finger"}
_NUMBERS = ("no", "one", "two", "three", "four", "five", "six")


@dataclass(frozen=True)
class AngleTold:
    """One of DOF_NAMES.

    share: of usual postures in which the points decide it, 0..1. std: one standard deviation [m for the wrist's place,
    else rad] by points of 1 mm alone, all else anywhere within the joint limits; median over the postures.
    """

    name: str
    share: float
    std: float

    @property
    def measured(self) -> bool:
        """In nearly every posture."""
        return self.share >= MEASURED_IN

    @property
    def statistics(self) -> bool:
        """In most postures."""
        return self.share < STATISTICS_BELOW


@dataclass(frozen=True)
class Observability:
    """angles: all 26, in the order of DOF_NAMES. words: sentences on what is not measured in every posture; () where
    everything is."""

    angles: tuple[AngleTold, ...]
    words: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """The JSON form."""
        return {
            "angles": {angle.name: {"measured_in": angle.share, "std_at_1_mm": angle.std} for angle in self.angles},
            "words": list(self.words),
        }


def observability(profile: Profile) -> Observability:
    """Of a layout as this performer wears it."""
    solver = tracking_solver(profile)
    information, seen = Information(solver), np.ones(len(profile.layout.joints), dtype=np.bool_)
    decided, stds = [], []
    pose = HandPose.at_rest(len(seen))
    for usual in LIBRARY.values():
        pose.theta_rad[N_ROOT_DOFS:] = np.clip(usual.angles_rad, *solver.skeleton.limits_rad.T)
        solver.place(pose)
        decided.append(information.measured(pose, seen))
        stds.append(information.told(pose, seen, NOISE_M))
    share, std = np.mean(decided, axis=0), np.median(stds, axis=0)
    angles = tuple(map(AngleTold, DOF_NAMES, share.tolist(), std.tolist()))
    layout = profile.worn
    return Observability(angles, (*_wrist_words(angles[:N_ROOT_DOFS], layout), *_digit_words(angles, layout)))


def not_told(cast: Cast) -> tuple[str, ...]:
    """What the layouts of a cast cannot tell apart, each once, with the layout's name: 'schroeder6: IP of ...'."""
    return tuple(
        dict.fromkeys(f"{profile.layout.name}: {words}" for profile in cast for words in observability(profile).words)
    )


def _wrist_words(wrist: Sequence[AngleTold], layout: MarkerLayout) -> list[str]:
    back_m = layout.positions_m[layout.joints == 0]
    least = min(angle.share for angle in wrist)
    if _spread(back_m) > ACROSS_M and least >= MEASURED_IN:
        return []
    has = f"The back of the hand has {_NUMBERS[min(len(back_m), 6)]} marker{'s' * (len(back_m) != 1)}"
    if len(back_m) >= 3:
        has += " on one line"
    said = "" if least >= MEASURED_IN else f", in {_percent([least])} of usual postures by the points alone"
    return [f"{has}: how the wrist turns is told with the help of the digits' markers{said}."]


def _spread(points_m: FloatArray) -> float:
    """How far points (n, 3) lie off the line that fits them best: root mean square [m]; 0 below three."""
    if len(points_m) < 3:
        return 0.0
    off: FloatArray = np.linalg.svd(points_m - points_m.mean(axis=0), compute_uv=False)[1:]
    return float(np.linalg.norm(off) / np.sqrt(len(points_m)))


def _digit_words(angles: Sequence[AngleTold], layout: MarkerLayout) -> list[str]:
    """Digits of which the same is to be said share a sentence."""
    said: dict[tuple[tuple[str, ...], bool, str], dict[str, list[float]]] = {}
    for g, digit in enumerate(DIGITS):
        own = angles[N_ROOT_DOFS + 4 * g : N_ROOT_DOFS + 4 * g + 4]
        bones = layout.joints[(layout.joints - 1) // 3 == g]
        for statistics in (True, False):
            by_reason: dict[str, list[AngleTold]] = {}
            for angle in own:
                if not angle.measured and angle.statistics == statistics:
                    by_reason.setdefault(_reason(angle.name, bones.tolist()), []).append(angle)
            for reason, group in by_reason.items():
                key = (tuple(_short(angle.name) for angle in group), statistics, reason)
                said.setdefault(key, {})[digit] = [angle.share for angle in group]
    return [_sentence(*key, digits) for key, digits in said.items()]


def _reason(name: str, bones: list[int]) -> str:
    """Why points that are all seen do not tell an angle. bones: the joints whose bones carry the digit's markers."""
    joint = DOF_JOINTS[DIGIT_DOF_NAMES.index(name)]
    first = joint - (joint - 1) % 3
    beyond = [bone for bone in bones if bone >= joint]
    if not beyond:
        return "no marker moves with {it}"
    if 3 * len(bones) < 4:
        return f"{_NUMBERS[3 * len(bones)]} coordinates, four angles"
    nearest, before = min(beyond), max((bone for bone in bones if bone < joint), default=first - 1)
    if nearest - before > 1 and beyond.count(nearest) == 1:
        between = [JOINT_NAMES[k].split("_")[1].upper() for k in range(before + 1, nearest + 1)]
        return f"one marker tells {listed(between)}"
    return "markers sit close to the joints"


def _sentence(names: tuple[str, ...], statistics: bool, reason: str, digits: dict[str, list[float]]) -> str:
    one = len(names) == 1 and len(digits) == 1
    what = "All four angles" if len(names) == 4 else "MCP flexion" if names == ("MCP",) else listed(names)
    of = f"{what} of the {_of(digits)} {'is' if len(names) == 1 else 'are'} "
    why = ": " + reason.format(it="it" if one else "them") if reason else ""
    if statistics:
        return f"{of}posture statistics{why}."
    shares = [share for each in digits.values() for share in each]
    return f"{of}measured in {_percent(shares)} of usual postures, posture statistics in the others{why}."


def _short(name: str) -> str:
    """'MCP' of a flexion, 'MCP abduction'; of the thumb's CMC, 'CMC flexion'."""
    _, joint, motion = name.split("_")
    return joint.upper() if motion == "flexion" and joint != "cmc" else f"{joint.upper()} {motion}"


def _of(digits: Iterable[str]) -> str:
    """'thumb', 'ring finger', 'index, ring and little fingers'."""
    names = [_FINGER.get(digit, f"{digit} finger") for digit in digits]
    fingers = [name for name in names if name != "thumb"]
    if len(fingers) > 1:
        names = [name.removesuffix(" finger") for name in names]
        names[-1] += " fingers"
    return listed(names)


def _percent(shares: Sequence[float]) -> str:
    low, high = round(100.0 * min(shares)), round(100.0 * max(shares))
    return f"{low} %" if low == high else f"{low} to {high} %"
