"""Error of the skin by number of markers, for grasping: generic and specific subspace (Schröder 2017, Fig. 11).

True poses: the built-in performer grasping, with a seed that no subspace was made from, and Han's sequences that look
like grasping, solved with all 19 markers. Markers without noise, the root given, the error over all of the skin, as
in table1. The paper compares layouts made for grasping with layouts made for anything; here the layouts are given and
the subspaces differ. As its layouts tell articulation alone, the markers counted are those on digits.

The named layouts, and subsets of schroeder17 in one order, fixed beforehand: the tips, the ring's last; then a second
marker on each digit, the thumb's first; then a third.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any

from app.reconstruction.methods import (
    LAYERED,
    MAP,
    STANDARD,
    Method,
    Surface,
    markers_of,
    on_digits,
    reconstructed,
)
from app.reconstruction.motions import HAN, han_motions, is_grasp, performed
from app.virtual_display import has_display
from core.frames import FloatArray
from core.hand.model import template
from core.markers.layout import MarkerLayout, load_layout
from core.motion.subspace import Subspace, shipped_subspace, subspace_names

NEEDS = (HAN,)

NAMED = ("schroeder6", "schroeder8", "pavllo9", "qualisys13", "alexanderson13", "schroeder17", "han19")
ORDER = (
    "thumb_tip", "index_tip", "middle_tip", "pinky_tip", "ring_tip",
    "thumb_proximal", "index_middle", "pinky_middle", "middle_middle", "ring_middle",
    "thumb_metacarpal", "index_proximal", "pinky_proximal", "middle_proximal", "ring_proximal",
)  # fmt: skip
FEWEST = 4

COLOURS = {
    "standard": "#888888",
    "layered, generic": "#3366cc",
    "prior, generic": "#66aaee",
    "layered, grasping": "#cc4422",
    "prior, grasping": "#ee9966",
}

GOAL_MM = 2.0
PUBLISHED = {"layouts made for grasping": 6, "layouts made for anything": 9}
"""Schröder 2017, Fig. 11: markers from which the mean error is below GOAL_MM."""

SEED = 7001
"""Of the performer; shipped subspaces come from small seeds."""

SEQUENCES, MOST_FRAMES, RATE_HZ = 4, 60, 8.0


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Prints the mean error of every layout and way; with --out, plots it over the number of markers."""
    hand, surface = template(), Surface(template())
    most = arguments.frames or MOST_FRAMES
    kinds = {
        "performer grasping": [performed("grasping", SEED + arguments.seed, RATE_HZ)[: 8 * most]],
        "Han's grasps": han_motions(arguments.data, SEQUENCES, arguments.seed, most, is_grasp),
    }
    figures: dict[str, Any] = {"goal_mm": GOAL_MM, "published_markers": PUBLISHED}
    for kind, motions in kinds.items():
        figures[kind] = _table(kind, motions, surface, hand.skeleton)
    for title, count in PUBLISHED.items():
        print(f"  published, {title}: below {GOAL_MM:.0f} mm from {count} markers on")
    if arguments.out is not None:
        path = arguments.out / "fig11.png"
        plot(figures, list(kinds), path)
        print(f"  {path} written")
        figures["plot"] = path
    return figures


def layouts() -> list[MarkerLayout]:
    """The layouts compared, by markers on digits."""
    full = load_layout("schroeder17")
    made = [markers_of(full, ORDER[:count], f"first {count}") for count in range(FEWEST, len(ORDER) + 1)]
    return sorted([*made, *map(load_layout, NAMED)], key=on_digits)


def ways() -> dict[str, tuple[Method, Subspace]]:
    """Title, method and subspace. Specific is what is shipped for grasping."""
    made = {"standard": (STANDARD, shipped_subspace("generic"))}
    for name in ("generic", "grasping"):
        if name in subspace_names():
            made[f"layered, {name}"] = (LAYERED, shipped_subspace(name))
            made[f"prior, {name}"] = (MAP, shipped_subspace(name))
    return made


