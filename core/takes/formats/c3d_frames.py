"""How many frames a C3D file holds, of how many bytes, and where they begin.

Header and parameters say each of it, often not the same: words end at 65,535, programs forget one as they change the
other, files are cut off. The length of the file decides between them, and what differs is said.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from core.takes.formats.c3d_parameters import BLOCK, Parameters
from core.takes.formats.clock import FASTEST_HZ

MOST_IN_A_WORD = 65_535


@dataclass(frozen=True)
class Header:
    """What the first block of a C3D file says."""

    n_points: int
    n_analog: int
    first_frame: int
    last_frame: int
    data_block: int
    samples_per_frame: int
    scale: float
    rate_hz: float


@dataclass(frozen=True)
class Count:
    """A number of frames as one field has it. full: it is the most that the field can say."""

    source: str
    frames: int
    full: bool = False


@dataclass(frozen=True)
class Layout:
    """Frames from byte `start` on, up to `end` at most. n_analog: words of analog data after the points of each."""

    start: int
    end: int
    n_points: int
    n_analog: int
    item_bytes: int

    @property
    def frame_bytes(self) -> int:
        """Of one frame."""
        return (4 * self.n_points + self.n_analog) * self.item_bytes

    @property
    def n_bytes(self) -> int:
        """That are there for frames."""
        return max(self.end - self.start, 0)

    @property
    def whole_frames(self) -> int:
        """That the bytes could hold, filling zeros of the last block included."""
        return self.n_bytes // self.frame_bytes

    def ends_with(self, n_frames: int) -> bool:
        """Whether the file's length is right for so many frames: no byte left, or some that fill the last block."""
        left = self.n_bytes - n_frames * self.frame_bytes
        return left == 0 or (0 < left < BLOCK and self.end % BLOCK == 0)


def stated_counts(parameters: Parameters, header: Header) -> list[Count]:
    """Every number of frames that the file gives, 0 where a field says nothing sensible."""
    counts = []
    first, last = trial_fields(parameters)
    if first is not None and last is not None:
        counts.append(Count("TRIAL", max(last - first + 1, 0)))
    for name in ("LONG_FRAMES", "FRAMES"):
        frames = parameters.count("POINT", name)
        if frames is not None:
            counts.append(Count(f"POINT:{name}", frames, name == "FRAMES" and frames == MOST_IN_A_WORD))
    last = header.last_frame
    in_header = max(last - header.first_frame + 1, 0) if last else 0
    return [*counts, Count("header", in_header, last == MOST_IN_A_WORD)]


def trial_fields(parameters: Parameters) -> tuple[int | None, int | None]:
    """Numbers of the first and the last frame as the group TRIAL has them, beyond 65,535 too."""
    return parameters.count("TRIAL", "ACTUAL_START_FIELD"), parameters.count("TRIAL", "ACTUAL_END_FIELD")


