"""Known angles against tracked ones: made people and a hand that is not ours, three layouts, put on well and badly."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from app.angle_bench import tables
from app.angle_bench.cases import MOTIONS, SUBJECTS, Case, Outcome, outcome, subject_of
from app.angle_bench.figures import by_joint, by_kind
from app.angle_bench.gaps import figures as gap_figures
from app.angle_bench.own_error import own_error
from app.angle_bench.put_on import said
from app.angle_bench.rig import FILE, folder_in
from app.angle_bench.subjects import Setting, WebXR
from app.commands.parallel import in_parallel, usable_cores
from app.gap_angles import LENGTHS_S, SHOWN
from app.people import SIZES
from core.engine import warm_up
from core.errors import FormatError, PhalanxError
from core.markers.layout import layout_names, load_layout

LAYOUTS = ("han19", "qualisys13", "schroeder8")
PLACEMENTS_MM = (0.0, 1.5, 3.0, 5.0)
MOST_MM = 15.0
LEAST_HZ, MOST_HZ = 20.0, 480.0


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument("--subjects", nargs="+", choices=SUBJECTS, default=list(SUBJECTS), help="default: both")
    parser.add_argument("--people", metavar="N", type=int, default=2, help="made people; default %(default)s")
    parser.add_argument(
        "--layouts", metavar="L", nargs="+", choices=layout_names(), default=list(LAYOUTS),
        help="default " + " ".join(LAYOUTS),
    )  # fmt: skip
    parser.add_argument(
        "--placements", metavar="MM", type=float, nargs="+", default=list(PLACEMENTS_MM),
        help="how far each marker is off, along the skin; default " + " ".join(f"{mm:g}" for mm in PLACEMENTS_MM),
    )  # fmt: skip
    parser.add_argument("--seconds", metavar="S", type=float, default=20.0, help="of each stretch; default %(default)s")
    parser.add_argument("--rate", metavar="HZ", type=float, default=60.0, help="default %(default)s")
    parser.add_argument(
        "--motion", choices=MOTIONS, default="own",
        help="own: people move as the built-in performer, the WebXR hand by independent waves; or both by one of them",
    )  # fmt: skip
    parser.add_argument("--noise", metavar="MM", type=float, default=0.1, help="of a coordinate; default %(default)s")
    parser.add_argument("--skin", metavar="MM", type=float, default=0.6, help="sliding of skin; default %(default)s")
    parser.add_argument("--seed", metavar="N", type=int, default=4001, help="of the first subject; default %(default)s")
    parser.add_argument(
        "--data",
        metavar="DIR",
        type=Path,
        help=f"folder that holds {FILE} of the WebXR generic hand, or its parents",
    )
    parser.add_argument("--no-gaps", action="store_true", help="leave out the table of gaps")
    parser.add_argument("--joints", action="store_true", help="print every joint, not only every kind")
    parser.add_argument("--jobs", metavar="N", type=int, default=usable_cores(), help="processes; default %(default)s")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Prints the tables. Points carry their markers' names: what is measured is angles, not labels.

    Seeds of subjects, from --seed on, are used by nothing else in Phalanx: no default was chosen on them, and no
    subspace made from them.
    """
    if arguments.seconds < tables.LEAST_S:
        raise PhalanxError(
            f"--seconds {arguments.seconds:g}.", f"Give {tables.LEAST_S:g} or more: the first 4.2 are held flat."
        )
    if not LEAST_HZ <= arguments.rate <= MOST_HZ:
        raise PhalanxError(f"--rate {arguments.rate:g}.", f"Give {LEAST_HZ:g} to {MOST_HZ:g} Hz.")
    if not all(0.0 <= mm <= MOST_MM for mm in arguments.placements):
        raise PhalanxError(
            "--placements " + " ".join(f"{mm:g}" for mm in arguments.placements) + ".", f"Give 0 to {MOST_MM:g} mm."
        )
    left_out = _left_out(arguments)
    cases = _cases(arguments, left_out)
    if not cases:
        why = f": the WebXR hand is left out, {left_out['webxr']}" if left_out else ""
        raise FormatError(f"There is nobody to measure{why}.", "Give another --data, or --people 1 or more.")
    warm_up()
    outcomes = list(_done(cases, arguments.jobs))
    figures: dict[str, Any] = {
        "seeds": sorted({case.seed for case in cases}), "seconds": arguments.seconds, "rate_hz": arguments.rate,
        "noise_mm": arguments.noise, "skin_mm": arguments.skin, "left_out": left_out,
        "places": {layout: said(load_layout(layout)) for layout in arguments.layouts},
        "subjects": {}, "mapping": None, "gaps": {},
    }  # fmt: skip
    tables.head(arguments, cases, left_out)
    webxr = next((subject for case in cases if isinstance(subject := subject_of(case), WebXR)), None)
    if webxr is not None:
        figures["mapping"] = own_error(webxr)
        tables.mapping(figures["mapping"])
    for kind in SUBJECTS:
        own = [(case, found) for case, found in zip(cases, outcomes, strict=True) if case.kind == kind]
        if own:
            figures["subjects"][kind] = _of_kind(own)
            tables.of_kind(kind, figures["subjects"][kind], arguments.joints)
            if not arguments.no_gaps:
                figures["gaps"][kind] = _gaps(own)
                tables.gaps(kind, figures["gaps"][kind], own[0][0])
    return figures


