"""What is done with takes in a process of its own. Arguments and results are plain values, as JSON has them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from app.hand_tally import HandTally
from app.labels import cast_labels
from app.left_out import LeftOutTally
from app.tracking_doubts import check_performers, doubts
from core.cast import Cast, hands_of
from core.errors import FormatError, TakeError
from core.frames import MarkerFrame, TrackedFrame
from core.gap_filling import filled
from core.labelling.given import Names
from core.labelling.name_check import believed, check_names, check_sides
from core.profile import Profile
from core.recording import Recording
from core.takes.export import ExportOptions, export_each
from core.takes.formats import read_recording
from core.takes.holes import holes_of
from core.takes.imported import info_of
from core.takes.new_file import put_new
from core.takes.part import frames_of
from core.takes.reader import open_take
from core.takes.reprocess import relabelled_each, solve_each
from core.takes.seal import COPY_SUFFIX, counts_found, write_sealed
from core.takes.solution import Solution
from core.takes.take import Mark
from core.takes.whole import Pair, write_take

Progress = Callable[[float, str], None]
"""Told the share done, 0 to 1, and what is being done."""

_SOLVING = 0.85  # of the work of solve_take; the rest is sealing
_TELL_EVERY = 20
_KEPT = 1_000
"""Solved frames of an import that are kept, spread over it: the sides of hands are judged by a few of them."""

SEVERAL = (
    "Import it again with a profile for each performer; labels begin with the name in the profile, or with 1, 2, ..."
)


def solve_take(path: str, target: str, profiles: Sequence[str], live_labels: bool, progress: Progress) -> None:
    """Solve every raw frame of a take anew, into a new take: the same frames and words with the new solution, its gaps
    filled.

    profiles: their texts, of each performer. live_labels: name points as live; else from the whole of the take. Raises
    FormatError and TakeError; `target` is then not there.
    """
    wanted = [Profile.from_json(profile, "The profile to solve with") for profile in profiles]
    with open_take(path) as take:
        n = len(take.raw)
        if not n:
            raise TakeError(f"Take {path} holds no frames of a stream to solve.", "There is nothing to solve.")
        if live_labels:
            pairs = solve_each(_told(take.raw, n, progress), wanted, fill=True)
        else:
            pairs = relabelled_each(take.raw, wanted, lambda share, text: progress(_SOLVING * share, text), fill=True)
        counts = take.counts or counts_found(take)
        write_take(
            target,
            take.info,
            tuple(wanted),
            pairs,
            take.marks,
            lambda tracked: replace(counts, written=n, solved=n, unsolved={}, tracked=tracked.by_hand),
            lambda share: progress(_SOLVING + (1 - _SOLVING) * share, "Checking the solution"),
            take,
        )


def _told(frames: Iterable[MarkerFrame], n: int, progress: Progress) -> Iterator[MarkerFrame]:
    """The same frames; told as they go in, for filling gaps lets them out seconds later."""
    for i, frame in enumerate(frames):
        if i % _TELL_EVERY == 0:
            progress(_SOLVING * i / n, f"Solving frame {i:,} of {n:,}")
        yield frame


def import_take(
    path: str, target: str, profiles: Sequence[str], live_labels: bool, progress: Progress
) -> dict[str, Any]:
    """Solve a recording of another program and write it as a take. Tells what its reader has to say of it, and what
    there is to doubt of the hands found in it, in sentences.

    profiles, live_labels: as in solve_take; labels that the file gives are taken where they fit. Raises FormatError and
    TakeError; `target` is then not there.
    """
    wanted = tuple(Profile.from_json(profile, "The profile to solve with") for profile in profiles)
    source = Path(path)
    progress(0.0, "Reading")
    recording = read_recording(source)
    frames = list(recording.frames())
    if not frames:
        raise FormatError(f"{source.name} holds no frames.", "There is nothing to import.")
    try:
        check_performers(source.name, recording, wanted)
    except FormatError as error:
        raise FormatError(error.what, SEVERAL) from None
    labels = cast_labels(recording, wanted)
    faults = check_names(frames, recording.rate_hz, wanted, labels) if labels is not None else ()
    named, names = believed(frames, labels, faults) if labels is not None else (frames, None)
    if labels is not None or live_labels:
        pairs = solve_each(_told(named, len(named), progress), wanted, names)
    else:
        pairs = relabelled_each(frames, wanted, lambda share, text: progress(_SOLVING * share, text))

    def written(pairs: Iterable[Pair]) -> _Seen:
        seen = _Seen(recording, wanted, names or {}, len(frames))
        write_take(
            target,
            info_of(source, recording, wanted, Path(target).stem),
            wanted,
            _filled(pairs, wanted, seen),
            (),
            sealing=lambda share: progress(_SOLVING + (1 - _SOLVING) * share, "Checking the take"),
        )
        return seen

    seen = written(pairs)
    if labels is None:
        faults = check_sides(seen.raw, seen.solved, wanted)
        if {fault.hand for fault in faults} == set(hands_of(wanted)):  # no hand is what it was asked for
            Path(target).unlink()
            seen = written(solve_each(frames, wanted, {}))
    expected = len(frames) + holes_of(recording.times_s, recording.rate_hz).missing
    hands = seen.tally.hands(recording.times_s, expected)
    found = doubts(recording, wanted, labels, False, hands, faults, seen.left_out.counts)
    return {
        "frames": len(frames),
        "labels_given": labels is not None,
        "warnings": list(recording.warnings),
        "doubts": [doubt.text for doubt in found],
    }


class _Seen:
    """What became of a recording, frame by frame as it is solved. raw, solved: some of its frames."""

    def __init__(self, recording: Recording, cast: Cast, names: Names, n_frames: int) -> None:
        self.tally, self.left_out = HandTally(cast), LeftOutTally(recording, names)
        self.raw: list[MarkerFrame] = []
        self.solved: list[TrackedFrame] = []
        self._step = max(1, n_frames // _KEPT)

    def add(self, raw: MarkerFrame, solved: TrackedFrame) -> None:
        """The next frame."""
        if self.tally.frames % self._step == 0:
            self.raw.append(raw)
            self.solved.append(solved)
        self.tally.add(solved)
        self.left_out.add(raw.ids, solved)


def _filled(pairs: Iterable[Pair], cast: Sequence[Profile], seen: _Seen) -> Iterator[Pair]:
    """The same frames with their gaps filled; counted before that, for what fills a gap was not seen."""
    held: deque[MarkerFrame] = deque()

    def counted() -> Iterator[TrackedFrame]:
        for raw, solved in pairs:
            held.append(raw)
            seen.add(raw, solved)
            yield solved

    for whole in filled(counted(), cast):
        yield held.popleft(), whole


def save_take(
    path: str, target: str, name: str, notes: str, rating: str, marks: Sequence[tuple[float, str]], progress: Progress
) -> None:
    """Write a take under another name, with its words of now. Raises TakeError; never overwrites."""
    copy = Path(target + COPY_SUFFIX)  # not a take's name, should this be interrupted
    with open_take(path) as take:
        info = replace(take.info, name=name, notes=notes, rating=rating)
        counts = take.counts or counts_found(take)
        try:
            write_sealed(
                take, copy, info, counts, [Mark(*mark) for mark in marks], lambda share: progress(share, "Saving")
            )
            put_new(copy, Path(target))
        except FileExistsError as error:
            raise TakeError(f"Take {target} exists already.", "Takes are never overwritten: save it again.") from error
        except OSError as error:
            raise TakeError(
                f"Take {target} cannot be created ({error.strerror or error}).",
                "Choose a folder that can be written to and has room.",
            ) from error
        finally:
            copy.unlink(missing_ok=True)


def export_take(
    path: str, first: int, last: int, formats: Sequence[str], folder: str, overwrite: bool,
    options: Mapping[str, Any], words: Mapping[str, Any] | None, progress: Progress,
) -> dict[str, Any]:  # fmt: skip
    """Export raw frames `first` to `last` of a take, both included: its files, what failed and what there is to say.
    words: its notes, rating and marks of now.
    Raises ExportError for what concerns all formats."""
    with open_take(path) as take:
        solution = Solution.of_take(take)
        if words is not None:  # a solution made again has the words of when it was made
            info = replace(take.info, notes=words["notes"], rating=words["rating"])
            solution = replace(solution, info=info, marks=[Mark(*mark) for mark in words["marks"]])
        part = frames_of(solution, first, last)
        exported = export_each(part, formats, folder, progress, overwrite, ExportOptions(**options))
    return {
        "files": [str(file) for file in exported.files],
        "failed": {name: (error.what, error.action) for name, error in exported.failed.items()},
        "notes": exported.notes,
        "warnings": exported.warnings,
        "neutral": exported.neutral,
        "record": str(exported.record or ""),
    }


TASKS: dict[str, Callable[..., Any]] = {
    "solve": solve_take, "import": import_take, "save": save_take, "export": export_take,
}  # fmt: skip
