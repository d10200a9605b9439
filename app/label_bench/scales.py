"""Hands of other sizes: the labels of one frame of the same people, made smaller and larger."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from app.commands.terminal import Progress
from app.label_bench.clouds import MOST_GHOSTS, MOST_HIDDEN, Cloud, Score, Users, perturbed
from core.frames import NO_POINT, FloatArray
from core.labelling.asking import Asker
from core.labelling.network import NamedHand
from core.markers.layout import MarkerLayout
from core.profile import Profile

SCALES = (0.75, 0.85, 1.0, 1.15, 1.25)
"""Of the people as recorded; their knuckles are 64 to 77 mm apart, so the smallest have 48 mm and the largest 96."""


def measured(
    users: Users, layouts: Sequence[MarkerLayout], columns: Sequence[Sequence[int]], scales: Sequence[float],
    arguments: argparse.Namespace,
) -> dict[str, Any]:  # fmt: skip
    """Prints a table and returns its figures, by layout and scale. users: all markers of each; columns: those of each
    layout. The same frames with the same markers hidden and the same ghosts at every scale."""
    print(
        f"\nPeople of other sizes: the same users, their points scaled; up to {MOST_HIDDEN} markers hidden and "
        f"{MOST_GHOSTS} ghosts. Asked as live, the size of\nthe hand unknown; left or right told "
        "by which of both, asked for, gets more names, each as sure as it is. [%]\n"
    )
    print(
        "              labels   worst user   against 1.0   hidden: precision   recall   left or right   frames whole   "
        "confidence said"
    )
    path = None if arguments.network is None else str(arguments.network)
    figures: dict[str, Any] = {}
    for layout, own in zip(layouts, columns, strict=True):
        profile = Profile("", layout, network=path)
        thin = [(points[:, list(own)], sides) for points, sides in users]
        name = f"{len(layout.joints)} markers"
        rows: dict[str, dict[str, Any]] = {}
        for scale in scales:
            progress = Progress(f"{name}, {scale:g}")
            rows[f"{scale:g}"] = _at(scale, thin, profile, arguments)
            progress.done()
        whole = rows.get("1", {}).get("labels", float("nan"))
        figures[name] = {scale: {**row, "against_1": row["labels"] - whole} for scale, row in rows.items()}
        print(name)
        for scale, row in figures[name].items():
            labels, worst, against, precision, recall, sides, frames, said = (
                100.0 * row[key]
                for key in ("labels", "worst_user", "against_1", "hidden_precision", "hidden_recall", "sides", "frames",
                            "confidence")
            )  # fmt: skip
            print(
                f"  x {float(scale):<8.2f} {labels:7.2f}   {worst:10.2f}   {against:+11.2f}   {precision:17.2f}   "
                f"{recall:6.2f}   {sides:13.2f}   {frames:12.2f}   {said:15.2f}"
            )
    return figures


def _at(scale: float, users: Users, profile: Profile, arguments: argparse.Namespace) -> dict[str, Any]:
    """Figures at one scale, the mean of the users."""
    asker = Asker((profile,))
    each = []
    for user, (points_m, sides) in zip(arguments.users, users, strict=True):
        score = Score()
        for seed in arguments.seeds:
            random = np.random.default_rng([seed, user, points_m.shape[1]])
            for cloud in perturbed(random, scale * points_m, sides, arguments.frames, MOST_HIDDEN, MOST_GHOSTS):
                hand, told = answered(asker, cloud)
                score.add(cloud, hand)
                score.sides_right += told - (hand.side == cloud.side)
        each.append(score.figures())
    row = {key: float(np.nanmean([figures[key] for figures in each])) for key in each[0]}
    labels = [figures["labels"] for figures in each]
    return {**row, "worst_user": min(labels), "by_user": labels}


def answered(asker: Asker, cloud: Cloud) -> tuple[NamedHand, bool]:
    """The hand asked for by its true side, and whether its true side was told."""
    own, other = (asked(asker, flipped) for flipped in _both_ways(cloud))
    return replace(own, side=cloud.side), names(own) > names(other)


def names(hand: NamedHand) -> float:
    """How many markers have a point, each counted as surely as it has it: asked for the wrong side the network is sure
    that all are hidden."""
    return float(hand.confidence[hand.point != NO_POINT].sum())


def asked(asker: Asker, points_m: FloatArray) -> NamedHand:
    """The right hand among the points, its size unknown, by as many questions as that takes."""
    asker.next_frame()
    hand = asker.name(0, points_m, None)
    assert hand is not None
    return hand


def _both_ways(cloud: Cloud) -> tuple[FloatArray, FloatArray]:
    """The points with the hand as a right one, and in the mirror."""
    mirrored = cloud.points_m * np.array([-1.0, 1.0, 1.0])
    return (cloud.points_m, mirrored) if cloud.side == "right" else (mirrored, cloud.points_m)
