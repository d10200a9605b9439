"""What the formats share: which hands a solution holds, and when its frames were."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from typing import TypeVar

import numpy as np

from core.cast import Cast, hands_of, performer_names, props_of
from core.errors import ExportError
from core.frames import BoolArray, HandFrame, HandKey, HandState, IntArray, MarkerFrame, Side, TrackedFrame
from core.sources import Codes, Sources
from core.takes.export.grid import Grid, grid_of
from core.takes.export.held import HeldSpan, held_spans
from core.takes.export.naming import file_stem, subject_names
from core.takes.export.options import DEFAULT, ExportOptions
from core.takes.export.progress import Progress
from core.takes.export.timeline import Timeline, timeline_of
from core.takes.export.turned import Turned, raw_to_z_up, solved_to_z_up
from core.takes.imported import FILE_KIND
from core.takes.made import Made, made_with
from core.takes.solution import Solution

PREFIX: dict[Side, str] = {"left": "L_", "right": "R_"}
"""Before the name of a marker or joint, where one file holds both hands."""

MOST_IN_MEMORY = 30_000
"""Frames; some 300 MB of two hands. Longer recordings are read from disk again for each format."""

T = TypeVar("T")


@dataclass(frozen=True)
class Content:
    """A solution, looked through once.

    raw, solved: its frames, in memory where they fit: formats go through them several times.
    timeline: of the solved frames, or of the raw ones where none is solved. tracked: hands tracked in any frame.
    scale: hand scale of each at the end of the recording, when the engine knows it best. shown: the frames in which
    each hand, and each prop by its name, is tracked. options: what was asked for. Frames are as they were solved, Y up,
    until `turned`.
    """

    solution: Solution
    raw: Sequence[MarkerFrame]
    solved: Sequence[TrackedFrame]
    timeline: Timeline
    tracked: tuple[HandKey, ...]
    scale: dict[HandKey, float]
    shown: Mapping[HandKey | str, Sequence[int]]
    options: ExportOptions = DEFAULT

    @cached_property
    def grid(self) -> Grid:
        """The even grid of formats that know only a rate, at the rate asked for."""
        return grid_of(self.timeline, self.options.rate_hz)

    @cached_property
    def turned(self) -> Content:
        """The same with Z up, if that is asked for. Frames that are in memory are not kept there twice."""
        if self.options.up == "y":
            return self
        return replace(self, raw=Turned(self.raw, raw_to_z_up), solved=Turned(self.solved, solved_to_z_up))

    def sources(self) -> Iterator[dict[HandKey, Codes]]:
        """Of each solved frame where the numbers of its poses come from, as core.sources tells; found out once."""
        yield from self._told
        for frame in islice(self.solved, len(self._told), None):
            self._told.append(self._sources.of(frame))
            yield self._told[-1]

    @cached_property
    def _told(self) -> list[dict[HandKey, Codes]]:
        return []

    @cached_property
    def _sources(self) -> Sources:
        return Sources(self.cast)

    @property
    def stem(self) -> str:
        """Of the names of its files."""
        return file_stem(self.solution.name)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on what the times of its frames make of the files."""
        return self.timeline.warnings

    @property
    def without_pose(self) -> tuple[str, ...]:
        """A sentence on the frames of the recording that have no pose: '61 of 638 frames have no pose: they were not
        solved.'; where that differs between hands, on each. () where all have."""
        total = max(len(self.solution.raw), len(self.solution.solved))
        unsolved = total - len(self.solution.solved)
        # A hand that never was there is not missing: it has no file and no mesh.
        hands = [hand for hand in self.hands if self.shown.get(hand)] or self.hands
        missing = {hand: total - len(self.shown.get(hand, ())) for hand in hands}
        if not any(missing.values()):
            return ()
        why = f" ({unsolved:,} {'was' if unsolved == 1 else 'were'} not solved)" if unsolved else ""
        none = total - len(set().union(*(self.shown.get(hand, ()) for hand in self.hands)))
        if len(set(missing.values())) == 1 and none in missing.values():
            verb = "has" if none == 1 else "have"
            if none == unsolved:
                why = ": it was not solved" if none == 1 else ": they were not solved"
            return (f"{none:,} of {total:,} frames {verb} no pose{why}.",)
        each = ", ".join(f"{self.words(hand)} hand {n:,}" for hand, n in missing.items() if n)
        return (f"Frames without a pose, of {total:,}: {each}{why}.",)

    def source_s(self, frame: int) -> float:
        """When a frame was by its device's clock, or in the file it came from [s]; NaN if that tells none."""
        frames = self.solved if len(self.solved) else self.raw
        return float(frames[frame].times.device_s)

    @property
    def of_file(self) -> bool:
        """Whether it comes from a file of another program, which said when its frames were."""
        info = self.solution.info
        return info is None or info.device.get("kind") == FILE_KIND

    @property
    def cast(self) -> Cast:
        """The profiles, in the order in which hands number them."""
        return self.solution.cast

    @cached_property
    def made(self) -> Made:
        """What the solution came from, as far as it is known."""
        return self.solution.made or made_with(self.cast)

    @cached_property
    def hands(self) -> tuple[HandKey, ...]:
        """Every hand of every performer, tracked or not."""
        return hands_of(self.cast)

    @cached_property
    def performers(self) -> tuple[str, ...]:
        """Their names in words; ("",) where there is one."""
        return performer_names(self.cast)

    @cached_property
    def subjects(self) -> tuple[str, ...]:
        """Their names as those of a marker or joint may begin; ("",) where there is one."""
        return subject_names(self.performers)

    def prefix(self, hand: HandKey) -> str:
        """Before the name of a marker or joint: "L_", with several performers "Anna:L_"."""
        subject = self.subjects[hand.performer]
        return (f"{subject}:" if subject else "") + PREFIX[hand.side]

    def words(self, hand: HandKey) -> str:
        """A hand in words: "left", with several performers "Anna left"."""
        return f"{self.performers[hand.performer]} {hand.side}".strip()

    def held(self, one: HandKey | str) -> tuple[HeldSpan, ...]:
        """From when to when BVH and glTF hold the pose of a hand, or of a prop, for want of one to show."""
        tracked = np.zeros(self.timeline.n_frames, dtype=np.bool_)
        tracked[list(self.shown.get(one, ()))] = True
        return held_spans(tracked, self.timeline)

    @cached_property
    def all_held(self) -> tuple[tuple[str, HeldSpan], ...]:
        """Those of every hand and prop that is tracked at all, with its name: "left hand", "Anna left hand", "pen"."""
        named = [(f"{self.words(hand)} hand", self.held(hand)) for hand in self.tracked]
        named += [(prop.name, self.held(prop.name)) for prop in props_of(self.cast)]
        return tuple((name, span) for name, spans in named for span in spans)


