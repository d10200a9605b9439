"""The streams of a take in figures, while it is written and when it has ended."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

from core.frames import Standstill
from core.takes.holes import NO_HOLES, Holes
from core.takes.take import StreamCounts


@dataclass(frozen=True)
class StreamFigures(StreamCounts):
    """Where every frame of a stream went, as StreamCounts has it, and when none came.

    title: of its device. rate_hz: as it says, NaN if unknown. holes: where no frames came; while the take is written,
    the long silences that were heard. silent_s: since the last frame, or since the start if none came [s]; of a take
    that has ended 0. clock, clock_dropped: clock samples that are written, and that could not be.
    """

    title: str = field(default="", kw_only=True)
    rate_hz: float = field(default=float("nan"), kw_only=True)
    holes: Holes = field(default=NO_HOLES, kw_only=True, compare=False)
    silent_s: float = field(default=0.0, kw_only=True)
    clock: int = field(default=0, kw_only=True)
    clock_dropped: int = field(default=0, kw_only=True)


@dataclass(frozen=True, kw_only=True)
class OfStreams:
    """What a take, or its recording, says of its streams.

    streams: figures of each, by its key. solving: key of the one that is solved ("" also where it has no name), None
    where none is. The figures beside them are of that one; where none is solved, of all together.
    """

    streams: Mapping[str, StreamFigures] = field(default_factory=dict)
    solving: str | None = ""

    @property
    def main(self) -> StreamFigures:
        """Of the stream that is solved, or of all together."""
        return self.streams.get(self.solving or "") or together(self.streams)

    @property
    def beside(self) -> dict[str, StreamFigures]:
        """Of all others, by their keys."""
        return {key: figures for key, figures in self.streams.items() if key != self.solving}

    @property
    def received(self) -> int:
        """Frames that came."""
        return self.main.received

    @property
    def written(self) -> int:
        """Of these, those that are in the take."""
        return self.main.written

    @property
    def dropped(self) -> Mapping[str, int]:
        """Of these, those that are not, by reason."""
        return self.main.dropped

    @property
    def lost(self) -> int:
        """Frames that the device sent and that never came, or too late."""
        return self.main.lost

    @property
    def late(self) -> int:
        """Those of the lost that came after newer ones."""
        return self.main.late

    @property
    def repeated(self) -> int:
        """Frames that came twice."""
        return self.main.repeated

    @property
    def rejected(self) -> int:
        """Packets that could not be read."""
        return self.main.rejected

    @property
    def untimed(self) -> int:
        """Frames written of which nothing tells when they were taken."""
        return self.main.untimed

    @property
    def standstills(self) -> tuple[Standstill, ...]:
        """When this program did not run."""
        return self.main.standstills

    @property
    def holes(self) -> Holes:
        """Where no frames came."""
        return self.main.holes

    @property
    def silent_s(self) -> float:
        """Since the last frame [s]."""
        return self.main.silent_s


def together(streams: Mapping[str, StreamFigures]) -> StreamFigures:
    """All of them as if they were one; of when nothing came only how long of all of them together."""
    every = list(streams.values())
    dropped: Counter[str] = Counter()
    for one in every:
        dropped.update(one.dropped)
    return StreamFigures(
        sum(one.received for one in every), sum(one.written for one in every), dict(dropped),
        sum(one.lost for one in every), sum(one.rejected for one in every), late=sum(one.late for one in every),
        repeated=sum(one.repeated for one in every), untimed=sum(one.untimed for one in every),
        silent_s=min((one.silent_s for one in every), default=0.0),
    )  # fmt: skip
