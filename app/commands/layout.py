"""`phalanx layout list | show`: the marker layouts there are."""

from __future__ import annotations

import argparse

from app.commands.result import Result
from core.hand.skeleton import JOINT_NAMES
from core.markers.layout import layout_names, load_layout


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser("layout", help="list marker layouts, show one")
    actions = parser.add_subparsers(title="actions", metavar="ACTION", required=True)
    listing = actions.add_parser("list", help="names of the layouts shipped with Phalanx")
    listing.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    listing.set_defaults(run=run_list)
    show = actions.add_parser("show", help="the markers of one layout")
    show.add_argument("layout", metavar="LAYOUT", help="name of a shipped layout, or a layout file")
    show.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    show.set_defaults(run=run_show)


def run_list(arguments: argparse.Namespace) -> Result:
    """One line per layout."""
    layouts = [load_layout(name) for name in layout_names()]
    for layout in layouts:
        hands = " and ".join(layout.sides)
        print(f"{layout.name:16} {len(layout.marker_names):3} markers, {hands}: {layout.description}")
    return Result(
        figures={
            "layouts": [
                {
                    "name": layout.name,
                    "markers": len(layout.marker_names),
                    "sides": layout.sides,
                    "description": layout.description,
                }
                for layout in layouts
            ]
        }
    )


def run_show(arguments: argparse.Namespace) -> Result:
    """One line per marker."""
    layout = load_layout(arguments.layout)
    print(f"{layout.name}: {layout.description}")
    print(f"{len(layout.marker_names)} markers per hand, {' and '.join(layout.sides)}; positions on a right hand [mm]")
    for name, joint, position in zip(layout.marker_names, layout.joints, layout.positions_m, strict=True):
        x, y, z = 1000.0 * position
        print(f"  {name:16} on {JOINT_NAMES[joint]:12} {x:8.1f} {y:8.1f} {z:8.1f}")
    return Result(figures=layout.to_dict())
