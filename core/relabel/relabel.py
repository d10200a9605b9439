"""The names of all points of a recording, found from the whole of it.

Live, a name must be given at once, from what was before. Of a recording the end is known too:

1. Points that are one physical marker beyond doubt are one tracklet (core.relabel.tracklets), named as a whole.
2. The engine that works live names every point, once forward and once backward in time (core.relabel.votes). What one
   pass meets unprepared, a hand at the first frame or a finger that comes out of hiding, the other has long known.
3. Every tracklet counts the votes of both; names go to tracklets so that no marker has two points in a frame and the
   sum of votes is greatest (core.relabel.choice).
4. Long tracklets that both passes agree on are beyond doubt. The hand is solved with them alone, and tells where the
   markers of all others would be: by that, and by their votes, those are named (core.relabel.evidence). A tracklet that
   does not fit the hand that it is a part of falls into doubt as well. This is done again until nothing changes.

Tracklets that fit nothing are ghosts and stay without a name.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from core.cast import Cast, cast_of
from core.engine import Engine
from core.frames import FloatArray, IntArray, MarkerFrame
from core.labelling.given import Names
from core.profile import Profile
from core.relabel.cloud import Cloud
from core.relabel.evidence import with_names
from core.relabel.names import Naming
from core.relabel.settling import Settling
from core.relabel.teller import Progress, Teller
from core.relabel.tracklets import TrackletBuilder, cut
from core.relabel.votes import Ballot, agreed, backward, ballot, counted, forward


@dataclass(frozen=True)
class Relabelled:
    """name: (n_tracklets,) int64, as `naming` numbers markers, NOBODY for none. sure: (n_tracklets,) float64,
    probability that this is so."""

    cloud: Cloud
    naming: Naming
    name: IntArray
    sure: FloatArray

    @property
    def labels(self) -> Names:
        """What the ids of `named` frames say."""
        return self.naming.labels

    def named(self, frames: Iterable[MarkerFrame]) -> Iterator[MarkerFrame]:
        """The frames with these names for ids: for an engine that is given labels."""
        for i, frame in enumerate(frames):
            yield with_names(frame, self.of_frame(i))

    def of_frame(self, i: int) -> IntArray:
        """(n,) int64, the name of each point of a frame."""
        names: IntArray = self.name[self.cloud.tracklet[self.cloud.rows(i)]]
        return names

    def sure_of_frame(self, i: int) -> FloatArray:
        """(n,) float64, how sure each of them is."""
        sure: FloatArray = self.sure[self.cloud.tracklet[self.cloud.rows(i)]]
        return sure


@dataclass(frozen=True)
class Passes:
    """What was said of every point forward and backward in time."""

    cloud: Cloud
    naming: Naming
    forward: Ballot
    backward: Ballot


def relabel(
    frames: Sequence[MarkerFrame], profiles: Profile | Sequence[Profile], progress: Progress | None = None
) -> Relabelled:
    """Names for the points of all frames, which are gone through several times, each frame read anew.

    profiles: of each performer. Raises CancelledError if `progress` returns False.
    """
    cast, teller = cast_of(profiles), Teller(progress, len(frames))
    return named_by(frames, cast, passes_over(frames, cast, teller), teller)


def passes_over(frames: Sequence[MarkerFrame], cast: Cast, teller: Teller) -> Passes:
    """The first half of `relabel`: tracklets, and the engine once forward and once backward."""
    naming, builder = Naming.of(cast), TrackletBuilder()
    for frame in teller.through(frames, "Following points", 0.05):
        builder.push(frame)
    cloud = builder.cloud()
    one = ballot(teller.through(forward(frames), "Labelling forward", 0.35), Engine(cast), naming, cloud)
    other = ballot(teller.through(backward(frames), "Labelling backward", 0.7), Engine(cast), naming, cloud)
    other = agreed(one, other, naming)
    return Passes(cut(cloud, (one.name, other.name)), naming, one, other)


def named_by(frames: Sequence[MarkerFrame], cast: Cast, passes: Passes, teller: Teller) -> Relabelled:
    """The second half: one name for each tracklet."""
    name, sure = settling_of(frames, cast, passes, teller).run()
    return Relabelled(passes.cloud, passes.naming, name, sure)


def settling_of(frames: Sequence[MarkerFrame], cast: Cast, passes: Passes, teller: Teller) -> Settling:
    """Votes counted, nothing settled yet."""
    ballots = (passes.forward, passes.backward)
    scales = tuple(_mean(pair) for pair in zip(*(one.scales for one in ballots), strict=True))
    votes = counted(passes.cloud, ballots, passes.naming)
    return Settling(frames, cast, passes.naming, passes.cloud, votes, scales, teller)


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None
