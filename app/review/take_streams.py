"""The streams of a take in words: which there are, what is in them, and which of them was solved. Knows no window."""

from __future__ import annotations

import math
from dataclasses import dataclass

from app.take_devices import details, device_key, devices_of
from core.level import Level
from core.takes.reader import Take
from core.words import count


@dataclass(frozen=True)
class StreamRow:
    """One stream. name: its key. words: of which device, how many frames, and what is wrong with them. tip: the rest.
    level: the light."""

    name: str
    solved: bool
    words: str
    tip: str
    level: Level


def stream_rows(take: Take) -> tuple[StreamRow, ...]:
    """The one that was solved first; () for a take of that alone, of which everything is said elsewhere."""
    if all(stream.solved for stream in take.streams.values()):
        return ()
    return tuple(_row(take, key) for key in take.streams)


def _row(take: Take, key: str) -> StreamRow:
    stream, verdict, holes = take.streams[key], take.verdict_in(key), take.holes_in(key)
    info, n = stream.info, count(len(stream.frames), "frame")
    words = ", ".join((n, verdict.headline)) if verdict.findings else verdict.headline
    title = info.title or info.kind
    lines = [title]
    if math.isfinite(info.rate_hz):
        lines[0] += f", {info.rate_hz:g} Hz"
    if info.what == "inertial":
        lines[0] += f", rotations of {count(len(info.bone_names), 'bone')}"
    if stream.counts is not None:
        lines.append(f"{stream.counts.words}.")
    if len(holes):
        lines.append(f"{count(len(holes), 'hole')}: {holes.words}.")
    if stream.clock:
        lines.append(f"{count(len(stream.clock), 'clock sample')}.")
    lines += details(devices_of(take.info.device, take.streams).get(device_key(key), {}))
    lines += verdict.texts
    return StreamRow(key or title, stream.solved, f"{title} · {words}", "\n".join(lines), verdict.level)
