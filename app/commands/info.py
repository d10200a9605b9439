"""`phalanx info TAKE`: what a take holds."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

from app.commands.result import Exit, Result
from app.commands.verdict import verdict_figures, verdict_line

MOST_HOLES = 5


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser("info", help="what a take holds")
    parser.add_argument("take", metavar="TAKE", type=Path)
    parser.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> Result:
    """Prints it; done with loss if the take is damaged."""
    from core.takes.reader import open_take

    with open_take(arguments.take) as take:
        figures = take_figures(take)
        info, counts = take.info, take.counts
        rate = f"{info.rate_hz:g} Hz" if math.isfinite(info.rate_hz) else "rate unknown"
        lines = [
            ("Take", info.name),
            ("Performer", info.performer or "not named"),
            ("Recorded", f"{info.created_utc.astimezone():%Y-%m-%d %H:%M:%S %Z}, {take.duration_s:.2f} s at {rate}"),
            ("Device", ", ".join(f"{name}: {text}" for name, text in info.device.items()) or "unknown"),
            *_worn(figures["performers"]),
            ("Frames", f"{len(take.raw):,} raw, {len(take.solved):,} solved"),
        ]
        if counts is not None:
            dropped = "".join(f", {reason}: {n:,}" for reason, n in counts.dropped.items() if n)
            text = (
                f"received {counts.received:,} = written {counts.written:,} + dropped {counts.dropped_total:,}{dropped}"
            )
            lines.append(("Counts", f"{text}; lost before this machine {counts.lost:,}"))
        if len(take.holes):
            lines.append(("Holes", take.holes.words))
            lines += [("", f"from {begin + 0.0:8.2f} s to {end + 0.0:8.2f} s") for begin, end in _longest(take.holes)]
        if counts is not None and counts.tracked and take.solved:
            shares = (f"{hand} {100 * n / _expected(take):.1f} %" for hand, n in counts.tracked.items())
            lines.append(("Tracked", ", ".join(shares)))
        lines += [("Mark", f"{mark.time_s:8.2f} s  {mark.text}") for mark in take.marks]
        if info.rating:
            lines.append(("Rating", info.rating))
        if info.notes:
            lines.append(("Notes", info.notes))
        state = (
            "sealed"
            if take.sealed
            else "not sealed: cut off, or still being recorded; `phalanx recover` seals what is there"
        )
        lines.append(("State", state))
        lines += [("Damage", text) for text in take.damage]
        lines.append(("Verdict", verdict_line(take.verdict)))
        lines += [("", text) for text in take.verdict.texts if text not in take.damage]
        for name, text in lines:
            print(f"{name:10} {text}")
        return Result(Exit.DONE if take.complete else Exit.LOSS, figures)


def _longest(holes: Any) -> list[tuple[float, float]]:
    """The longest few, in the order of time [s]."""
    lengths_s = holes.to_s - holes.from_s
    chosen = sorted(lengths_s.argsort()[::-1][:MOST_HOLES].tolist())
    return [(float(holes.from_s[i]), float(holes.to_s[i])) for i in chosen]


def _expected(take: Any) -> int:
    """Frames that the take should have."""
    return max(len(take.raw) + take.account.missing, 1)


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
    from core.errors import PhalanxError

    try:
        cast = take.profiles
    except PhalanxError:
        cast = ()
    names = performer_names(cast, "performer ") if len(cast) > 1 else [profile.performer for profile in cast]
    performers = [
        {"name": name, "layout": profile.layout.name, "sides": profile.sides}
        for name, profile in zip(names, cast, strict=True)
    ]
    return {
        "take": take.path,
        "name": take.info.name,
        "performer": take.info.performer,
        "created_utc": take.info.created_utc.isoformat(),
        "rate_hz": take.info.rate_hz,
        "duration_s": take.duration_s,
        "device": take.info.device,
        "layout": cast[0].layout.name if cast else None,
        "sides": cast[0].sides if cast else None,
        "performers": performers or None,
        "notes": take.info.notes,
        "rating": take.info.rating,
        "raw": len(take.raw),
        "solved": len(take.solved),
        "marks": take.marks,
        "counts": take.counts,
        "holes": take.holes,
        "silent_s": take.holes.seconds,
        "missing": take.account.missing,
        "verdict": verdict_figures(take.verdict),
        "sealed": take.sealed,
        "damage": take.damage,
        "lost_raw": take.lost_raw,
        "lost_solved": take.lost_solved,
        "libraries": take.libraries,
    }
