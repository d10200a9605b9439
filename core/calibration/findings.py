"""What a calibration found, how well it fits, and what the recording could not tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.calibration.bundle import Bundle
from core.frames import FloatArray, IntArray
from core.hand.model import HandModel
from core.hand.shape import BONE_NAMES, FIRST_GIRTH, N_SHAPE, PALM_NAMES, SHAPE_NAMES, HandShape
from core.hand.skeleton import DIGITS
from core.words import listed

NOT_SEEN, HARDLY_SEEN = 0.15, 0.5
"""Share of the prior variance that the points took away, below which a measure counts as not seen, hardly seen."""


FAR_M = 0.020
"""A marker this far from where its layout has it is more likely another marker, or on another layout."""


@dataclass(frozen=True)
class Measure:
    """One measure of the hand. ratio: to the template's. std: relative standard deviation of what was found.

    seen: share of what was unknown of it that these points themselves told, 0..1; the rest is the population's.
    """

    name: str
    ratio: float
    std: float
    seen: float

    @property
    def words(self) -> str:
        """How far it can be trusted."""
        if self.seen < NOT_SEEN:
            return "not seen: as the population has it"
        return "hardly seen" if self.seen < HARDLY_SEEN else "seen"


@dataclass(frozen=True)
class MarkerPlace:
    """One marker. moved_m: (3,) on the template. std_m: of where it sits [m]. seen: as of a measure."""

    name: str
    moved_m: FloatArray
    std_m: float
    seen: float


@dataclass(frozen=True)
class Fit:
    """How well a hand explains points. rms_m (m,) [m] per marker, NaN where never seen; count (m,) observations."""

    rms_m: FloatArray
    count: IntArray

    @property
    def overall_m(self) -> float:
        """Over all observations [m]."""
        return self.over(np.arange(len(self.count)))

    def over(self, markers: IntArray) -> float:
        """Over the observations of some markers [m]; NaN if there are none."""
        count = self.count[markers]
        squares = float((count * np.nan_to_num(self.rms_m[markers]) ** 2).sum())
        return float(np.sqrt(squares / count.sum())) if count.any() else float("nan")

    def by_digit(self, joints: IntArray) -> dict[str, float]:
        """[m], of the palm and every digit that carries markers. joints: (m,) of the layout."""
        parts = np.where(joints > 0, (joints - 1) // 3 + 1, 0)
        return {
            name: self.over(np.flatnonzero(parts == part))
            for part, name in enumerate(("palm", *DIGITS))
            if (parts == part).any()
        }


@dataclass(frozen=True)
class Compared:
    """The same observations before and after."""

    before: Fit
    after: Fit
    shots: int


def measures(bundle: Bundle, information: FloatArray, shape: HandShape) -> list[Measure]:
    """Every measure of the hand. information: of core.calibration.posterior where the calibration ended."""
    found = np.sqrt(np.diag(np.linalg.inv(information))[:N_SHAPE])
    seen = _seen(bundle, information)[:N_SHAPE]
    return [
        Measure(name, float(ratio), float(std), float(share))
        for name, ratio, std, share in zip(SHAPE_NAMES, shape.ratios, found, seen, strict=True)
    ]


def marker_places(
    bundle: Bundle, covariance_m2: FloatArray, names: tuple[str, ...], moved_m: FloatArray
) -> list[MarkerPlace]:
    """Every marker, in the layout's order. covariance_m2: (3 m, 3 m) of their places on the template [m^2]."""
    variances = np.diag(covariance_m2).reshape(-1, 3).sum(axis=1)
    prior = np.trace(np.linalg.inv(bundle.priors.marker_precision_m), axis1=1, axis2=2)
    return [
        MarkerPlace(name, moved, float(np.sqrt(variance)), float(np.clip(1.0 - variance / known, 0.0, 1.0)))
        for name, moved, variance, known in zip(names, moved_m, variances, prior, strict=True)
    ]


def _seen(bundle: Bundle, information: FloatArray) -> FloatArray:
    """(s,), 1 - variance given the points / variance before, with a prior that lets nothing be told from the rest.

    The real prior knows that a long hand has long fingers; a bone without a marker would seem to have been seen.
    """
    prior = bundle.shared_prior()
    alone = np.diag(1.0 / np.diag(np.linalg.inv(prior)))
    after = np.diag(np.linalg.inv(information - prior + alone))
    seen: FloatArray = np.clip(1.0 - after * np.diag(alone), 0.0, 1.0)
    return seen


def lengths_m(template: HandModel) -> dict[str, float]:
    """[m], by name, the template's own length of each measure that is one: bones, and the palm from wrist and sides."""
    skeleton = template.skeleton
    joints = skeleton.joint_positions_m
    lengths = {"palm_width": float(np.ptp(joints[[4, 13], 0])), "palm_length": -float(joints[7, 2])}
    for digit, name in enumerate(DIGITS):
        chain = np.vstack([joints[1 + 3 * digit : 4 + 3 * digit], skeleton.tip_positions_m[digit]])
        for bone, length in zip(BONE_NAMES[digit > 0], np.linalg.norm(np.diff(chain, axis=0), axis=1), strict=True):
            lengths[f"{name}_{bone}"] = float(length)
    return lengths


def title(name: str) -> str:
    """`index_proximal` as "index proximal", `palm_width` as "palm width"."""
    return name.replace("_", " ")


def unseen_words(found: list[Measure]) -> list[str]:
    """What the recording did not tell, in sentences; empty if it told everything."""
    words = []
    palm = [m for m in found if m.name in PALM_NAMES and m.seen < NOT_SEEN]
    if palm:
        words.append(f"{listed([title(m.name) for m in palm]).capitalize()}: not seen by these markers.")
    bones = [m for m in found[len(PALM_NAMES) : FIRST_GIRTH] if m.seen < NOT_SEEN]
    for digit in DIGITS:
        parts = [m.name.partition("_")[2] for m in bones if m.name.startswith(f"{digit}_")]
        if parts:
            every = len(parts) == len(BONE_NAMES[digit != "thumb"])
            what = "length of its bones" if every else f"length of its {listed(parts)} bone{'s' * (len(parts) > 1)}"
            words.append(f"{digit.capitalize()}: {what} not seen in this motion.")
    girths = [m for m in found[FIRST_GIRTH:] if m.seen < NOT_SEEN]
    if girths:
        which = "All digits" if len(girths) == len(DIGITS) else listed([m.name.partition("_")[0] for m in girths])
        words.append(f"{which.capitalize()}: girth not seen by these markers.")
    return words


def doubtful_words(markers: list[MarkerPlace], never_seen: list[str]) -> list[str]:
    """What looks wrong about the markers, in sentences; empty if nothing does."""
    words = never_seen_words(never_seen)
    far = [marker.name for marker in markers if np.linalg.norm(marker.moved_m) > FAR_M]
    if far:
        it, has = ("it", "sits") if len(far) == 1 else ("them", "sit")
        words.append(
            f"{listed(far)} {has} more than {1e3 * FAR_M:.0f} mm from where the layout has {it}: check that this "
            "layout was worn and that the labels are right."
        )
    return words


def never_seen_words(markers: list[str]) -> list[str]:
    """A sentence on markers that the recording did not show; empty if it showed all."""
    return [f"Never seen: {listed(markers)}."] if markers else []


def still_words(digits: tuple[str, ...]) -> list[str]:
    """A sentence on digits that hardly moved; empty if all did."""
    return [f"Hardly moved: {listed(digits)}."] if digits else []
