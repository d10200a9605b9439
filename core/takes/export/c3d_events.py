"""Marks in a C3D file: the group EVENT, as Vicon's programs write it, and the events of the header."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.takes.export.c3d_section import MOST_TEXTS, Value

MOST_IN_HEADER = 18
_FOUR_CHARACTERS = 12345  # word 150: labels of events have four characters
_KEY, _COUNT, _TIMES, _FLAGS, _LABELS = 298, 300, 304, 376, 396  # bytes of words 150, 151, 153, 189 and 199
_CONTEXT = "General"  # of neither side
_LONGEST = 64
_ROOM = 30_000  # bytes; a parameter holds 32,767


@dataclass(frozen=True)
class Event:
    """time_s: from the first frame of the file [s]."""

    time_s: float
    text: str


def event_group(events: Sequence[Event], subject: str) -> dict[str, dict[str, Value]]:
    """The parameters of the first 255 events; nothing for none. subject: whose they are, "" for nobody's."""
    events = events[:MOST_TEXTS]
    if not events:
        return {}
    times_s = np.array([event.time_s for event in events])
    minutes = np.floor(times_s / 60.0)
    width = min(MOST_TEXTS, _ROOM // len(events))
    labels = tuple(cut(event.text, min(width, _LONGEST)) or f"Mark {i + 1}" for i, event in enumerate(events))
    return {
        "EVENT": {
            "USED": len(events),
            "CONTEXTS": (_CONTEXT,) * len(events),
            "LABELS": labels,
            "DESCRIPTIONS": tuple(cut(event.text, width) for event in events),
            "TIMES": np.stack([minutes, times_s - 60.0 * minutes]),
            "ICON_IDS": np.zeros(len(events), dtype=np.int64),
            "SUBJECTS": (cut(subject, 32),) * len(events),
        }
    }


def put_in_header(header: bytearray, events: Sequence[Event]) -> None:
    """Times, flags and the first four characters of the first 18 events (c3d.org, "Header events")."""
    events = events[:MOST_IN_HEADER]
    if not events:
        return
    struct.pack_into("<HH", header, _KEY, _FOUR_CHARACTERS, len(events))
    for i, event in enumerate(events):
        label = event.text.encode("ascii", "replace").replace(b"\n", b" ")[:4] or f"M{i + 1}".encode()
        struct.pack_into("<f", header, _TIMES + 4 * i, event.time_s)
        header[_FLAGS + i] = 1  # shown
        header[_LABELS + 4 * i : _LABELS + 4 * i + 4] = label.ljust(4)


def cut(text: str, n_bytes: int) -> str:
    """As much of a text as its UTF-8 has room for."""
    return text.encode("utf-8")[:n_bytes].decode("utf-8", "ignore")
