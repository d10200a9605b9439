"""Four markers: standard, subspace and layered inverse kinematics (Schröder 2017, Table 1).

True poses: sequences of Han's users 1 to 4, solved with all 19 markers; none of them is in the subspace. Two kinds: all
sorts of motion, with fingers that move alone, and those that look like grasping (app.reconstruction.motions.is_grasp),
as the paper's "manual interaction motions" are. Each is played
by the template, seen by four markers without noise, and solved again from these; the root is given, as the paper's
forearm anchor gives it. The error is the distance of every vertex of the skin from where it truly is.

The layout compared is `tips`: thumb, index, middle and pinky, at the tips, where a marker speaks of every joint of its
digit; the ring finger, which its neighbours tell most of, has none. Two others show what the choice matters: `ring`
with the middle finger left out instead, and `middles` with the markers on the middle bones. `five`, with the ring's tip
as well, tells what the missing marker costs.
"""

from __future__ import annotations

import argparse
from typing import Any

from app.reconstruction.methods import METHODS, Surface, markers_of, reconstructed
from app.reconstruction.motions import HAN, han_motions, is_grasp
from core.hand.model import template
from core.markers.layout import load_layout
from core.motion.subspace import shipped_subspace

NEEDS = (HAN,)

KINDS = {"all sorts": None, "grasps": is_grasp}

LAYOUTS = {
    "tips": ("thumb_tip", "index_tip", "middle_tip", "pinky_tip"),
    "ring": ("thumb_tip", "index_tip", "ring_tip", "pinky_tip"),
    "middles": ("thumb_proximal", "index_middle", "middle_middle", "pinky_middle"),
    "five": ("thumb_tip", "index_tip", "middle_tip", "ring_tip", "pinky_tip"),
}
"""Markers of schroeder17."""

PUBLISHED_MM = {"standard": (17.9, 79.0), "subspace": (8.9, 21.0)}
"""Schröder 2017, Table 1: mean and maximum. Its layout, motions and subspace are not published."""

SEQUENCES = 8
"""Of every user, for each kind of motion."""

MOST_FRAMES = 150


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Prints mean and maximum for every kind of motion, layout and method."""
    hand, subspace = template(), shipped_subspace("generic")
    surface, full = Surface(hand), load_layout("schroeder17")
    figures: dict[str, Any] = {"dimensions": subspace.dimensions, "published_mm": PUBLISHED_MM}
    for kind, kept in KINDS.items():
        motions = han_motions(arguments.data, SEQUENCES, arguments.seed, arguments.frames or MOST_FRAMES, kept)
        poses = sum(len(motion) for motion in motions)
        found = figures[kind] = {"poses": poses}
        print(
            f"  motions: {kind}, {len(motions)} sequences, {poses:,} poses; "
            f"subspace generic, {subspace.dimensions} dimensions"
        )
        print(f"  {'layout':10} {'method':14} {'mean':>8} {'max':>8} {'95 %':>8}   [mm] {'worst on unmarked':>18}")
        for name, markers in LAYOUTS.items():
            layout, rows = markers_of(full, markers, name), found.setdefault(name, {})
            for method in METHODS:
                error = surface.error(reconstructed(method, hand.skeleton, layout, subspace, motions), motions)
                row = rows[method.title] = error.figures() | {"on_unmarked": error.on_unmarked(layout)}
                numbers = f"{row['mean_mm']:8.2f} {row['max_mm']:8.1f} {row['p95_mm']:8.1f}"
                print(f"  {name:10} {method.title:14} {numbers} {100 * row['on_unmarked']:21.0f} %")
    for title, (mean, most) in PUBLISHED_MM.items():
        print(f"  {'published':10} {title:14} {mean:8.2f} {most:8.1f}")
    print(
        "  max: the worst vertex of the worst pose; 95 %: so many poses have a better worst vertex; "
        "worst on unmarked: poses whose worst vertex is on a digit without a marker"
    )
    return figures