def _table(kind: str, motions: list[FloatArray], surface: Surface, skeleton: Any) -> dict[str, Any]:
    compared = ways()
    print(f"  {kind}: {len(motions)} motions, {sum(map(len, motions)):,} poses; mean error of the skin [mm]")
    print(f"  {'layout':16} {'markers':>7} {'on digits':>9} " + " ".join(f"{title:>18}" for title in compared))
    rows = []
    for layout in layouts():
        errors = {
            title: surface.error(reconstructed(method, skeleton, layout, subspace, motions), motions).figures()
            for title, (method, subspace) in compared.items()
        }
        row = {"layout": layout.name, "markers": len(layout.joints), "on_digits": on_digits(layout), "errors": errors}
        numbers = " ".join(f"{error['mean_mm']:18.2f}" for error in errors.values())
        print(f"  {layout.name:16} {row['markers']:7} {row['on_digits']:9} {numbers}")
        rows.append(row)
    enough = {}
    for title in compared:
        above = [row["on_digits"] for row in rows if row["errors"][title]["mean_mm"] >= GOAL_MM]
        below = sorted({row["on_digits"] for row in rows} - set(above))
        below = [count for count in below if count > max(above, default=0)]
        enough[title] = below[0] if below else None
    words = ", ".join(f"{title}: {count or 'none'}" for title, count in enough.items())
    print(f"  markers on digits from which every layout is below {GOAL_MM:.0f} mm: {words}")
    return {"rows": rows, "enough": enough}


PRINTED = {"background": "w", "foreground": "k", "antialias": True}


def plot(figures: dict[str, Any], kinds: list[str], path: Path) -> None:
    """Mean error over markers on digits, one panel per kind of motion: lines over the subsets, dots for the named."""
    import pyqtgraph as pg

    if not has_display():
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")  # a picture needs no screen
    before = {name: pg.getConfigOption(name) for name in PRINTED}
    pg.setConfigOptions(**PRINTED)
    try:
        _draw(figures, kinds, path)
    finally:
        pg.setConfigOptions(**before)


def _draw(figures: dict[str, Any], kinds: list[str], path: Path) -> None:
    import pyqtgraph as pg
    import pyqtgraph.exporters
    from PySide6.QtWidgets import QApplication

    application = QApplication.instance() or QApplication([])
    widget = pg.GraphicsLayoutWidget(size=(1200, 520))
    most = max(e["mean_mm"] for kind in kinds for row in figures[kind]["rows"] for e in row["errors"].values())
    for column, kind in enumerate(kinds):
        panel = widget.addPlot(row=0, col=column, title=f"{kind}; dots: named layouts")
        panel.setLabel("bottom", "markers on the digits")
        panel.setLabel("left", "mean error of the skin [mm]")
        panel.showGrid(y=True, alpha=0.25)
        if column == 0:
            panel.addLegend(offset=(-10, 10))
        rows = figures[kind]["rows"]
        for title, colour in COLOURS.items():
            if title not in rows[0]["errors"]:
                continue
            for subset in (True, False):
                shown = [row for row in rows if row["layout"].startswith("first ") is subset]
                x = [row["on_digits"] for row in shown]
                y = [row["errors"][title]["mean_mm"] for row in shown]
                if subset:
                    panel.plot(x, y, pen=pg.mkPen(colour, width=2.5), name=title)
                else:
                    panel.plot(x, y, pen=None, symbol="o", symbolSize=8, symbolPen=None, symbolBrush=colour)
        panel.addLine(y=GOAL_MM, pen=pg.mkPen("k", style=pg.QtCore.Qt.PenStyle.DashLine))
        panel.setYRange(0.0, 1.05 * most)
        panel.getAxis("bottom").setTicks([[(count, str(count)) for count in range(FEWEST, 17, 2)]])
    widget.show()
    application.processEvents()
    pg.exporters.ImageExporter(widget.scene()).export(str(path))
    widget.close()