def find_layout(
    n_file_bytes: int, parameters: Parameters, header: Header, item_bytes: int, counts: list[Count]
) -> tuple[Layout, list[str]]:
    """What fits the file's length, of what header and parameters say; the header's where neither or both do.

    Also returns what is to be said of it, in sentences.
    """
    blocks = _different(header.data_block, parameters.count("POINT", "DATA_START"))
    points = _different(header.n_points, parameters.count("POINT", "USED"))
    analog = _different(header.n_analog, _analog_words(parameters, header))
    others = {(parameters.start // BLOCK) + 1, parameters.count("ROTATION", "DATA_START") or 0}

    def layouts() -> Iterator[Layout]:
        for block, n_points, n_analog in product(blocks, points, analog):
            following = [(other - 1) * BLOCK for other in others if other > block]
            start, end = max(block - 1, 0) * BLOCK, min([n_file_bytes, *following])
            yield Layout(start, end, n_points, n_analog, item_bytes)

    possible = [layout for layout in layouts() if layout.n_points and layout.start >= BLOCK]
    fitting = [layout for layout in possible if any(c.frames and layout.ends_with(c.frames) for c in counts)]
    holding = [layout for layout in possible if layout.whole_frames]
    chosen = next(iter(fitting or holding or possible or layouts()))
    told = [
        f"Its header and its parameters differ in {what} ({values[0]:,}, {values[1]:,}); {taken:,} fits its length."
        for what, values, taken in (
            ("the block its points begin at", blocks, chosen.start // BLOCK + 1),
            ("the number of its points", points, chosen.n_points),
            ("the number of its analog values per frame", analog, chosen.n_analog),
        )
        if len(values) > 1 and values[0] != taken
    ]
    return chosen, told


def count_frames(data: bytes, layout: Layout, counts: list[Count]) -> tuple[int, list[str]]:
    """The largest of the counts that the bytes allow, and what is to be said of the others, in sentences.

    Where none is given, or the largest is the most that its word can say, the file's length counts. A file that is
    cut off has its whole frames.
    """
    stated = [count for count in counts if count.frames > 0]
    if not stated:
        n_frames = _by_length(data, layout)
        return n_frames, [f"It does not say how many frames it holds; by its length they are {n_frames:,}."]
    most = max(stated, key=lambda count: (count.frames, not count.full))
    ending = [count.frames for count in stated if layout.ends_with(count.frames)]
    if ending:
        n_frames = max(ending)
    elif most.frames > layout.whole_frames:
        n_frames = layout.whole_frames
    elif most.full:
        n_frames = _by_length(data, layout)
    else:
        n_frames = _overflowed(layout, most.frames)
    return n_frames, [*_differences(counts, n_frames), *_unread(layout, n_frames)]


def frame_rate(parameters: Parameters, header: Header) -> tuple[float, list[str]]:
    """The rate [Hz], 0 if none is given: POINT:RATE, else the header's, else TRIAL:CAMERA_RATE. And what is to be
    said of the others, in sentences.
    """
    rates = {
        "POINT:RATE": parameters.number("POINT", "RATE", float("nan")),
        "its header": header.rate_hz,
        "TRIAL:CAMERA_RATE": parameters.number("TRIAL", "CAMERA_RATE", float("nan")),
    }
    usable = {source: rate for source, rate in rates.items() if 0.0 < rate <= FASTEST_HZ}
    if not usable:
        return 0.0, []
    taken, rate_hz = next(iter(usable.items()))
    others = {
        source: rate
        for source, rate in rates.items()
        if not np.isnan(rate) and not np.isclose(rate, rate_hz, rtol=1e-4, atol=0.0)
    }
    told = [f"Its rate is {rate_hz:g} Hz by {taken}, but {rate:g} Hz by {source}." for source, rate in others.items()]
    return rate_hz, told


def _analog_words(parameters: Parameters, header: Header) -> int | None:
    """Analog values per frame by the parameters: channels times samples."""
    used = parameters.count("ANALOG", "USED")
    if used is None:
        return None
    samples = header.samples_per_frame
    rate, analog_rate = frame_rate(parameters, header)[0], parameters.number("ANALOG", "RATE", 0.0)
    if samples == 0 and rate > 0.0 and 0.0 < analog_rate <= rate * MOST_IN_A_WORD:
        samples = round(analog_rate / rate)
    return used * samples


def _different(in_header: int, in_parameters: int | None) -> list[int]:
    """The header's value, then the parameter's where it is another."""
    return [in_header] if in_parameters in (None, in_header) else [in_header, in_parameters or 0]


def _by_length(data: bytes, layout: Layout) -> int:
    """Frames up to the end, without zeros that only fill the last block."""
    n_frames, size = layout.whole_frames, layout.frame_bytes
    if layout.end % BLOCK == 0:
        filling = layout.n_bytes - (BLOCK - 1)
        while (n_frames - 1) * size >= filling and not any(
            data[layout.start + (n_frames - 1) * size : layout.start + n_frames * size]
        ):
            n_frames -= 1
    return n_frames


def _overflowed(layout: Layout, frames: int) -> int:
    """The count, or a longer one of which it is the lower word, where the file's length is right for that."""
    high = (layout.whole_frames - frames) >> 16
    longer = frames + (high << 16)
    return longer if frames <= MOST_IN_A_WORD and layout.ends_with(longer) else frames


def _differences(counts: list[Count], n_frames: int) -> list[str]:
    promises: dict[int, list[str]] = {}
    for count in counts:
        if count.frames != n_frames and not (count.full and n_frames > count.frames):
            promises.setdefault(count.frames, []).append(count.source)
    if not promises:
        return []
    words = [
        f"its {' and '.join(sources)} {'promises' if len(sources) == 1 else 'promise'} {_frames(n)}"
        for n, sources in promises.items()
    ]
    return [f"I{', '.join(words)[1:]}, {n_frames:,} {'is' if n_frames == 1 else 'are'} there."]


def _unread(layout: Layout, n_frames: int) -> list[str]:
    left = layout.n_bytes - n_frames * layout.frame_bytes
    if left < max(BLOCK, layout.frame_bytes):
        return []
    return [f"After its {_frames(n_frames)} follow {left:,} bytes that it says nothing of; they are not read."]


def _frames(n: int) -> str:
    return "1 frame" if n == 1 else f"{n:,} frames"
