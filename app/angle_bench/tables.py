"""What `phalanx bench angles` prints."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

import numpy as np

from app.angle_bench.cases import Case
from app.angle_bench.gaps import BETWEEN_S
from app.angle_bench.motion import HELD_S, LEAVING_S, SETTLING_S

LEAST_S = 8.0
"""Of a stretch: 4.2 s of it are for the hand that is held flat."""

_COLUMNS = "   bias   most    RMSE  centred      r   slope   2 std  with fixed"


def head(arguments: argparse.Namespace, cases: Sequence[Case], left_out: dict[str, str]) -> None:
    """Who is measured, and how."""
    people = {case.seed: case.size for case in cases if case.kind == "people"}
    if people:
        sizes = ", ".join(f"{size:g} (seed {seed})" for seed, size in people.items())
        moves = "by independent waves" if arguments.motion == "waves" else "as the built-in performer"
        print(f"people: made persons, hands of {sizes} times the template's size, moving {moves}")
    webxr = next((case for case in cases if case.kind == "webxr"), None)
    if webxr is not None:
        moves = "by the built-in performer's angles" if arguments.motion == "performed" else "by independent waves"
        print(f"webxr: the generic hand of WebXR (seed {webxr.seed}), moving {moves} about its own axes; markers on")
        print("  its skin at the share of each bone, on the side and as high above it as the layout has them on ours")
    for name, why in left_out.items():
        print(f"{name}: left out, {why}")
    print(
        f"{arguments.seconds:g} s of each stretch, {arguments.rate:g} Hz, noise {arguments.noise:g} mm, skin sliding "
        f"by {arguments.skin:g} mm; markers named; seeds held out: nothing in Phalanx was chosen on them"
    )
    print(
        f"neutral: counted from a neutral trial, the hand held flat from {SETTLING_S:g} to {SETTLING_S + HELD_S:g} s, "
        f"its true angles given; figures are of what follows {SETTLING_S + HELD_S + LEAVING_S:g} s"
    )


def mapping(figures: dict[str, Any]) -> None:
    """The mapping's own error."""
    off = figures["off_mm"]
    print("\nThe mapping's own error: our model's best angles, at the true joint centres, beside the WebXR hand's own")
    print(f"  our model misses these centres by {off['rms']:.1f} mm RMS, {off['most']:.1f} mm at most")
    print(f"  [degrees]{_COLUMNS[: _COLUMNS.index('2 std')]:>56}")
    for kind, row in figures["kinds"].items():
        print(f"  {kind:24}{_cells(row)}")


def of_kind(kind: str, figures: dict[str, Any], joints: bool) -> None:
    """All angles together for every layout and placement, then by kind of joint."""
    print(f"\n{kind}: all 20 angles [degrees]")
    print(f"  {'layout':11}{'off':>6}  {'':20}{_COLUMNS}   lost")
    for layout, placements in figures.items():
        for placement, ways in placements.items():
            for way in ways:
                row, lost = ways[way]["kinds"]["all"], ways[way]["lost"]
                print(f"  {layout:11}{placement:>3} mm  {way:20}{_cells(row)}{_shares(row)}{100 * lost:5.1f} %")
    for layout, placements in figures.items():
        placement = list(placements)[-1] if len(placements) < 3 else list(placements)[-2]
        for way in placements[placement]:
            print(f"\n{kind}, {layout}, {placement} mm off, {way} [degrees]")
            print(f"  {'':24}{_COLUMNS}")
            ways = placements[placement][way]
            for name, row in (ways["kinds"] | (ways["joints"] if joints else {})).items():
                print(f"  {name:24}{_cells(row)}{_shares(row)}")


def gaps(kind: str, figures: dict[str, Any], case: Case) -> None:
    """One row per duration."""
    print(f"\n{kind}: a digit's markers hidden, one after another, {BETWEEN_S:g} s apart; {case.layout}, "
          f"{1e3 * case.off_m:g} mm off, calibrated, neutral")  # fmt: skip
    print("  gap [s]  values   shown    stated    true [degrees]   2 std  with fixed")
    for duration, shown in figures.items():
        for name, row in shown.items():
            print(
                f"  {duration:>7}  {row['values']:6,}   {name:7}{row['stated']:8.1f}{row['true']:8.1f}         "
                f"{_shares(row)}"
            )


def _cells(row: dict[str, float]) -> str:
    return (
        f"{row['bias']:7.1f}{row['most_bias']:7.1f}{row['rmse']:8.1f}{row['rmse_centred']:9.1f}{row['r']:7.2f}"
        f"{row['slope']:8.2f}"
    )


def _shares(row: dict[str, float]) -> str:
    fixed = "-" if np.isnan(row["within_2_fixed"]) else f"{100 * row['within_2_fixed']:.0f} %"
    return f"{100 * row['within_2']:6.0f} %{fixed:>12}"
