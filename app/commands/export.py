"""`phalanx export TAKE...`: other formats, each written file read back and compared."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.commands.export_options import (
    FORMATS_HELP,
    add_export_options,
    folders_of,
    formats,
    options_of,
    tell,
    tell_notes,
)
from app.commands.out import out_folder
from app.commands.result import Exit, Result
from app.commands.terminal import Progress, say
from core.printable import printable

if TYPE_CHECKING:
    from core.takes.export import ExportOptions


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser(
        "export",
        help="write takes in other formats",
        description="Writes takes in other formats; each file is read back and compared before it counts as done. The "
        "files are named after the take's file; those of several takes go into DIR/<name of the file>/. Where one "
        "format or take cannot be written the others are, and the exit status is 1. Exit status 3: a take has time "
        "without frames.",
    )
    parser.add_argument("takes", metavar="TAKE", nargs="+", type=Path)
    parser.add_argument("--to", metavar="FORMATS", type=formats, required=True, help=FORMATS_HELP)
    parser.add_argument("--out", metavar="DIR", type=out_folder, required=True, help="folder for the files")
    parser.add_argument("--overwrite", action="store_true", help="replace files that are there already")
    parser.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    add_export_options(parser)
    parser.set_defaults(run=run, refuse=parser.error)


def run(arguments: argparse.Namespace) -> Result:
    """One line per file; what cannot be written does not stop the rest, and fails the command at its end."""
    from core.errors import CancelledError, PhalanxError

    chosen, options = arguments.to, options_of(arguments)
    folders = folders_of(arguments.takes, arguments.out, each=len(arguments.takes) > 1)
    done: list[dict[str, Any]] = []
    for path, folder in folders.items():
        try:
            done.append(_export(path, folder, chosen, options, arguments.overwrite, several=len(folders) > 1))
        except CancelledError:
            raise
        except PhalanxError as error:
            if len(folders) == 1:
                raise
            say(f"phalanx: {error}" if path.name in str(error) else f"phalanx: {path.name}: {error}")
            done.append({"take": path, "formats": chosen, "files": [], "failed": {"all": str(error)}})
    tell_notes({one["take"].name: one["notes"] for one in done if one["files"]})
    figures = done[0] if len(done) == 1 else {"takes": done}
    failed = any(one["failed"] for one in done)
    lost = any(len(one.get("holes", ())) for one in done)
    return Result(Exit.FAILED if failed else Exit.LOSS if lost else Exit.DONE, figures=figures)


def _export(
    path: Path, folder: Path, formats: tuple[str, ...], options: ExportOptions, overwrite: bool, several: bool
) -> dict[str, Any]:
    """The figures of one take. several: it is one of several. Raises FormatError, TakeError, ExportError."""
    from core.takes.export import export_each
    from core.takes.export.holes_csv import words
    from core.takes.part import part_of
    from core.takes.reader import open_take
    from core.takes.solution import Solution

    progress = Progress(f"Exporting {path.name}")
    with open_take(path) as take:
        solution = Solution.of_take(take)
        exported = export_each(solution, formats, folder, progress, overwrite, options)
        part = part_of(solution, options.from_s, options.to_s)
        frames, holes = len(part.solved), part.holes
        length_s = part.raw[-1].times.host_s - part.raw[0].times.host_s if len(part.raw) else 0.0
    progress.done()
    tell(exported, path.name if several else "")
    if len(holes) and exported.files:
        before = f"{printable(path.name)}: " if several else ""
        print(f"{before}{words(holes, length_s)} {printable(exported.files[-1].name)} says where.", flush=True)
    return {
        "take": path, "formats": formats, "frames": frames, "holes": holes, "files": exported.files,
        "record": exported.record, "notes": exported.notes, "warnings": exported.warnings,
        "neutral": exported.neutral,
        "failed": {name: str(error) for name, error in exported.failed.items()},
    }  # fmt: skip