def _left_out(arguments: argparse.Namespace) -> dict[str, str]:
    """Subjects that cannot be measured here, and why."""
    if "webxr" not in arguments.subjects or (arguments.data and folder_in(arguments.data)):
        return {}
    where = f"{arguments.data} holds no {FILE} of it" if arguments.data else "--data names no folder that holds it"
    return {"webxr": f"it is no part of Phalanx, and {where}"}


def _cases(arguments: argparse.Namespace, left_out: dict[str, str]) -> list[Case]:
    folder = folder_in(arguments.data) if arguments.data else None
    setting = Setting(arguments.rate, arguments.seconds, arguments.noise / 1e3, arguments.skin / 1e3)
    who = [("people", arguments.seed + 2 * k, SIZES[k % len(SIZES)]) for k in range(arguments.people)]
    who.append(("webxr", arguments.seed + 2 * arguments.people, 1.0))
    return [
        Case(
            kind, seed, size, arguments.motion, folder, layout, placement / 1e3, setting,
            LENGTHS_S if not arguments.no_gaps and (i, j) == (0, 0) else (),
        )
        for kind, seed, size in who if kind in arguments.subjects and kind not in left_out
        for i, layout in enumerate(arguments.layouts)
        for j, placement in enumerate(arguments.placements)
    ]  # fmt: skip


def _done(cases: list[Case], jobs: int) -> Any:
    if jobs <= 1:
        yield from (outcome(case, lambda share, text: None) for case in cases)
        return
    for found in in_parallel(outcome, cases, min(jobs, len(cases)), "Known angles"):
        if isinstance(found, PhalanxError):
            raise found
        yield found


def _of_kind(own: list[tuple[Case, Outcome]]) -> dict[str, Any]:
    """By layout, placement [mm] and way."""
    figures: dict[str, Any] = {}
    for layout in dict.fromkeys(case.layout for case, _ in own):
        for off_m in dict.fromkeys(case.off_m for case, _ in own):
            outcomes = [found for case, found in own if (case.layout, case.off_m) == (layout, off_m)]
            figures.setdefault(layout, {})[f"{1e3 * off_m:g}"] = {
                way: {
                    "lost": sum(found.lost[way] for found in outcomes) / len(outcomes),
                    "kinds": by_kind([found.runs[way] for found in outcomes]),
                    "joints": by_joint([found.runs[way] for found in outcomes]),
                }
                for way in outcomes[0].runs
            }
    return figures


def _gaps(own: list[tuple[Case, Outcome]]) -> dict[str, Any]:
    tried = [found.gaps for _, found in own if found.gaps]
    return {
        f"{duration:g}": {shown: gap_figures([found[duration][shown] for found in tried]) for shown in SHOWN}
        for duration in LENGTHS_S
    }
