"""The export of a solution to a folder: every format written, read back, compared, and only then given its name."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from core.errors import ExportError
from core.takes.export import bvh, c3d, csv_tables, gltf, held_csv, holes_csv, trc
from core.takes.export.content import Content, look_through
from core.takes.export.options import DEFAULT, ExportOptions
from core.takes.export.progress import Callback, Progress
from core.takes.solution import Solution

_LOOK = 0.1  # share of the work that is looking through the frames


@dataclass(frozen=True)
class Format:
    """names: the files it makes. write: writes them to the paths given and reads them back.

    needs_hands: there is nothing to write where no hand was ever tracked.
    """

    title: str
    names: Callable[[Content], list[str]]
    write: Callable[[Content, list[Path], Progress], None]
    needs_hands: bool = False


FORMATS: dict[str, Format] = {
    "c3d": Format("C3D, labelled markers", c3d.names, c3d.write),
    "trc": Format("TRC, measured markers", trc.names, trc.write),
    "csv": Format("CSV, markers, angles and joints", csv_tables.names, csv_tables.write),
    "points": Format("CSV, raw points", csv_tables.points_names, csv_tables.write_points),
    "bvh": Format("BVH, skeleton of each hand", bvh.names, bvh.write, needs_hands=True),
    "gltf": Format("glTF, animated hands", gltf.names, gltf.write, needs_hands=True),
}


_HELD = Format("CSV, from when to when a pose is held", held_csv.names, held_csv.write)
_HOLES = Format("CSV, time without frames", holes_csv.names, holes_csv.write)


def export(
    solution: Solution,
    formats: Sequence[str],
    directory: Path | str,
    progress: Callback | None = None,
    overwrite: bool = False,
    options: ExportOptions = DEFAULT,
) -> list[Path]:
    """Writes the formats asked for into `directory`, which is made if need be; returns the files, in order.

    progress: called with the share done and a text; returning False, or raising, cancels. A recording with time
    without frames has one file more, which says where (holes_csv), for most formats cannot. Formats that were finished
    before a failure or a cancel stay; of the others nothing does.

    Raises ExportError (an unknown format, a file that exists unless `overwrite`, a disk that fails, a file that does
    not read back equal) and CancelledError.
    """
    formats = _known(solution, formats)
    telling = Progress(progress)
    content = look_through(solution, options, "points" in formats, telling.part(0.0, _LOOK))
    _check_possible(content, formats)
    directory = Path(directory)
    chosen = [FORMATS[name] for name in formats]
    if any(FORMATS[name].needs_hands for name in formats) and held_csv.needed(content):
        chosen.append(_HELD)
    if len(solution.holes):
        chosen.append(_HOLES)
    targets = [[directory / file for file in kind.names(content)] for kind in chosen]
    if not overwrite:
        _check_free([path for paths in targets for path in paths])
    try:
        directory.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(prefix=_drafts(os.getpid()), dir=directory))
    except OSError as error:
        raise _disk_error(directory, error) from error
    done: list[Path] = []
    ends = np.linspace(_LOOK, 1.0, len(formats) + 1).tolist() + [1.0] * (len(chosen) - len(formats))
    try:
        for kind, wanted, begin, end in zip(chosen, targets, ends, ends[1:], strict=False):
            drafts = [folder / target.name for target in wanted]
            kind.write(content, drafts, telling.part(begin, end))
            if not overwrite:
                _check_free(wanted)
            for draft, target in zip(drafts, wanted, strict=True):
                os.replace(draft, target)  # noqa: PTH105 - says that it replaces
                done.append(target)
    except OSError as error:
        raise _disk_error(directory, error) from error
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return done


def clear_drafts(directory: Path | str, pid: int) -> None:
    """Removes what the exports of a process left that was ended in the middle of them."""
    for folder in Path(directory).glob(_drafts(pid) + "*"):
        shutil.rmtree(folder, ignore_errors=True)


def _drafts(pid: int) -> str:
    return f".export-{pid}-"


def _known(solution: Solution, formats: Sequence[str]) -> list[str]:
    unknown = [name for name in formats if name not in FORMATS]
    if unknown or not formats:
        raise ExportError(
            f"{unknown[0]!r} is no export format." if unknown else "No export format was chosen.",
            f"Choose of {', '.join(FORMATS)}.",
        )
    if not len(solution.solved) and any(name != "points" for name in formats):
        raise ExportError(f"{solution.name} holds no solved frames.", "Solve it first, or export its points.")
    if not len(solution.raw) and "points" in formats:
        raise ExportError(f"{solution.name} holds no raw frames.", "Export another format than points.")
    return list(dict.fromkeys(formats))


def _check_possible(content: Content, formats: Sequence[str]) -> None:
    empty = [name for name in formats if FORMATS[name].needs_hands]
    if empty and not content.tracked:
        raise ExportError(
            f"No hand was tracked in any of the {content.timeline.n_frames} frames of {content.solution.name}; "
            f"there is no motion for {' and '.join(empty)}.",
            "Solve it again with the right profile, or export points.",
        )


def _check_free(paths: Sequence[Path]) -> None:
    taken = [path for path in paths if path.exists()]
    if taken:
        more = f" and {len(taken) - 1} more" if len(taken) > 1 else ""
        raise ExportError(
            f"{taken[0]} exists already{more}.", "Choose another folder, or allow the files to be replaced."
        )


def _disk_error(directory: Path, error: OSError) -> ExportError:
    return ExportError(
        f"The export to {directory} failed ({error.strerror or error}).",
        "Check its free space and permissions, or choose another folder.",
    )
