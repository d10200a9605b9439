"""Names that do something where they are shown, and records that hold them as another program may have written them."""

from __future__ import annotations

import os
import unicodedata
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from core.frames import RigidBody
from core.profile import Profile, load_profile
from core.props.prop import Prop
from core.takes.take import Mark, TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from tests.app.hand_frames import hand_frame, sample

EVIL = "Ann\x1b[2J\nFORGED\t<b>x</b>\x9b31m\u202egpj&\x7f\u2028"
"""Clears a screen, begins a line of its own, is a cell more, is markup, colours, turns around."""
EVIL_FILE = os.fsdecode(b"=take\x1b[2J\nFORGED\xe9<i>")
"""The same of a file, with a byte that is no text."""
SHOWN = r"Ann\x1b[2J\nFORGED\t<b>x</b>\x9b31m\u202egpj&\x7f\u2028"

Record = TypeVar("Record")


def holding(record: Record, **values: object) -> Record:
    """A record with values that its own checks would have mended."""
    for name, value in values.items():
        object.__setattr__(record, name, value)
    return record


def acting(text: str) -> set[str]:
    """Characters of a text that act where it is shown, beside newlines and tabs."""
    return {
        c
        for c in text
        if c not in "\n\t" and (unicodedata.category(c) in ("Cc", "Cs", "Zl", "Zp") or c in "\u202d\u202e\u200b\ufeff")
    }


def assert_calm(text: str) -> None:
    """Nothing in it acts, and no line of it is a name's own."""
    assert not acting(text), sorted(map(ascii, acting(text)))
    assert not [line for line in text.splitlines() if line.startswith("FORGED")], text


PROP_M = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.06, 0.0], [0.03, 0.02, 0.08]])


def evil_profile() -> Profile:
    """Performer, layout, a marker and a prop of such names."""
    profile = load_profile("han19")
    layout = replace(profile.layout)
    holding(layout, name=EVIL, description=EVIL, marker_names=(EVIL, "=1+1", *layout.marker_names[2:]))
    props = (holding(Prop("pen", PROP_M), name=EVIL),)
    return holding(replace(profile, layout=layout, props=props), performer=EVIL)


def evil_take(folder: Path) -> Path:
    """A take whose every text is such a name, in a file of such a name."""
    folder.mkdir()
    path = folder / f"{EVIL_FILE}.mcap"
    info = holding(
        TakeInfo("x", rate_hz=100.0), name=EVIL, performer=EVIL, notes=EVIL, shot=EVIL, device={EVIL: EVIL}, rating=EVIL
    )
    worn = evil_profile()
    writer = TakeWriter(path, info, (worn, worn))
    frame, tracked = sample(hand_frame("left"), hand_frame("right"))
    bodies = (holding(RigidBody(1, "x", np.zeros(3), np.array([1.0, 0, 0, 0]), True), name=EVIL),)
    for i in range(30):
        times = replace(frame.times, device_s=i / 100, host_s=i / 100, arrival_s=i / 100)
        writer.raw("", replace(frame, times=times, sequence=i, rigid_bodies=bodies))
        writer.solved(replace(tracked, times=times, sequence=i))
    writer.mark(holding(Mark(0.1), text=EVIL))
    writer.mark(Mark(0.2, '=HYPERLINK("http://x")'))
    writer.seal(TakeCounts(30, 30, solved=30, tracked={EVIL: 30}, dropped={EVIL: 0}))
    return path
