"""What was exported, from what and how, beside the files: `NAME_export.json`.

Plain CSV has no place for a rate, a unit or a performer, nor TRC for notes: this file says of each file beside it what
its own format cannot. An export into a folder that has one adds to it.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Collection, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from core.cast import props_of
from core.errors import ExportError, FormatError
from core.printable import printable_json
from core.takes.export.compare import mismatch
from core.takes.export.content import Content
from core.takes.take import program_version
from core.untrusted.json_text import read_json

RECORD = "_export.json"
"""What the names of all records end with."""

_PROGRAM = "Phalanx"
_LARGEST = 1 << 24  # bytes; a record that claims more is none


def record_name(content: Content) -> str:
    """One file for all formats."""
    return content.stem + RECORD


def write_record(
    content: Content, directory: Path, written: list[dict[str, Any]], folder: Path, warnings: Sequence[str]
) -> Path:
    """Adds what was written to the record in `directory`, by way of `folder`. Returns its path.

    written: of each new file what `file_entry` says. warnings: sentences on the recording. What the record says of
    other files stays where they do. Raises ExportError and OSError.
    """
    target, draft = directory / record_name(content), folder / record_name(content)
    new = {entry["file"] for entry in written}
    kept = [entry for entry in _known(target) if entry["file"] not in new and (directory / entry["file"]).is_file()]
    document = {
        "program": _PROGRAM, "version": program_version(), "recording": _recording(content, warnings),
        "files": kept + written,
    }  # fmt: skip
    text = printable_json(json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1)) + "\n"
    draft.write_text(text, encoding="utf-8", newline="\n")
    if draft.read_text(encoding="utf-8") != text:
        raise mismatch(target, "it differs")
    os.replace(draft, target)  # noqa: PTH105 - says that it replaces
    return target


def clear_earlier(content: Content, directory: Path, formats: Collection[str], written: Collection[Path]) -> None:
    """Removes what an earlier export into `directory` wrote of these formats and this one did not, such as a file of
    poses that are held where none is held any more: it would speak of files that are gone. Raises ExportError and
    OSError."""
    new = {path.name for path in written}
    for entry in _known(directory / record_name(content)):
        name = entry["file"]
        if entry.get("format") in formats and name not in new and name == Path(name).name:
            (directory / name).unlink(missing_ok=True)


def file_entry(
    content: Content, format_name: str, path: Path, rate_hz: float | None, frames: int | None, **facts: Any
) -> dict[str, Any]:
    """What is said of one file. rate_hz: of an even grid; None where each frame has its own time. frames: in this file,
    whatever the recording has; None where it holds none. facts: unit and up of its lengths, where it has any."""
    options = {key: value for key, value in asdict(content.options).items() if key in ("joints", "measured")}
    return {
        "file": path.name, "format": format_name, **facts,
        "rate_hz": rate_hz, "options": {key: True for key, value in options.items() if value},
        "from_s": content.solution.start_s, "frames": frames, "version": program_version(),
    }  # fmt: skip


def _recording(content: Content, warnings: Sequence[str]) -> dict[str, Any]:
    solution, info = content.solution, content.solution.info
    said = {}
    if info is not None:
        said = {
            "take": info.name, "performer": info.performer, "shot": info.shot, "rating": info.rating,
            "notes": info.notes, "created_utc": info.created_utc.isoformat(), "device": dict(info.device),
        }  # fmt: skip
    rate_hz = solution.rate_hz
    return {
        "name": solution.name,
        "file": solution.file,
        **({"file_sha256": content.made.source_sha256} if content.made.source_sha256 else {}),
        **said,
        **({"left_out": solution.left_out} if solution.left_out else {}),
        "rate_hz": rate_hz if math.isfinite(rate_hz) else content.timeline.rate_hz,
        "performers": [
            {
                "name": profile.performer,
                "layout": profile.layout.name,
                "sides": list(profile.sides),
                "called": called,
                "profile_sha256": sha256,
            }
            for profile, called, sha256 in zip(
                content.cast, content.performers, content.made.profiles_sha256, strict=True
            )
        ],
        **({"settings": dict(content.made.settings)} if content.made.settings else {}),
        "props": [prop.name for prop in props_of(content.cast)],
        "warnings": list(warnings),
    }


def _known(path: Path) -> list[dict[str, Any]]:
    """What an earlier export said of its files; nothing where that cannot be read. Raises ExportError for a file that
    is not ours."""
    if not path.exists():
        return []
    try:
        document = read_json(path, str(path), "", _LARGEST)
        entries = document["files"] if document["program"] == _PROGRAM else None
    except (FormatError, LookupError, TypeError) as error:
        raise _not_ours(path) from error
    if not isinstance(entries, list):
        raise _not_ours(path)
    return [entry for entry in entries if isinstance(entry, dict) and isinstance(entry.get("file"), str)]


def _not_ours(path: Path) -> ExportError:
    return ExportError(f"{path} is no record of an export.", "Move it away, or choose another folder.")
