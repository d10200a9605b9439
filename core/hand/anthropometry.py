"""How human hands differ: a Gaussian of the 23 log ratios of a hand's measures to the template's.

What varies together is written as independent factors, each with one standard deviation: the whole hand, its
stoutness, fingers against palm, one digit against the others, one bone, one girth. Numbers and their sources are in
resources/hand/CARD.md, what is judgement is called so there. In short:

- Greiner 1991 (NATICK/TR-92/011, 1,003 men and 1,304 women of the US Army), mean and SD [mm]: length 193.8, 9.8 and
  180.5, 9.7; breadth 90.4, 4.2 and 79.4, 3.8; circumference 213.8, 9.7 and 186.2, 8.6. Both sexes counted alike give
  the mean; their spread, between and within the sexes, gives size and stoutness.
- Buryanov and Kotiuk 2010 (Int. J. Morphol. 28(3), 66 adults): SDs of single bones; distal and middle phalanges vary
  more than proximal ones.
- AIST 2004 (Digital Hand Family: 57 adults, 39 measures): two factors carry most, finger length, and breadth of joints
  with thickness of the hand.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from core.frames import FloatArray
from core.hand.shape import BONE_NAMES, N_SHAPE, PALM_NAMES, SHAPE_NAMES
from core.hand.skeleton import DIGITS

ADULT_SIZE_STD = 0.060
"""Size among adult men and women together: covariance of log length and log breadth, Greiner 1991."""
SIZE_STD = 0.10
"""Size among performers: wide enough for children of ten and for small women's slender hands (judgement)."""

STOUTNESS_STD = 0.045
FINGERS_TO_PALM_STD = 0.030
DIGIT_STD = 0.020
BONE_STD = {"metacarpal": 0.040, "proximal": 0.035, "middle": 0.055, "distal": 0.055}
PINKY_MIDDLE_STD = 0.080
"""The most variable bone of the hand (Garn et al., Radiology 105, 1972; Buryanov and Kotiuk 2010: 14 %)."""
PALM_STD = {"palm_width": 0.030, "palm_length": 0.030, "palm_thickness": 0.060}
GIRTH_STD = 0.030

MEAN_LOG = {"palm_width": 0.030, "palm_length": 0.015, "palm_thickness": 0.070, "girth": 0.060}
"""The adult mean against the template, which is slender; the template's bones are the adult means themselves."""


@dataclass(frozen=True)
class ShapePrior:
    """Gaussian of log(HandShape.ratios).

    mean_log: (23,) float64. covariance_log: (23, 23) float64, of full rank. Order as SHAPE_NAMES.
    """

    mean_log: FloatArray
    covariance_log: FloatArray

    def given(self, jacobian: FloatArray, values: FloatArray) -> FloatArray:
        """(23,) float64, the most likely log ratios x for which jacobian @ x = values.

        jacobian: (k, 23) float64. values: (k,) float64.
        """
        gain = self.covariance_log @ jacobian.T
        likely: FloatArray = self.mean_log + gain @ np.linalg.solve(jacobian @ gain, values - jacobian @ self.mean_log)
        return likely


def shape_prior(size_std: float = SIZE_STD) -> ShapePrior:
    """The prior of a performer's hand. size_std: of the common size, ADULT_SIZE_STD for the adult population."""
    mean = np.asarray([MEAN_LOG.get("girth" if name.endswith("_girth") else name, 0.0) for name in SHAPE_NAMES])
    covariance = np.zeros((N_SHAPE, N_SHAPE))
    for std, names in _factors(size_std):
        loading = np.isin(SHAPE_NAMES, names).astype(np.float64)
        covariance += std**2 * np.outer(loading, loading)
    return ShapePrior(mean, covariance)


def _factors(size_std: float) -> Iterator[tuple[float, tuple[str, ...]]]:
    """Standard deviation of every factor and the measures that it moves alike."""
    girths = tuple(f"{digit}_girth" for digit in DIGITS)
    bones = {digit: tuple(f"{digit}_{bone}" for bone in BONE_NAMES[digit != "thumb"]) for digit in DIGITS}
    yield size_std, SHAPE_NAMES
    yield STOUTNESS_STD, ("palm_width", "palm_thickness", *girths)
    yield FINGERS_TO_PALM_STD, tuple(bone for digit in DIGITS for bone in bones[digit])
    for digit in DIGITS:
        yield DIGIT_STD, bones[digit]
        for bone in bones[digit]:
            yield PINKY_MIDDLE_STD if bone == "pinky_middle" else BONE_STD[bone.removeprefix(f"{digit}_")], (bone,)
    for girth in girths:
        yield GIRTH_STD, (girth,)
    for name in PALM_NAMES:
        yield PALM_STD[name], (name,)
