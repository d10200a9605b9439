"""`run.json`, beside every result of `phalanx track`: what it came from, how it was made, and what came out.

All of it but `run` is the same every time the same is done on the same machine. NAME_export.json says what each file
is (unit, rate, options); this says where they come from.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from app.commands.result import plain
from app.restored import restored
from app.run_methods import methods
from app.tracking_figures import TrackFigures
from core.errors import FormatError
from core.printable import printable_json
from core.takes.export.record import RECORD as EXPORT_RECORD
from core.takes.made import file_sha256
from core.takes.take import program_version
from core.untrusted.json_text import read_json

NAME = "run.json"
FORMAT, VERSION = "phalanx-run", 1
DECIDING = ("program_version", "input", "profiles", "settings")
"""What decides the bytes of a result, of the keys of a record."""

_LIBRARIES = ("numpy", "scipy", "numba", "onnxruntime")
_NOT_KEPT = ("file", "files", "speed")  # of the figures: said elsewhere, or another one each time
_LARGEST = 1 << 24  # bytes; a record that claims more is none


@dataclass(frozen=True)
class Origin:
    """What a result comes from: the values of DECIDING.

    input: name, bytes and sha256 of the recording's file. profiles: of each performer (app.run_origin). settings: every
    option of the command that can change a value of a result, by name.
    """

    input: Mapping[str, Any]
    profiles: Sequence[Mapping[str, Any]]
    settings: Mapping[str, Any]

    @property
    def deciding(self) -> dict[str, Any]:
        """As it stands in a record."""
        said = {"program_version": program_version(), **{name: getattr(self, name) for name in DECIDING[1:]}}
        return json.loads(json.dumps(plain(said)))


def record_of(
    origin: Origin,
    formats: Sequence[str],
    figures: TrackFigures,
    folder: Path,
    command: Sequence[str],
    judged_by: Mapping[str, Any],
    seconds: float,
    kept: Sequence[Mapping[str, Any]] = (),
) -> dict[str, Any]:
    """formats: of the exchange files. folder: the files that are there are the result. command: as typed, for this file
    alone. judged_by: options that change no file, but what is said of them. seconds: that it took. kept: entries of
    files that stay from an earlier run of the same. Raises OSError."""
    found = {name: value for name, value in plain(figures).items() if name not in _NOT_KEPT}
    known = {name: number for name in _LIBRARIES if (number := _version_of(name))}
    deciding = origin.deciding
    files = [*kept, *({"file": path.name, "sha256": file_sha256(path)} for path in sorted(folder.iterdir()))]
    return {
        "format": FORMAT,
        "version": VERSION,
        "program": "Phalanx",
        **deciding,
        "formats": list(formats),
        "judged_by": plain(judged_by),
        "figures": found,
        "files": files,
        "methods": methods(deciding, found, [entry["file"] for entry in files]),
        "made_on": {"python": platform.python_version(), **known, "platform": platform.platform()},
        "run": {
            "command": list(command),
            "date_utc": datetime.now(UTC).isoformat(timespec="seconds"),
            "seconds": round(seconds, 3),
        },
    }


def _version_of(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:  # in a bundle
        return ""


def write_record(record: Mapping[str, Any], folder: Path) -> None:
    """Raises OSError."""
    text = printable_json(json.dumps(record, ensure_ascii=False, allow_nan=False, indent=1)) + "\n"
    (folder / NAME).write_text(text, encoding="utf-8", newline="\n")


def read_record(folder: Path) -> dict[str, Any] | None:
    """The record in a folder, None for none. Raises FormatError for a file of this name that is something else."""
    path = folder / NAME
    if not path.exists():
        return None
    try:
        record = read_json(path, str(path), "", _LARGEST)
    except FormatError as error:
        raise _not_ours(path) from error
    if not isinstance(record, dict) or record.get("format") != FORMAT:
        raise _not_ours(path)
    return record


def is_whole(
    record: Mapping[str, Any], folder: Path, formats: Sequence[str], take: str, judged_by: Mapping[str, Any]
) -> bool:
    """Whether every file of a result is there as it was written, with all formats asked for, and was judged in the same
    way. take: the name of the take that should be among them, "" for none."""
    try:
        entries = {entry["file"]: entry["sha256"] for entry in record["files"]}
        if record["figures"]["failed"] or not set(formats) <= set(record["formats"]) or (take and take not in entries):
            return False
        if record["judged_by"] != plain(judged_by):
            return False
        names = [name for name in entries if name == Path(name).name]
        return len(names) == len(entries) and all(file_sha256(folder / name) == entries[name] for name in names)
    except (OSError, KeyError, TypeError, AttributeError):
        return False


def figures_in(record: Mapping[str, Any], path: Path, folder: Path) -> TrackFigures | None:
    """The figures of a result that was made before; None where the record lacks them. path: of the recording."""
    try:
        names = [entry["file"] for entry in record["files"] if not entry["file"].endswith(EXPORT_RECORD)]
        said = record["figures"] | {"file": path, "files": [folder / name for name in names]}
        figures: TrackFigures = restored(said, TrackFigures)
    except (KeyError, TypeError, ValueError, AttributeError):
        return None
    return figures


def _not_ours(path: Path) -> FormatError:
    return FormatError(
        f"{path} is no record of a run of Phalanx.", "Move it away, or choose another folder with --out."
    )
