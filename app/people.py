"""The people of benchmarks: hands over the whole human range, from a child's to a very large one's."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from core.frames import FloatArray
from core.hand.anthropometry import ADULT_SIZE_STD, shape_prior
from core.hand.shape import HandShape
from core.profile import Profile

SIZES = (1.0, 0.75, 1.25, 0.85, 1.15)
"""Of the template, whose hand is 186 mm long: 139 mm, a child's, to 232 mm, four standard deviations above men's mean
(Greiner 1991)."""


def add_sizes(parser: argparse.ArgumentParser) -> None:
    """The option that says how large the people are."""
    parser.add_argument(
        "--sizes", metavar="S", type=float, nargs="+", default=list(SIZES),
        help="of the performers' hands to the template's, by their seeds in turn; default "
        + " ".join(f"{size:g}" for size in SIZES),
    )  # fmt: skip


def size_of(arguments: argparse.Namespace, seed: int) -> float:
    """How large the hand of a seed's performer is, to the template's."""
    sizes: list[float] = arguments.sizes
    return sizes[seed % len(sizes)]


def said(arguments: argparse.Namespace, seeds: Iterable[int]) -> str:
    """The sizes of these performers, in the order of the seeds, for the output of a bench."""
    return "hands of " + ", ".join(f"{size_of(arguments, seed):g}" for seed in seeds) + " times the template's size"


def shape_of(random: np.random.Generator, size: float | None = None) -> HandShape:
    """A hand of the population. size: to the template's, in the mean of its 23 measures; None: drawn of adults."""
    prior = shape_prior(ADULT_SIZE_STD)
    ratios: FloatArray = np.exp(random.multivariate_normal(prior.mean_log, prior.covariance_log, method="cholesky"))
    if size is not None:
        ratios *= size / ratios.mean()
    return HandShape(ratios)


def sized(profile: Profile, size: float) -> Profile:
    """Who truly performs where a profile leaves the size open; one that says it is believed."""
    return profile if profile.scale is not None else replace(profile, scale=size)
