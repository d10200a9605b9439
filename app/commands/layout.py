"""`phalanx layout list | show`: the marker layouts there are."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from app.commands.result import Result
from core.hand.limits import limits_deg
from core.hand.skeleton import JOINT_NAMES
from core.markers.layout import layout_names, load_layout
from core.profile import load_profile

if TYPE_CHECKING:
    from core.observability import AngleTold, Observability


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser("layout", help="list marker layouts, show one")
    actions = parser.add_subparsers(title="actions", metavar="ACTION", required=True)
    listing = actions.add_parser("list", help="names of the layouts shipped with Phalanx")
    listing.add_argument("--angles", action="store_true", help="what each can tell: a table, a row for each angle")
    listing.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    listing.set_defaults(run=run_list)
    show = actions.add_parser("show", help="the markers of one layout, and which angles they tell")
    show.add_argument(
        "layout", metavar="LAYOUT", help="name of a shipped layout, a layout file, or a profile: as it is worn"
    )
    show.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    show.set_defaults(run=run_show)


def run_list(arguments: argparse.Namespace) -> Result:
    """One line per layout, or a table of what they can tell."""
    layouts = [load_layout(name) for name in layout_names()]
    figures: list[dict[str, Any]] = [
        {
            "name": layout.name,
            "markers": len(layout.marker_names),
            "sides": layout.sides,
            "description": layout.description,
        }
        for layout in layouts
    ]
    if arguments.angles:
        from core.observability import observability

        told = [observability(load_profile(layout.name)) for layout in layouts]
        for one, each in zip(figures, told, strict=True):
            one["told"] = each.to_dict()
        _print_table([layout.name for layout in layouts], told)
    else:
        for layout in layouts:
            hands = " and ".join(layout.sides)
            print(f"{layout.name:16} {len(layout.marker_names):3} markers, {hands}: {layout.description}")
    return Result(figures={"layouts": figures})


def _print_table(names: Sequence[str], told: Sequence[Observability]) -> None:
    """Markdown, for docs/joint-angles.md."""
    print("Share of usual postures in which the points decide [%], ± by points of 1 mm alone [degrees, mm]")
    print()
    print(f"| angle | {' | '.join(names)} |")
    print("| --- |" + " --- |" * len(names))
    for angles in zip(*(each.angles for each in told), strict=True):
        print(f"| `{angles[0].name}` | {' | '.join(_told(angle) for angle in angles)} |")


def _told(angle: AngleTold) -> str:
    std = 1000.0 * angle.std if angle.name.endswith("_m") else math.degrees(angle.std)
    return f"{100.0 * angle.share:.0f} ± {std:.1f}"


def run_show(arguments: argparse.Namespace) -> Result:
    """One line per marker, and what they cannot tell."""
    from core.observability import observability

    profile = load_profile(arguments.layout)
    layout, told = profile.layout, observability(profile)
    print(f"{layout.name}: {layout.description}")
    print(f"{len(layout.marker_names)} markers per hand, {' and '.join(layout.sides)}; positions on a right hand [mm]")
    for name, joint, position in zip(layout.marker_names, layout.joints, layout.positions_m, strict=True):
        x, y, z = 1000.0 * position
        print(f"  {name:16} on {JOINT_NAMES[joint]:12} {x:8.1f} {y:8.1f} {z:8.1f}")
    if profile.limits:
        print(f"Joint limits of its own: {profile.limits.words}")
    for words in told.words or ("Every angle is measured while all markers are seen.",):
        print(words)
    return Result(figures={**layout.to_dict(), "told": told.to_dict(), "limits": limits_deg(profile.hand.skeleton)})
