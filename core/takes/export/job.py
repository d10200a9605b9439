"""The export of a solution to a folder: every format written, read back, compared, and only then given its name."""

from __future__ import annotations

import os
import shutil
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from core.disk_error import remedy, why
from core.errors import ExportError
from core.takes.drafts import EXPORT, Draft
from core.takes.export.content import Content, look_through
from core.takes.export.counted import neutral_facts, neutral_words
from core.takes.export.csv_tables import ANGLES
from core.takes.export.formats import FORMATS, HELD, HOLES, MARKS, Format, kept
from core.takes.export.options import DEFAULT, ExportOptions
from core.takes.export.progress import Callback, Progress
from core.takes.export.record import clear_earlier, file_entry, write_record
from core.takes.new_file import put_new
from core.takes.part import part_of
from core.takes.solution import Solution
from core.words import listed

_LOOK = 0.1  # share of the work that is looking through the frames


@dataclass
class Exported:
    """What became of an export.

    files: those written, in the order of the formats. failed: why a format could not be written, by its name. notes:
    sentences on options that a format does not follow, and on streams that are in no file. warnings: sentences on what
    the recording's times make of the files, and on frames without a pose. neutral: phrases on the neutral trials that
    angles.csv counts from. record: the file that says what was exported, None where nothing was.
    """

    files: list[Path] = field(default_factory=list)
    failed: dict[str, ExportError] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    neutral: list[str] = field(default_factory=list)
    record: Path | None = None

    @property
    def error(self) -> ExportError | None:
        """All that failed, in one."""
        errors = list({error.what: error for error in self.failed.values()}.values())
        if len(errors) < 2:
            return errors[0] if errors else None
        return ExportError(" ".join(error.what for error in errors), errors[0].action)


def export(
    solution: Solution,
    formats: Sequence[str],
    directory: Path | str,
    progress: Callback | None = None,
    overwrite: bool = False,
    options: ExportOptions = DEFAULT,
) -> list[Path]:
    """As export_each, for callers who need every format: returns the files, in order. Raises what failed, once the
    others are written."""
    exported = export_each(solution, formats, directory, progress, overwrite, options)
    if exported.error is not None:
        raise exported.error
    return exported.files


def export_each(
    solution: Solution,
    formats: Sequence[str],
    directory: Path | str,
    progress: Callback | None = None,
    overwrite: bool = False,
    options: ExportOptions = DEFAULT,
) -> Exported:
    """Writes the formats asked for into `directory`, which is made if need be.

    progress: called with the share done and a text; returning False, or raising, cancels. A recording with marks has
    one file more (marks_csv), and so has one with time without frames, which says where (holes_csv), for most formats
    cannot. Beside BVH and glTF one says where they hold a pose (held_csv). Formats that were finished before a cancel
    stay, with what goes beside them and the record of them; of the others nothing does. Where one cannot be written,
    the others are.

    Raises ExportError for what concerns all formats (one that is unknown, a file that exists unless `overwrite`, a part
    without frames, a folder that cannot be made) and CancelledError.
    """
    formats = _known(formats)
    solution = part_of(solution, options.from_s, options.to_s)
    exported = Exported(failed=_impossible(solution, formats))
    possible = [name for name in formats if name not in exported.failed]
    if not possible:
        return exported
    telling = Progress(progress)
    with_raw = any(FORMATS[name].needs_raw for name in possible)
    content = look_through(solution, options, with_raw, telling.part(0.0, _LOOK))
    exported.failed.update(_without_hands(content, possible))
    possible = [name for name in possible if name not in exported.failed]
    exported.notes += kept(possible, options)
    if solution.left_out:
        exported.notes.append(solution.left_out)
    exported.warnings += content.warnings
    if any(not FORMATS[name].needs_raw for name in possible):
        exported.warnings += content.without_pose
    if possible:
        _write_all(exported, content, possible, Path(directory), overwrite, telling)
    return exported


def clear_drafts(directory: Path | str, pid: int) -> None:
    """Removes what the exports of a process left that was ended in the middle of them."""
    for folder in Path(directory).glob(_drafts(pid) + "*"):
        shutil.rmtree(folder, ignore_errors=True)


def _drafts(pid: int) -> str:
    return f"{EXPORT}{pid}-"


def _known(formats: Sequence[str]) -> list[str]:
    unknown = [name for name in formats if name not in FORMATS]
    if unknown or not formats:
        raise ExportError(
            f"{unknown[0]!r} is no export format." if unknown else "No export format was chosen.",
            f"Choose of {', '.join(FORMATS)}.",
        )
    return list(dict.fromkeys(formats))


def _write_all(
    exported: Exported, content: Content, formats: Sequence[str], directory: Path, overwrite: bool, telling: Progress
) -> None:
    beside = _beside(content, formats)
    chosen = {name: FORMATS[name] for name in formats} | beside
    targets = {name: [directory / file for file in kind.names(content)] for name, kind in chosen.items()}
    if not overwrite:
        _check_free([path for paths in targets.values() for path in paths])
    try:
        directory.mkdir(parents=True, exist_ok=True)
        draft = Draft(_drafts(os.getpid()), directory)
    except OSError as error:
        raise _disk_error(directory, error) from error
    folder = draft.path
    done: dict[str, list[Path]] = {}
    silent = Progress(None)  # what is written beside the formats takes no time, and no cancel comes between them
    width = (1.0 - _LOOK) / len(formats)
    try:
        for i, name in enumerate(formats):
            part = telling.part(_LOOK + i * width, min(_LOOK + (i + 1) * width, 1.0))
            with _failing(exported, name, directory):
                done[name] = _write_one(FORMATS[name], content, targets[name], folder, overwrite, part)
            if name not in done:
                continue
            # At once, not at the end: whatever stops the export later, each file that is there is told of.
            for other in beside:
                if other in done or other in exported.failed:
                    continue
                if other != "held" or FORMATS[name].needs_hands:  # else it would speak of files that are not there
                    with _failing(exported, other, directory):
                        done[other] = _write_one(chosen[other], content, targets[other], folder, overwrite, silent)
            exported.files = [path for one in chosen for path in done.get(one, ())]
            if "csv" in done and content.options.neutral:
                exported.neutral = list(neutral_words(content.cast))
            with _failing(exported, "record", directory):
                if overwrite:
                    clear_earlier(content, directory, _renewed(done, exported), exported.files)
                entries = [
                    _entry(one, chosen[one], content, k, path)
                    for one in chosen
                    for k, path in enumerate(done.get(one, ()))
                ]
                exported.record = write_record(content, directory, entries, folder, exported.warnings)
    except OSError as error:
        raise _disk_error(directory, error) from error
    finally:
        draft.close()


