"""What a C3D file says of the take beside its points: the groups SUBJECTS, TRIAL, MANUFACTURER and PHALANX."""

from __future__ import annotations

from math import isfinite, nan

import numpy as np

from core.takes.export.c3d_events import cut
from core.takes.export.c3d_section import MOST_TEXTS, Value
from core.takes.export.content import Content
from core.takes.take import program_version

_MOST_LINES = 100
Groups = dict[str, dict[str, Value]]


def facts(content: Content, n_frames: int, part: int, n_parts: int, start_s: float) -> Groups:
    """n_frames: of this file, the part-th (from 0) of n_parts, which begins at start_s on the grid [s]."""
    info = content.solution.info
    about = {"TAKE": content.solution.name}
    if info is not None:
        about |= {
            "PERFORMER": info.performer, "SHOT": info.shot, "RATING": info.rating,
            "CREATED_UTC": info.created_utc.isoformat(timespec="seconds"),
        }  # fmt: skip
    notes = _lines(info.notes) if info is not None else ()
    return {
        **_subjects(content),
        "TRIAL": {
            "ACTUAL_START_FIELD": np.array([1, 0]),
            "ACTUAL_END_FIELD": np.array([n_frames, 0]),
            "CAMERA_RATE": content.grid.rate_hz,
        },
        "MANUFACTURER": {
            "COMPANY": ("Phalanx",), "SOFTWARE": ("Phalanx",), "VERSION_LABEL": (program_version(),),
        },
        "PHALANX": {
            "PART": part + 1,
            "PARTS": n_parts,
            "START_S": start_s,
            "FROM_S": content.solution.start_s,
            **_source(content, start_s),
            "UP": ("+Z" if content.options.up == "z" else "+Y",),
            "VERSION": (program_version(),),
            **{name: (cut(text, MOST_TEXTS),) for name, text in about.items() if text},
            **({"NOTES": notes} if notes else {}),
            **_made(content),
        },
    }  # fmt: skip


def _made(content: Content) -> dict[str, Value]:
    """From which file, with which profiles, and how; each profile in a text of its own, in the performers' order."""
    made, cast = content.made, content.cast
    texts = {
        "SOURCE": (content.solution.file,), "SOURCE_SHA256": (made.source_sha256,),
        "LAYOUTS": tuple(profile.layout.name for profile in cast), "PROFILES_SHA256": made.profiles_sha256,
        "SETTINGS": made.lines,
    }  # fmt: skip
    return {
        name: tuple(cut(text, MOST_TEXTS) for text in lines[:MOST_TEXTS]) for name, lines in texts.items() if any(lines)
    }


def _source(content: Content, start_s: float) -> dict[str, Value]:
    """When the first frame was by the clock of its device, or in the file it came from [s]: as text, for a real of 32
    bits holds no clock."""
    place = min(round(start_s * content.grid.rate_hz), len(content.grid) - 1)
    source_s = content.source_s(int(content.grid.before[place])) if place >= 0 else nan
    return {"TIME_SOURCE_S": (f"{source_s:.6f}",)} if isfinite(source_s) else {}


def _subjects(content: Content) -> Groups:
    """Whose markers begin with what, as Vicon's programs write it; of one performer, if he has a name."""
    info = content.solution.info
    if len(content.cast) > 1:
        names, prefixes = content.subjects, tuple(f"{subject}:" for subject in content.subjects)
    else:
        names, prefixes = (content.cast[0].performer or (info.performer if info else ""),), ("",)
    if not any(names):
        return {}
    return {
        "SUBJECTS": {
            "USED": len(names), "USES_PREFIXES": int(len(names) > 1),
            "NAMES": tuple(cut(name, MOST_TEXTS) for name in names), "LABEL_PREFIXES": prefixes,
        }
    }  # fmt: skip


def _lines(text: str) -> tuple[str, ...]:
    """The lines of a text, long ones in pieces; those that a parameter has room for."""
    lines: list[str] = []
    for line in text.splitlines():
        rest = line.rstrip()
        while rest:
            piece = cut(rest, MOST_TEXTS)
            lines.append(piece)
            rest = rest[len(piece) :]
    return tuple(lines[:_MOST_LINES])
