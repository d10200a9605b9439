"""What `info` and `verify` say of the streams of a take."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from app.commands.recording_info import hole_lines
from core.words import count

if TYPE_CHECKING:
    from core.takes.reader import Take
    from core.takes.take import StreamCounts


def counts_text(counts: StreamCounts) -> str:
    """Where its frames went, in a line."""
    dropped = "".join(f", {reason}: {n:,}" for reason, n in counts.dropped.items() if n)
    text = f"received {counts.received:,} = written {counts.written:,} + dropped {counts.dropped_total:,}{dropped}"
    still = f", while Phalanx stood still {counts.unread:,}" if counts.unread else ""
    return f"{text}; lost before this machine {counts.lost - counts.unread:,}{still}"


def stream_lines(take: Take) -> list[tuple[str, str]]:
    """Title and text of each line of the table; [] for a take of the stream alone that was solved."""
    others = {key: stream for key, stream in take.streams.items() if not stream.solved}
    if not others:
        return []
    none = f"{count(len(others), 'stream')}, none was solved"
    lines = [("Streams", f"{take.solving} was solved, beside it {len(others)} more" if take.solving else none)]
    for key, stream in others.items():
        rate = f" at {stream.info.rate_hz:g} Hz" if math.isfinite(stream.info.rate_hz) else ""
        clock = f", {count(len(stream.clock), 'clock sample')}" if stream.clock else ""
        what = f"{count(len(stream.info.bone_names), 'bone')}, " if stream.info.what == "inertial" else ""
        lines.append(("", f"{key} ({stream.info.title}): {what}{count(len(stream.frames), 'frame')}{rate}{clock}"))
        if stream.counts is not None:
            lines.append(("", f"{key}: {counts_text(stream.counts)}"))
        lines += [("", f"{key}: {text}") for _, text in hole_lines(take.holes_in(key))]
    return lines


def stream_figures(take: Take) -> dict[str, Any]:
    """What `--json` says of each stream, by its key."""
    return {
        key: {
            "solved": stream.solved,
            "kind": stream.info.kind,
            "title": stream.info.title,
            "what": stream.info.what,
            "rate_hz": stream.info.rate_hz,
            "ids": stream.info.ids,
            "bones": stream.info.bone_names,
            "sides": stream.info.sides,
            "frames": len(stream.frames),
            "clock_samples": len(stream.clock),
            "counts": take.counts if stream.solved else stream.counts,
            "silent_s": take.holes_in(key).seconds,
            "lost": stream.lost,
        }
        for key, stream in take.streams.items()
    }
