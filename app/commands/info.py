"""`phalanx info FILE`: what a take or any other recording holds."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from app.commands.recording_info import (
    cast_of_take,
    common_figures,
    hole_lines,
    print_lines,
    recording_figures,
    recording_lines,
)
from app.commands.result import Result
from app.commands.stream_info import counts_text, stream_figures, stream_lines
from app.commands.terminal import Progress
from app.commands.verdict import status_of, verdict_figures, verdict_line
from app.take_devices import devices_of


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser(
        "info",
        help="what a recording holds",
        description="Says what a take or any other recording that Phalanx reads (TRC, C3D, Qualisys TSV, Motive CSV, "
        "points.csv) holds: frames, rate, markers and their gaps, time without frames, and what its reader found "
        "amiss. A take tells more: who wore what, marks, notes, and where every frame went.",
        epilog="Exit status: 0, and warnings are shown; 3 for a take that is not sealed, or of which something is "
        "damaged, lost or not as it should be; 1 for a take without a frame that can be read.",
    )
    parser.add_argument("file", metavar="FILE", type=Path, help="a take or a recording")
    parser.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> Result:
    """Prints it; the exit status is that of a take's verdict."""
    from core.takes.formats import read_recording
    from core.takes.formats.take import is_take
    from core.takes.overview import overview, warnings_of

    if is_take(arguments.file):
        return _take(arguments.file)
    recording = read_recording(arguments.file)
    seen = overview(recording)
    warnings = (*recording.warnings, *warnings_of(recording))
    print_lines([*recording_lines(arguments.file, recording, seen), *_warned(warnings)])
    return Result(figures={**recording_figures(arguments.file, recording, seen), "warnings": warnings})


def _take(path: Path) -> Result:
    from core.takes.checked import check
    from core.takes.reader import open_take
    from core.takes.take import LOOKED_BACK
    from core.takes.verify import raw_warnings

    with open_take(path) as opened:
        progress = Progress(f"Reading {path.name}")
        checked = check(opened, progress)
        progress.done()
        take, raw = checked.take, checked.raw
        gaps, points, warnings = raw.gaps, raw.points, raw_warnings(raw, take.info.rate_hz)
        figures = {**take_figures(take), **common_figures(take, gaps, points, warnings)}
        info, counts = take.info, take.counts
        rate = f"{info.rate_hz:g} Hz" if math.isfinite(info.rate_hz) else "rate unknown"
        lines = [
            ("Take", info.name),
            ("Performer", info.performer or "not named"),
            *([("Shot", info.shot)] if info.shot else []),
            ("Recorded", f"{info.created_utc.astimezone():%Y-%m-%d %H:%M:%S %Z}, {take.duration_s:.2f} s at {rate}"),
            *([("", LOOKED_BACK)] if info.looked_back else []),
            *_devices(take),
            *_worn(figures["performers"]),
            *[("Neutral", words) for words in figures["neutral"]],
            ("Frames", f"{len(take.raw):,} raw, {len(take.solved):,} solved{_left_out(take)}"),
        ]
        if counts is not None:
            lines.append(("Counts", counts_text(counts)))
        lines += hole_lines(take.holes)
        lines += stream_lines(take)
        if gaps.total:
            lines.append(("Gaps", f"{gaps.words} among the raw points, {100 * gaps.share(points):.1f} %"))
        if counts is not None and counts.tracked and take.solved:
            shares = (f"{hand} {100 * share:.1f} %" for hand, share in figures["tracked"].items())
            lines.append(("Tracked", ", ".join(shares)))
        lines += [("Mark", f"{mark.time_s:8.2f} s  {mark.text}") for mark in take.marks]
        if info.rating:
            lines.append(("Rating", info.rating))
        if info.notes:
            lines += [("" if i else "Notes", text) for i, text in enumerate(info.notes.splitlines())]
        lines.append(("State", f"It {checked.condition}."))
        lines += [("Damage", text) for text in take.damage]
        lines.append(("Verdict", verdict_line(take.verdict)))
        lines += [("", text) for text in take.verdict.texts if text not in take.damage]
        print_lines(lines + _warned(warnings))
        return Result(status_of(take.verdict), figures)


def _warned(warnings: Sequence[str]) -> list[tuple[str, str]]:
    return [("Warning", text) for text in warnings]


def _devices(take: Any) -> list[tuple[str, str]]:
    """A line for each that is known."""
    said = devices_of(take.info.device, take.streams)
    known = {key: one for key, one in said.items() if one}
    named = [(f"{key}: ", one) for key, one in known.items()] if len(known) > 1 else [("", take.info.device)]
    return [
        ("" if i else "Device", (key + ", ".join(f"{name}: {text}" for name, text in one.items())) or "unknown")
        for i, (key, one) in enumerate(named)
    ]


def _left_out(take: Any) -> str:
    from core.takes.take import BY_CHOICE

    left_out = take.account.left_out
    return f", {BY_CHOICE}: {left_out:,}" if left_out else ""


def _tracked(take: Any) -> dict[str, float]:
    """Share of the frames that were to be solved, and of those that are missing, in which each hand is tracked."""
    wanted = max(len(take.raw) + take.account.missing - take.account.left_out, 1)
    return {hand: n / wanted for hand, n in take.counts.tracked.items()} if take.counts is not None else {}


def _worn(performers: list[dict[str, Any]] | None) -> list[tuple[str, str]]:
    """What each performer wore."""
    if performers is None:
        return [("Layout", "a saved profile is damaged")]
    if len(performers) == 1:
        return [("Layout", performers[0]["layout"])]
    return [
        (
            "Layout",
            f"{one['layout']}, {' and '.join(one['sides'])} hand{'s' * (len(one['sides']) > 1)} of {one['name']}",
        )
        for one in performers
    ]


def take_figures(take: Any) -> dict[str, Any]:
    """What `--json` says of a take (core.takes.reader.Take)."""
    from core.cast import performer_names
    from core.takes.export.counted import neutral_words

    cast = cast_of_take(take)
    names = performer_names(cast, "performer ") if len(cast) > 1 else [profile.performer for profile in cast]
    performers = [
        {"name": name, "layout": profile.layout.name, "sides": profile.sides}
        for name, profile in zip(names, cast, strict=True)
    ]
    return {
        "take": take.path,
        "name": take.info.name,
        "performer": take.info.performer,
        "shot": take.info.shot,
        "looked_back": take.info.looked_back,
        "created_utc": take.info.created_utc.isoformat(),
        "rate_hz": take.info.rate_hz,
        "duration_s": take.duration_s,
        "device": take.info.device,
        "layout": cast[0].layout.name if cast else None,
        "sides": cast[0].sides if cast else None,
        "performers": performers or None,
        "neutral": neutral_words(cast),
        "notes": take.info.notes,
        "rating": take.info.rating,
        "raw": len(take.raw),
        "solved": len(take.solved),
        "left_out": take.account.left_out,
        "tracked": _tracked(take),
        "streams": stream_figures(take),
        "marks": take.marks,
        "counts": take.counts,
        "holes": take.holes,
        "silent_s": take.holes.seconds,
        "missing": take.account.missing,
        "verdict": verdict_figures(take.verdict),
        "sealed": take.sealed,
        "damage": take.damage,
        "problems": take.problems,
        "lost_raw": take.lost_raw,
        "lost_solved": take.lost_solved,
        "libraries": take.libraries,
    }
