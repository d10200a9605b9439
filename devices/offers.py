"""What a system offers to a profile: the rigid things that it knows, and whose LEDs are whose."""

from __future__ import annotations

from dataclasses import dataclass

from core.frames import FloatArray
from core.printable import printable


@dataclass(frozen=True, eq=False)
class OfferedProp:
    """A rigid thing with markers on it.

    markers_m: (m, 3) float64 [m] in the thing's own frame. ids: of those markers in the stream, () where the ids of the
    stream do not tell. shape, size_m: what it looks like, as in a profile: a "cylinder" of (diameter, length) along z,
    a "sphere" of (diameter,), a "box" of its edges; "none" where that is unknown [m]. home: (3, 3) float64, how it lies
    in the world, None if unknown.
    """

    name: str
    markers_m: FloatArray
    ids: tuple[int, ...] = ()
    shape: str = "none"
    size_m: tuple[float, ...] = ()
    home: FloatArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", printable(self.name))


@dataclass(frozen=True)
class Led:
    """A marker that is known by its id wherever it is seen. tracker: what the system has it on, "" if on nothing."""

    id: int
    name: str
    tracker: str = ""

    def __post_init__(self) -> None:
        for text in ("name", "tracker"):
            object.__setattr__(self, text, printable(getattr(self, text)))


@dataclass(frozen=True)
class Offers:
    """Nothing, unless the system knows of something."""

    props: tuple[OfferedProp, ...] = ()
    leds: tuple[Led, ...] = ()
