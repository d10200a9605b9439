"""What is true of all frames of a stream, as the take has it: a metadata record of plain text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar, get_args

from core.frames import SIDES
from core.streams import Ids, Quality, Rotations, StreamInfo, What

MOST_BONES = 1024
"""Of one stream or frame; what claims more is damaged."""

_BONE = "bone."

Word = TypeVar("Word", bound=str)


def stream_to_text(info: StreamInfo) -> dict[str, str]:
    """StreamInfo as the metadata record `phalanx.stream.<n>`."""
    return {
        "key": info.key,
        "kind": info.kind,
        "title": info.title,
        "what": info.what,
        "rate_hz": repr(float(info.rate_hz)),
        "ids": info.ids,
        "quality": info.quality,
        "rotations": info.rotations,
        "sides": " ".join(info.sides),
        "clock_hz": repr(float(info.clock_hz)),
        "axes": info.axes,
        **{f"{_BONE}{i}": name for i, name in enumerate(info.bone_names, 1)},
    }


def stream_from_text(text: Mapping[str, str], what: What, key: str) -> StreamInfo:
    """The reverse of stream_to_text. what, key: stand in where it does not say them; any other word that is not known
    is "none"."""
    bones = (text.get(f"{_BONE}{i}") for i in range(1, MOST_BONES + 1))
    said = text.get("sides", "").split(" ")
    return StreamInfo(
        key=text.get("key") or key,
        kind=text.get("kind", ""),
        title=text.get("title", ""),
        what=_one_of(get_args(What), text.get("what"), what),
        rate_hz=_number(text.get("rate_hz")),
        ids=_one_of(get_args(Ids), text.get("ids"), "none"),
        quality=_one_of(get_args(Quality), text.get("quality"), "none"),
        rotations=_one_of(get_args(Rotations), text.get("rotations"), "none"),
        bone_names=tuple(iter(lambda: next(bones, None), None)),
        sides=tuple(side for side in SIDES if side in said),
        clock_hz=_number(text.get("clock_hz")),
        axes=text.get("axes", ""),
    )


def _one_of(words: tuple[Word, ...], said: str | None, otherwise: Word) -> Word:
    return next((word for word in words if word == said), otherwise)


def _number(text: str | None) -> float:
    try:
        return float(text or "nan")
    except ValueError:
        return float("nan")
