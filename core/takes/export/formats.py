"""The formats there are, and what each makes of the options."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from core.takes.export import bvh, c3d, csv_tables, gltf, held_csv, holes_csv, marks_csv, trc
from core.takes.export.content import Content
from core.takes.export.options import ExportOptions
from core.takes.export.progress import Progress


@dataclass(frozen=True)
class Format:
    """names: the files it makes. write: writes them to the paths given and reads them back. counts: of the frames in
    each of these files; by default as many as places on the even grid, or else as there are solved.

    unit: of its lengths, where no other is asked for; "" where it holds none. even: its frames stand on an even grid.
    keeps: why it does not follow an option, by the option's name. needs_hands: there is nothing to write where no hand
    was ever tracked. needs_raw: it holds the device's frames, solved or not. turns_itself: it takes
    frames that are Y up and turns them.
    """

    title: str
    names: Callable[[Content], list[str]]
    write: Callable[[Content, list[Path], Progress], None]
    unit: str = "m"
    even: bool = False
    keeps: tuple[tuple[str, str], ...] = ()
    needs_hands: bool = False
    needs_raw: bool = False
    turns_itself: bool = False
    counts: Callable[[Content], list[int]] | None = None

    def follows(self, option: str) -> bool:
        """Whether it can be written as the option asks."""
        return option not in dict(self.keeps)

    def unit_of(self, options: ExportOptions) -> str:
        """Of the lengths in its files."""
        return options.unit if options.unit and self.follows("unit") else self.unit

    def n_frames(self, content: Content) -> list[int]:
        """In each of its files."""
        if self.counts is not None:
            return self.counts(content)
        return [len(content.grid) if self.even else content.timeline.n_frames] * len(self.names(content))

    def content_of(self, content: Content) -> Content:
        """The frames as it writes them."""
        return content.turned if self.follows("up") and not self.turns_itself else content


_OWN_FRAMES = ("rate_hz", "CSV keeps the recording's own frames, with the time of each, at any rate.")
_NAMED_UNITS = ("unit", "CSV is in metres, as the names of its columns say.")

FORMATS: dict[str, Format] = {
    "c3d": Format("C3D, labelled markers", c3d.names, c3d.write, "mm", even=True, counts=c3d.counts),
    "trc": Format("TRC, measured markers", trc.names, trc.write, "mm", even=True),
    "csv": Format(
        "CSV, markers, angles and joints", csv_tables.names, csv_tables.write, keeps=(_OWN_FRAMES, _NAMED_UNITS)
    ),
    "points": Format(
        "CSV, raw points", csv_tables.points_names, csv_tables.write_points, keeps=(_OWN_FRAMES, _NAMED_UNITS),
        needs_raw=True, counts=lambda content: [len(content.raw)],
    ),
    "bvh": Format(
        "BVH, skeleton of each hand", bvh.names, bvh.write, "cm", even=True, needs_hands=True, turns_itself=True
    ),
    "gltf": Format(
        "glTF, animated hands", gltf.names, gltf.write, needs_hands=True, counts=gltf.counts,
        keeps=(
            ("up", "glTF is Y up, and so is this file: programs turn it as they read it."),
            ("unit", "glTF is in metres by definition."),
        ),
    ),
}  # fmt: skip

HELD = Format("CSV, from when to when a pose is held", held_csv.names, held_csv.write, "")
MARKS = Format("CSV, marks", marks_csv.names, marks_csv.write, "")
HOLES = Format("CSV, time without frames", holes_csv.names, holes_csv.write, "")


def kept(formats: list[str], options: ExportOptions) -> list[str]:
    """Sentences about the options that are asked for and that one of the formats does not follow."""
    asked = {"up": options.up != "y", "unit": options.unit is not None, "rate_hz": options.rate_hz is not None}
    reasons = [
        reason
        for name in formats
        for option, reason in FORMATS[name].keeps
        if asked[option] and not (option == "unit" and options.unit == FORMATS[name].unit)
    ]
    return list(dict.fromkeys(reasons))
