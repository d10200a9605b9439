"""What a take says of itself when it begins: the one place where that is made."""

from __future__ import annotations

import math
from collections.abc import Sequence

from app.armed import ArmedStream
from core.takes.take import TakeInfo


def take_info(
    name: str, streams: Sequence[ArmedStream], solving: str, *, performer: str, notes: str, shot: str
) -> TakeInfo:
    """streams: that will be in it. solving: key of the one that is solved, "" for none; its device is what the take
    calls its own, or else the first one. What the others say of themselves stands behind their keys."""
    solved = next((one for one in streams if one.key == solving), None)
    receivers = list(dict.fromkeys(one.receiver for one in ([solved, *streams] if solved is not None else streams)))
    device: dict[str, str] = {}
    for i, receiver in enumerate(receivers):
        description, before = receiver.describe(), f"{receiver.key}: " if i else ""
        about = {"kind": receiver.device_class.kind, "title": description.title, **description.details}
        device |= {before + label: text for label, text in about.items()}
    rate_hz = (solved.receiver.describe().rate_hz or solved.rate_hz) if solved is not None else 0.0
    return TakeInfo(
        name=name, performer=performer, rate_hz=rate_hz or math.nan, device=device, notes=notes.strip(), shot=shot
    )
