"""A solved recording: what every export starts from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from core.cast import Cast, cast_of
from core.frames import MarkerFrame, TrackedFrame
from core.printable import printable
from core.profile import Profile
from core.takes.holes import NO_HOLES, Holes
from core.takes.made import Made
from core.takes.take import Mark, TakeInfo
from core.words import count, listed

if TYPE_CHECKING:
    from core.takes.reader import Take


@dataclass(frozen=True)
class Solution:
    """The frames of a recording and what the engine made of them, from a take or from solving a file offline.

    profiles: of each performer. rate_hz: nominal frames per second, NaN if unknown. raw: the device's frames. solved:
    the engine's, in the order of raw; a frame of raw may have none. Both may be read from disk as they are asked for.
    holes: where it has no frames, in seconds from the first of raw. info: what an operator says of it; None for a file
    of another program. marks: moments that were marked, in seconds from the first of raw. start_s: when the first of
    raw was, in seconds from the first frame of the recording, of which this may be a part. file: the name of the file
    that it comes from, "" for none. made: what it came from and how it was solved; None where only the profiles are
    known. beside: how many frames of streams that were not solved its take holds, by their keys.
    """

    name: str
    profiles: Profile | Cast
    rate_hz: float
    raw: Sequence[MarkerFrame]
    solved: Sequence[TrackedFrame]
    holes: Holes = NO_HOLES
    info: TakeInfo | None = None
    marks: Sequence[Mark] = ()
    start_s: float = 0.0
    file: str = ""
    made: Made | None = None
    beside: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", printable(self.name))
        object.__setattr__(self, "file", printable(self.file))

    @property
    def cast(self) -> Cast:
        """The profiles, of however many performers."""
        return cast_of(self.profiles)

    @property
    def left_out(self) -> str:
        """What its take holds besides and no export does, in a sentence; "" for nothing."""
        if not self.beside:
            return ""
        streams = listed([f"{printable(key)} ({count(n, 'frame')})" for key, n in self.beside.items()])
        are, they = ("is", "It is") if len(self.beside) == 1 else ("are", "They are")
        return f"{streams} {are} not in these files: exports hold the stream that was solved. {they} in the take."

    @classmethod
    def of_take(cls, take: Take) -> Solution:
        """The solution recorded in an open take, which must stay open, by the name of its file: that is the one that
        people see and change. Raises TakeError for a damaged profile."""
        return cls(
            take.path.stem, take.profiles, take.info.rate_hz, take.raw, take.solved, take.holes, take.info, take.marks,
            file=take.path.name,
            beside={key: len(one.frames) for key, one in take.streams.items() if not one.solved},
        )  # fmt: skip
