"""What a right frame is, and everything that is counted of labels over a stretch of frames.

A frame is right when every marker of every hand that the device saw carries its own name, every marker that it did not
see is called hidden, and so no ghost, no prop's marker and no point of the other hand carries the name of any. A hand
that is not tracked names nothing. Every frame counts, from the first on. (Han 2018, Table 5: "correctly labeled
frames", all labels right against those that a person had corrected.)
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from core.engine import Engine
from core.frames import NO_POINT, BoolArray, HandState, IntArray, MarkerFrame, TrackedFrame
from core.profile import Profile

UNNAMED = "seen but not named"
SWAPPED = "took another marker's point"
OTHER_HAND = "took the other hand's"
GHOST = "took a ghost"
"""What a marker that is not right did."""

SWAPPED_HAND = 0.5
"""A hand more of whose points than this share are the other hand's has changed its side."""


@dataclass(frozen=True)
class Truth:
    """Frames as a device sends them, and what their points are.

    title: what it is, with its seed. profiles: of the performers, as the engine is told them. wanted: (f, h, m) int64,
    row of the point of each marker of each hand, performer by performer in the order of their sides, NO_POINT where
    none was sent.
    """

    title: str
    profiles: tuple[Profile, ...]
    frames: list[MarkerFrame]
    wanted: IntArray

    @property
    def hands(self) -> list[str]:
        """The hands' names."""
        many = len(self.profiles) > 1
        return [
            f"{side} {p + 1}" if many else side for p, profile in enumerate(self.profiles) for side in profile.sides
        ]


@dataclass(frozen=True)
class Failure:
    """Consecutive frames with a wrong label. first: which; time_s: by the device's clock. what: hand, marker and what
    it did, each once, the most frequent first."""

    title: str
    first: int
    frames: int
    time_s: float
    what: tuple[tuple[str, str, str], ...]

    @property
    def line(self) -> str:
        """In one line."""
        shown = "; ".join(" ".join(one) for one in self.what[:6])
        more = f"; {len(self.what) - 6} more" if len(self.what) > 6 else ""
        return f"{self.title}, at {self.time_s:.3f} s for {self.frames} frames: {shown}{more}"


@dataclass(frozen=True)
class Verdict:
    """truth, and point: (f, h, m) int64, the row that each marker was given, NO_POINT for none."""

    truth: Truth
    point: IntArray

    @property
    def good(self) -> BoolArray:
        """(f, h, m) bool."""
        good: BoolArray = self.point == self.truth.wanted
        return good

    @property
    def right(self) -> BoolArray:
        """(f,) bool, frames with every label right."""
        right: BoolArray = self.good.all(axis=(1, 2))
        return right

    @property
    def seen_all_right(self) -> BoolArray:
        """(f,) bool, frames in which every marker that was seen carries its name, whatever hidden ones carry."""
        all_right: BoolArray = (self.good | (self.truth.wanted == NO_POINT)).all(axis=(1, 2))
        return all_right

    def seen_right(self) -> tuple[int, int]:
        """Markers that were seen and carry their name, and markers that were seen."""
        seen = self.truth.wanted != NO_POINT
        return int((seen & self.good).sum()), int(seen.sum())

    def hidden_right(self) -> tuple[int, int]:
        """Markers that were not seen and are called hidden, and markers that were not seen."""
        hidden = self.truth.wanted == NO_POINT
        return int((hidden & self.good).sum()), int(hidden.sum())

    def side_swaps(self) -> int:
        """How often a hand began to carry mostly points of other hands."""
        others = np.stack([self._others(h) for h in range(self.point.shape[1])], axis=1)
        given = (self.point != NO_POINT).sum(axis=2)
        swapped = others > SWAPPED_HAND * np.maximum(given, 1)
        return int(swapped[:1].sum() + (swapped[1:] & ~swapped[:-1]).sum())

    def stretches(self) -> list[tuple[int, int]]:
        """First and number of the frames of every stretch of wrong ones."""
        edges = np.flatnonzero(np.diff(np.concatenate([[False], ~self.right, [False]]).astype(np.int8)))
        return [(int(first), int(end - first)) for first, end in edges.reshape(-1, 2)]

    def failures(self) -> Iterator[Failure]:
        """Every stretch of wrong frames, told."""
        for first, frames in self.stretches():
            counts: Counter[tuple[str, str, str]] = Counter()
            for f in range(first, first + frames):
                counts.update(self._wrong(f))
            time_s = self.truth.frames[first].times.device_s
            yield Failure(self.truth.title, first, frames, time_s, tuple(what for what, _ in counts.most_common()))

    def causes(self) -> Counter[str]:
        """How many labels are wrong in which way."""
        return Counter(what for f in np.flatnonzero(~self.right) for _, _, what in self._wrong(int(f)))

    def _others(self, hand: int) -> IntArray:
        """(f,) how many of a hand's points are truly another hand's."""
        wanted, point = self.truth.wanted, self.point[:, hand]
        others = np.delete(wanted, hand, axis=1).reshape(len(wanted), -1)
        taken = (point[:, :, None] == others[:, None]) & (point[:, :, None] != NO_POINT)
        count: IntArray = taken.any(axis=2).sum(axis=1)
        return count

    def _wrong(self, f: int) -> Iterator[tuple[str, str, str]]:
        wanted, point = self.truth.wanted[f], self.point[f]
        names = self.truth.profiles[0].layout.marker_names
        for h, k in np.argwhere(wanted != point):
            row = point[h, k]
            if row == NO_POINT:
                what = UNNAMED
            elif (wanted[h] == row).any():
                what = SWAPPED
            elif (wanted == row).any():
                what = OTHER_HAND
            else:
                what = GHOST
            yield self.truth.hands[h], names[k], what


def wanted_of(truths: Sequence[IntArray], hands: int, markers: int) -> IntArray:
    """(f, hands, markers) int64: rows of the points of each marker. truths: of each frame (n,), the number of the
    marker that a point is, hand by hand; anything else for what is no hand's."""
    wanted = np.full((len(truths), hands * markers), NO_POINT, dtype=np.int64)
    for f, truth in enumerate(truths):
        own = np.flatnonzero((truth >= 0) & (truth < hands * markers))
        wanted[f, truth[own]] = own
    return wanted.reshape(len(truths), hands, markers)


def judged(truth: Truth, solved: Iterable[TrackedFrame]) -> Verdict:
    """What became of every frame."""
    place = {
        (performer, side): h
        for h, (performer, side) in enumerate(
            (performer, side) for performer, profile in enumerate(truth.profiles) for side in profile.sides
        )
    }
    point = np.full_like(truth.wanted, NO_POINT)
    for f, frame in enumerate(solved):
        for hand in frame.hands:
            if hand.state is HandState.TRACKED:
                point[f, place[hand.performer, hand.side]] = hand.point
    return Verdict(truth, point)


def tracked(truth: Truth) -> Verdict:
    """What an engine makes of the frames."""
    return judged(truth, map(Engine(truth.profiles).step, truth.frames))


def listed(verdicts: Iterable[Verdict], most: int) -> None:
    """Prints the longest wrong stretches."""
    failures = sorted((failure for one in verdicts for failure in one.failures()), key=lambda one: -one.frames)
    for failure in failures[:most]:
        print(f"      {failure.line}")
