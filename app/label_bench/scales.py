"""Hands of other sizes: the labels of one frame of the same people, made smaller and larger."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

import numpy as np

from app.commands.terminal import Progress
from app.label_bench.clouds import MOST_GHOSTS, MOST_HIDDEN, Score, Users, perturbed
from core.labelling.network import network_at
from core.labelling.sizes import named_unsized, told_of
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
        f"{MOST_GHOSTS} ghosts. Asked as live, the size of\nthe hand unknown; its side known, or open: how often "
        "left and right are told. [%]\n"
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
    network, told = network_at(profile.network), told_of(profile)
    each = []
    for user, (points_m, sides) in zip(arguments.users, users, strict=True):
        score, sides_right = Score(), 0
        for seed in arguments.seeds:
            random = np.random.default_rng([seed, user, points_m.shape[1]])
            for cloud in perturbed(random, scale * points_m, sides, arguments.frames, MOST_HIDDEN, MOST_GHOSTS):
                score.add(cloud, named_unsized(network, cloud.points_m, told, cloud.side))
                sides_right += named_unsized(network, cloud.points_m, told).side == cloud.side
        each.append({**score.figures(), "sides": sides_right / score.frames})
    row = {key: float(np.nanmean([figures[key] for figures in each])) for key in each[0]}
    labels = [figures["labels"] for figures in each]
    return {**row, "worst_user": min(labels), "by_user": labels}