def _beside(content: Content, formats: Sequence[str]) -> dict[str, Format]:
    """What goes beside the formats."""
    beside: dict[str, Format] = {}
    if any(FORMATS[name].needs_hands for name in formats) and content.all_held:
        beside["held"] = HELD
    if content.solution.marks:
        beside["marks"] = MARKS
    if len(content.solution.holes):
        beside["holes"] = HOLES
    return beside


@contextmanager
def _failing(exported: Exported, name: str, directory: Path) -> Iterator[None]:
    """What cannot be written is kept in mind, and the rest goes on."""
    try:
        yield
    except OSError as error:
        exported.failed[name] = _disk_error(directory, error)
        exported.failed[name].__cause__ = error
    except ExportError as error:
        exported.failed[name] = error


def _renewed(written: Collection[str], exported: Exported) -> set[str]:
    """The formats of which the files of an earlier export are out of date, with what goes beside them."""
    done = {name for name in written if name in FORMATS}
    beside = {"marks", "holes"} | ({"held"} if any(FORMATS[name].needs_hands for name in done) else set())
    return done | (beside - exported.failed.keys())


def _write_one(
    kind: Format, content: Content, targets: Sequence[Path], folder: Path, overwrite: bool, progress: Progress
) -> list[Path]:
    """The files of one format, all of them or none."""
    drafts = [folder / target.name for target in targets]
    kind.write(kind.content_of(content), drafts, progress)
    if overwrite:
        for draft, target in zip(drafts, targets, strict=True):
            os.replace(draft, target)  # noqa: PTH105 - says that it replaces
        return list(targets)
    put: list[Path] = []
    try:
        for draft, target in zip(drafts, targets, strict=True):
            put_new(draft, target)
            put.append(target)
    except OSError as error:
        for target in put:
            target.unlink(missing_ok=True)
        if isinstance(error, FileExistsError):  # another export into this folder was faster
            raise _taken(targets[len(put) :]) from error
        raise
    return list(targets)


def _entry(name: str, kind: Format, content: Content, k: int, path: Path) -> dict[str, Any]:
    """k: which of its files."""
    options = content.options
    rate_hz = content.grid.rate_hz if kind.even or (options.rate_hz and kind.follows("rate_hz")) else None
    facts: dict[str, Any] = {}
    if kind.needs_hands:
        facts["bones"] = options.bones
    if kind.unit:
        facts |= {"unit": kind.unit_of(options), "up": options.up if kind.follows("up") else "y"}
    if path.name == ANGLES.file_name and (neutral := neutral_facts(content)):
        facts["neutral"] = neutral
    frames = kind.n_frames(content)[k] if kind.unit else None
    return file_entry(content, name, path, rate_hz if kind.unit else None, frames, **facts)


def _impossible(solution: Solution, formats: Sequence[str]) -> dict[str, ExportError]:
    """The formats for which there are no frames."""
    failed: dict[str, ExportError] = {}
    for name in formats:
        if solution.beside and not len(solution.raw) and not len(solution.solved):
            others = listed(list(solution.beside))
            failed[name] = ExportError(
                f"{solution.name} holds no frames of markers that were to be solved, only of {others}.",
                "Choose a take in which an optical system was solved.",
            )
        elif FORMATS[name].needs_raw and not len(solution.raw):
            failed[name] = ExportError(f"{solution.name} holds no raw frames.", "Export another format than points.")
        elif not FORMATS[name].needs_raw and not len(solution.solved):
            failed[name] = ExportError(
                f"{solution.name} holds no solved frames.", "Solve it first, or export its points."
            )
    return failed


def _without_hands(content: Content, formats: Sequence[str]) -> dict[str, ExportError]:
    """The formats for which there is no motion."""
    empty = [name for name in formats if FORMATS[name].needs_hands]
    if not empty or content.tracked:
        return {}
    error = ExportError(
        f"No hand was tracked in any of the {content.timeline.n_frames:,} frames of {content.solution.name}; "
        f"there is no motion for {' and '.join(empty)}.",
        "Solve it again with the right profile, or export points.",
    )
    return dict.fromkeys(empty, error)


def _check_free(paths: Sequence[Path]) -> None:
    taken = [path for path in paths if os.path.lexists(path)]
    if taken:
        raise _taken(taken)


def _taken(paths: Sequence[Path]) -> ExportError:
    more = f" and {len(paths) - 1} more" if len(paths) > 1 else ""
    return ExportError(
        f"{paths[0]} exists already{more}.",
        "Choose another folder, or have files of an earlier export replaced (--overwrite on the command line).",
    )


def _disk_error(directory: Path, error: OSError) -> ExportError:
    return ExportError(f"The export to {directory} failed ({why(directory, error)}).", remedy(error))
