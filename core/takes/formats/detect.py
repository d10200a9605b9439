"""Which format a file has, told by its first bytes; the extension only helps to word an error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from core.errors import FormatError
from core.recording import Recording
from core.takes.formats import bvh, c3d, motive_csv, points_csv, qualisys_tsv, take, trc, wide_csv
from core.takes.formats.text import decode_head
from core.untrusted.files import open_file

HEAD_BYTES = 1 << 16  # the header of some hundred markers
READABLE = "TRC, C3D, Qualisys TSV, Motive CSV, CSV with columns Name-X,Name-Y,Name-Z, points.csv and takes (.mcap)"
EXPECTED_START = {
    ".trc": f'A TRC file starts with "{trc.START}"',
    ".c3d": "A C3D file has the byte 0x50 in second place",
    ".tsv": "A Qualisys TSV file starts with a key such as FILE_VERSION or NO_OF_FRAMES",
    ".csv": f'A CSV file must start with "{motive_csv.START}" (Motive), "{points_csv.HEADER}", or have columns such as '
    "Name-X,Name-Y,Name-Z",
}

TITLES: dict[Callable[[Path], Recording], str] = {
    trc.read: "TRC",
    c3d.read: "C3D",
    qualisys_tsv.read: "Qualisys TSV",
    motive_csv.read: "Motive CSV",
    wide_csv.read: "wide CSV",
    points_csv.read: "points.csv",
    take.read: take.TITLE,
}


def read_recording(path: str | Path) -> Recording:
    """A motion file or a take, in metres and Y up.

    Raises FormatError, and TakeError for a take that cannot be opened.
    """
    path = Path(path)
    try:
        with open_file(path) as stream:
            head = stream.read(HEAD_BYTES)
    except OSError as error:
        raise FormatError(
            f"{path.name} cannot be read ({error.strerror or error}).", "Choose an existing file."
        ) from error
    reader = _reader(path, head)
    return replace(reader(path), format=TITLES[reader])


def _is_with(delimiter: str, text: str, first: str) -> bool:
    """Whether a file's start is one of Motive's or of points.csv with another character between columns."""
    if delimiter not in text:
        return False
    is_points = first.replace(delimiter, ",").replace(" ", "").lower() in points_csv.HEADERS
    return is_points or motive_csv.recognises(text.replace(delimiter, ","))


def _reader(path: Path, head: bytes) -> Callable[[Path], Recording]:
    if not head:
        raise FormatError(f"{path.name} is empty (0 bytes).", "Export it again.")
    if head.startswith(take.MAGIC) or path.suffix.lower() == take.EXTENSION:
        return take.read
    if c3d.recognises(head):
        return c3d.read
    text = decode_head(head)
    first = text.lstrip().partition("\n")[0].strip()
    if bvh.recognises(text):
        raise FormatError(
            f"{path.name} holds rotations of bones (BVH) and no markers.",
            "Play it as a device: that gives what a glove would send.",
        )
    if trc.recognises(text):
        return trc.read
    if qualisys_tsv.recognises(text):
        return qualisys_tsv.read
    if motive_csv.recognises(text):
        return motive_csv.read
    if first.replace(" ", "").lower() in points_csv.HEADERS:
        return points_csv.read
    for delimiter, word in ((";", "semicolons"), ("\t", "tabs")):
        if _is_with(delimiter, text, first):
            raise FormatError(
                f"{path.name} separates its columns with {word} (a spreadsheet saved it).",
                "Export it again, or save it with commas between columns and points in numbers.",
            )
    if wide_csv.recognises(text):
        return wide_csv.read
    words = " ".join(first.split())
    shown = words[:40] if words.isprintable() else head[:8].hex(" ")
    expected = EXPECTED_START.get(path.suffix.lower())
    raise FormatError(
        f"{path.name} starts with {shown!r}, which no known motion file does.",
        f"{expected}. Export it again." if expected else f"Phalanx reads {READABLE}.",
    )
