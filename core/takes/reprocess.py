"""Solving a recording or a take offline, with the engine that runs live.

`solve` gives what the live run gave. `relabelled` first names every point from the whole of the recording
(core.relabel), and then solves with these names.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence, Sized
from dataclasses import replace

import numpy as np

from core.engine import Engine
from core.errors import CancelledError
from core.frames import FloatArray, MarkerFrame, TrackedFrame
from core.gap_filling import filled
from core.labelling.given import GivenLabels, Names
from core.profile import Profile
from core.relabel.relabel import relabel

Progress = Callable[[float, str], bool | None]
"""Called with the share done (0..1) and a text; False cancels."""

PROGRESS_FRAMES = 200

_RELABELLING = 0.85  # of the work of `relabelled`; the rest is solving once more
_TELL_EVERY = 50


def solve(
    frames: Iterable[MarkerFrame],
    profiles: Profile | Sequence[Profile],
    progress: Progress | None = None,
    *,
    n_frames: int | None = None,
    labels: Names | None = None,
) -> list[TrackedFrame]:
    """Solve every frame in order; on the frames of a live run this gives what the live run gave.

    profiles: of each performer. n_frames: how many there are, for the progress of an iterator. labels: device id to
    hand and marker of the layout, for recordings whose points are already named; None to label them here.
    Raises CancelledError if `progress` returns False.
    """
    total = n_frames or (len(frames) if isinstance(frames, Sized) else 0)
    solved: list[TrackedFrame] = []
    for _, one in solve_each(frames, profiles, labels):
        solved.append(one)
        if progress is not None and len(solved) % PROGRESS_FRAMES == 0:
            share = min(len(solved) / total, 1.0) if total else 0.0
            if progress(share, f"Solving frame {len(solved)}" + (f" of {total}" if total else "")) is False:
                raise CancelledError
    return solved


def solve_each(
    frames: Iterable[MarkerFrame],
    profiles: Profile | Sequence[Profile],
    labels: Names | None = None,
    *,
    fill: bool = False,
) -> Iterator[tuple[MarkerFrame, TrackedFrame]]:
    """As `solve`, but each frame is handed over with its pose when it is asked for, and none is kept.

    fill: gaps are filled (core.gap_filling); frames are then kept for as long as filling looks ahead.
    """
    engine = Engine(profiles) if labels is None else given_engine(profiles, labels)
    if not fill:
        for frame in frames:
            yield frame, engine.step(frame)
        return
    held: deque[MarkerFrame] = deque()

    def solved() -> Iterator[TrackedFrame]:
        for frame in frames:
            held.append(frame)
            yield engine.step(frame)

    for whole in filled(solved(), profiles):
        yield held.popleft(), whole


def relabelled(
    frames: Sequence[MarkerFrame], profiles: Profile | Sequence[Profile], progress: Progress | None = None
) -> list[TrackedFrame]:
    """Solve every frame, its points named from the whole of the recording (core.relabel); each frame is read several
    times. Raises CancelledError if `progress` returns False."""
    return [solved for _, solved in relabelled_each(frames, profiles, progress)]


def relabelled_each(
    frames: Sequence[MarkerFrame],
    profiles: Profile | Sequence[Profile],
    progress: Progress | None = None,
    *,
    fill: bool = False,
) -> Iterator[tuple[MarkerFrame, TrackedFrame]]:
    """As `relabelled`, but each frame is handed over with its pose when it is asked for, and none is kept. fill: as in
    `solve_each`."""

    def tell(share: float, text: str) -> bool | None:
        return None if progress is None else progress(share, text)

    names = relabel(frames, profiles, lambda share, text: tell(_RELABELLING * share, text))

    def solved() -> Iterator[TrackedFrame]:
        engine = given_engine(profiles, names.labels)
        for i, frame in enumerate(names.named(frames)):
            yield _with_certainty(engine.step(frame), names.sure_of_frame(i))
            share = _RELABELLING + (1.0 - _RELABELLING) * (i + 1) / len(frames)
            if i % _TELL_EVERY == 0 and tell(share, f"Solving frame {i + 1:,} of {len(frames):,}") is False:
                raise CancelledError

    yield from zip(frames, filled(solved(), profiles) if fill else solved(), strict=True)


def _with_certainty(frame: TrackedFrame, sure: FloatArray) -> TrackedFrame:
    """The frame with how sure its names are, (n,) of its points; whether a marker is hidden was not asked."""
    hands = []
    for hand in frame.hands:
        certainty = np.full(len(hand.point), np.nan)
        certainty[hand.observed] = sure[hand.point[hand.observed]]
        hands.append(replace(hand, label_confidence=certainty))
    return replace(frame, hands=tuple(hands))


def given_engine(profiles: Profile | Sequence[Profile], labels: Names) -> Engine:
    """An engine that takes the names of points from their ids."""
    given = GivenLabels(profiles, labels)
    return Engine(profiles, labeller=given, finder=given, validator=given)
