"""Takes of every kind of trouble, short, recorded and solved by Phalanx itself, for other programs to open."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from core.frames import FloatArray, HandKey, MarkerFrame, Times
from core.motion.performer import Performer
from core.profile import Profile, load_profile
from core.takes.reader import open_take
from core.takes.reprocess import solve
from core.takes.solution import Solution
from core.takes.take import Mark, TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from tests.core.props.things import BALL, PEN, path

RATE_HZ = 120.0
N_FRAMES = 90
MOTION_S = 2.0
"""Where in the performance a take begins: the hands move by then."""

ASIDE_M = np.array([0.9, 0.0, 0.0])
"""From a performer to the next."""

Seen = Callable[[int, str], bool]
"""Whether a marker, as files name it ("R_ThumbTip"), is seen in a frame."""


@dataclass(frozen=True)
class Kind:
    """A kind of take. seen: which markers are. missing: frames that never came; after a hole the device counts on as if
    there was none. marks: frame and text."""

    name: str
    worn: Sequence[Profile]
    seen: Seen = lambda i, label: True
    lost: range = range(0)
    hole: range = range(0)
    props: bool = False
    marks: Sequence[tuple[int, str]] = ()
    info: dict[str, str] = field(default_factory=dict)

    @property
    def there(self) -> list[int]:
        """Frames that came: places on the even grid of the formats that have one."""
        return [i for i in range(N_FRAMES) if i not in self.lost and i not in self.hole]


def _worn(name: str = "Anna Lena", layout: str = "han19") -> Profile:
    return replace(load_profile(layout), performer=name)


def _at_the_edges(i: int, label: str) -> bool:
    """The first and the last column, and a whole hand, are gaps at the first and last frames and in the middle."""
    edge = i < 4 or i >= N_FRAMES - 4 or 40 <= i < 48
    names = _worn().layout.marker_names
    if label in (f"L_{names[0]}", f"R_{names[-1]}"):
        return not edge
    return 1 <= i < N_FRAMES - 1 if label.startswith("R_") else True


KINDS = {
    kind.name: kind
    for kind in (
        Kind("whole", (_worn(),), marks=((20, "one"),)),
        Kind("gaps at the edges", (_worn(),), seen=_at_the_edges),
        Kind("two performers", (_worn(), _worn("", "qualisys13"))),
        Kind(
            "props", (replace(_worn(), props=(BALL, PEN)),), props=True,
            seen=lambda i, label: label[:3] != "pen" or i % 30 < 20,
        ),
        Kind("lost hands", (_worn(),), seen=lambda i, label: label.startswith("L_") and not 25 <= i < 65),
        Kind("a hole in time", (_worn(),), lost=range(20, 22), hole=range(40, 60)),
        Kind(
            "marks", (_worn("Jürgen Groß"),), marks=((12, "clap"), (30, "Öffnung, zweite"), (45, "")),
            info={"notes": "a second try;\ntape on the \"thumb\"", "rating": "A"},
        ),
    )
}  # fmt: skip


@dataclass(frozen=True)
class Taken:
    """kind: what it is. solution: as read from the take that was recorded; its frames are in memory."""

    kind: Kind
    solution: Solution


def taken(kind: Kind, folder: Path) -> Taken:
    """Records a take of this kind in `folder`, and opens it again."""
    raw, names = _raw(kind)
    # The ids say what each point is, so that hands are there from the first frame on that shows them.
    solved = solve(raw, kind.worn, labels=names)
    file = folder / f"{kind.name}.mcap"
    made = datetime(2026, 3, 4, 9, 30, tzinfo=UTC)
    info = TakeInfo(kind.name, kind.worn[0].performer, made, RATE_HZ, {"title": "performer"}, **kind.info)
    writer = TakeWriter(file, info, kind.worn)
    for frame, tracked in zip(raw, solved, strict=True):
        writer.raw("", frame)
        writer.solved(tracked)
    for i, text in kind.marks:
        writer.mark(Mark(i / RATE_HZ, text))
    writer.seal(TakeCounts(len(raw), len(raw), solved=len(solved)))
    with open_take(file) as take:
        solution = Solution.of_take(take)
        return Taken(
            kind, replace(solution, raw=tuple(solution.raw), solved=tuple(solution.solved), marks=tuple(solution.marks))
        )


def _raw(kind: Kind) -> tuple[list[MarkerFrame], dict[int, tuple[HandKey, int]]]:
    """The frames, and what the ids of hands' markers stand for."""
    performers = [Performer(replace(worn, scale=0.97), seed=3 + k) for k, worn in enumerate(kind.worn)]
    names = {
        1000 * (2 * k + s) + m: (HandKey(k, side), m)
        for k, worn in enumerate(kind.worn)
        for s, side in enumerate(worn.sides)
        for m in range(len(worn.layout.marker_names))
    }
    frames = []
    for n, i in enumerate(kind.there):
        points: list[FloatArray] = []
        ids: list[int] = []
        for k, performer in enumerate(performers):
            truth = performer.at(MOTION_S + i / RATE_HZ)
            for s, side in enumerate(performer.profile.sides):
                for m, name in enumerate(performer.profile.layout.marker_names):
                    if kind.seen(i, f"{side[0].upper()}_{name}"):
                        points.append(truth.markers_world_m[side][m] + k * ASIDE_M)
                        ids.append(1000 * (2 * k + s) + m)
        if kind.props:
            for m, at in enumerate(PEN.placed_m(path(i / RATE_HZ))):
                if kind.seen(i, f"pen{m + 1}"):
                    points.append(at)
                    ids.append(90_000 + m)
        time_s = i / RATE_HZ
        sequence = 500 + n + (len(kind.lost) if i >= kind.lost.stop else 0)
        frames.append(
            MarkerFrame(
                sequence, Times(time_s, 100.0 + time_s, 100.0 + time_s), np.array(points).reshape(-1, 3),
                np.array(ids, dtype=np.int64), np.full(len(ids), np.nan),
            )
        )  # fmt: skip
    return frames, names
