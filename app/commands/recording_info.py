"""What `info` and `verify` say of a recording of any kind."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from core.printable import MOST_OF_TEXT, printable
from core.words import count

if TYPE_CHECKING:
    from core.cast import Cast
    from core.frames import FloatArray
    from core.gaps import Gaps
    from core.recording import Recording
    from core.takes.holes import Holes
    from core.takes.overview import Overview
    from core.takes.reader import Take

MOST_HOLES = 5
MOST_NAMES = 8
MOST_MARKERS = 5
MOST_DIGITS = 9


def recording_lines(path: Path, recording: Recording, seen: Overview) -> list[tuple[str, str]]:
    """Title and text of each line of the table."""
    numbers, n = recording.frame_numbers, recording.n_frames
    lines = [
        ("File", path.name),
        ("Format", recording.format),
        (
            "Frames",
            f"{n:,} at {recording.rate_hz:g} Hz, {recording.span_s:.2f} s, numbered {numbers[0]} to {numbers[-1]}",
        ),
        ("Markers", _markers(recording, seen)),
    ]
    if np.isfinite(seen.reach_m).all():
        digits = _digits(seen.reach_m)
        ranges = (
            f"{axis} {low:.{digits}f} to {high:.{digits}f}"
            for axis, low, high in zip("xyz", *seen.reach_m, strict=True)
        )
        lines.append(("Range", ", ".join(ranges) + " m, y up"))
    share = recording.gap_figures["share"]
    words = f"{recording.gaps.words}, {100 * share:.1f} % of its points"
    lines.append(("Gaps", words if recording.gaps.total else "none"))
    lines += [
        ("", f"{marker.name}: {100 * marker.share:.1f} % of the frames, at longest {marker.longest_s:.2f} s")
        for marker in seen.markers[:MOST_MARKERS]
    ]
    if len(seen.markers) > MOST_MARKERS:
        lines.append(("", f"and {count(len(seen.markers) - MOST_MARKERS, 'more marker')}"))
    if seen.empty:
        lines.append(("Empty", f"{count(seen.empty, 'frame')} without any point"))
    return lines + hole_lines(seen.holes)


def _digits(reach_m: FloatArray) -> int:
    """Decimals [m]: millimetres, and as many more as show a range that is smaller."""
    widest_m = float((reach_m[1] - reach_m[0]).max())
    return 3 if widest_m <= 0 else min(max(3, 2 - math.floor(math.log10(widest_m))), MOST_DIGITS)


def hole_lines(holes: Holes) -> list[tuple[str, str]]:
    """Time without frames, the longest few in the order of time; [] where there is none."""
    if not len(holes):
        return []
    chosen = sorted((holes.to_s - holes.from_s).argsort()[::-1][:MOST_HOLES].tolist())
    spans = ((float(holes.from_s[i]) + 0.0, float(holes.to_s[i]) + 0.0, _why(holes, i)) for i in chosen)
    return [("Holes", holes.words), *(("", f"from {begin:8.2f} s to {end:8.2f} s{why}") for begin, end, why in spans)]


def _why(holes: Holes, i: int) -> str:
    if holes.own[i]:
        return "  Phalanx stood still"
    return "  frames that came are lost" if holes.came[i] else ""


def print_lines(lines: Sequence[tuple[str, str]]) -> None:
    """As a table of two columns."""
    for name, text in lines:
        print(f"{name:10} {printable(text, MOST_OF_TEXT)}")


def recording_figures(path: Path, recording: Recording, seen: Overview) -> dict[str, Any]:
    """What `--json` says of it; of a take in the same words: `common_figures`."""
    return {
        "file": path,
        "format": recording.format,
        "frames": recording.n_frames,
        "rate_hz": recording.rate_hz,
        "seconds": recording.span_s,
        "markers": recording.labels,
        "gaps": recording.gap_figures,
        "warnings": recording.warnings,
        "marker_gaps": {one.name: {"share": one.share, "longest_s": one.longest_s} for one in seen.markers},
        "points": dict(zip(("least", "median", "most"), seen.points, strict=True)),
        "empty": seen.empty,
        "range_m": seen.reach_m,
        "holes": seen.holes,
        "silent_s": seen.holes.seconds,
        "missing": seen.holes.missing,
        "first_frame": int(recording.frame_numbers[0]),
        "last_frame": int(recording.frame_numbers[-1]),
    }


def common_figures(take: Take, gaps: Gaps, points: int, warnings: Sequence[str]) -> dict[str, Any]:
    """What `--json` says of a take as of every recording. points: in its raw frames. markers: those that were worn, as
    exports name them."""
    from core.takes.formats.take import TITLE

    return {
        "format": TITLE,
        "frames": len(take.raw),
        "rate_hz": take.info.rate_hz,
        "seconds": take.duration_s,
        "markers": _worn(cast_of_take(take)),
        "gaps": gaps.figures(points),
        "warnings": warnings,
    }


def cast_of_take(take: Take) -> Cast:
    """The profiles saved in a take, () if one is damaged."""
    from core.errors import PhalanxError

    try:
        return take.profiles
    except PhalanxError:
        return ()


def _worn(cast: Cast) -> list[str]:
    from core.cast import hands_of, performer_names, props_of
    from core.takes.export.naming import subject_names

    subjects = [f"{name}:" if name else "" for name in subject_names(performer_names(cast))] if cast else []
    on_hands = [
        f"{subjects[hand.performer]}{hand.side[0].upper()}_{name}"
        for hand in hands_of(cast)
        for name in cast[hand.performer].layout.marker_names
    ]
    return on_hands + [name for prop in props_of(cast) for name in prop.marker_names]


def _markers(recording: Recording, seen: Overview) -> str:
    least, median, most = seen.points
    if not recording.labels:
        return f"without names, {median} points in a frame ({least} to {most})"
    names = recording.labels
    if len(names) <= MOST_NAMES + 2:
        return f"{len(names)}: {', '.join(names)}"
    return f"{len(names)}: {', '.join(names[:MOST_NAMES])} and {len(names) - MOST_NAMES} more"