def look_through(solution: Solution, options: ExportOptions, with_raw: bool, progress: Progress) -> Content:
    """with_raw: the raw frames are to be written too. Raises ExportError if the frame rate cannot be found, or
    there are hands of a performer without a profile."""
    raw = solution.raw
    if with_raw:
        raw = _in_memory(raw, progress.part(0.0, 0.3), "Reading the raw frames")
    solved = _in_memory(solution.solved, progress.part(0.3, 1.0), "Reading the solved frames")
    cast = solution.cast
    scale: dict[HandKey, float] = {}
    unknown: set[int] = set()
    shown: dict[HandKey | str, list[int]] = {}

    def noting_hands() -> Iterator[TrackedFrame]:
        for i, frame in enumerate(solved):
            here: list[HandKey | str] = [hand.key for hand in frame.hands if hand.state is HandState.TRACKED]
            here += [prop.name for prop in frame.props if prop.tracked]
            for one in here:
                shown.setdefault(one, []).append(i)
            scale.update({hand.key: hand.scale for hand in frame.hands if hand.state is HandState.TRACKED})
            unknown.update(hand.performer for hand in frame.hands if hand.performer >= len(cast))
            yield frame

    timeline = timeline_of(noting_hands() if len(solved) else raw, solution.rate_hz)
    if len(raw):  # times of all files count from the first frame of the recording
        timeline = timeline.shifted(raw[0].times.host_s)
    if unknown:
        raise ExportError(
            f"{solution.name} holds hands of {max(unknown) + 1} performers, and the profiles of {len(cast)}.",
            "Solve it again with the profiles of all performers.",
        )
    tracked = tuple(hand for hand in hands_of(cast) if hand in scale)
    return Content(solution, raw, solved, timeline, tracked, scale, shown, options)


def _in_memory(frames: Sequence[T], progress: Progress, text: str) -> Sequence[T]:
    if len(frames) > MOST_IN_MEMORY:
        return frames
    return list(progress.over(frames, text))


def hand_of(frame: TrackedFrame, key: HandKey) -> HandFrame | None:
    """One hand, if it is tracked in this frame."""
    for hand in frame.hands:
        if hand.state is HandState.TRACKED and hand.key == key:
            return hand
    return None


def last_tracked(tracked: BoolArray) -> IntArray:
    """(n,) int64 from (n,) bool: for each frame the last one tracked until then, or else the first one ever."""
    frames = np.where(tracked, np.arange(len(tracked)), -1)
    held = np.maximum.accumulate(frames)
    return np.where(held < 0, int(np.argmax(tracked)), held).astype(np.int64)
