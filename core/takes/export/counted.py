"""Where the angles of an export count from: the neutral trials of its performers."""

from __future__ import annotations

from typing import Any

from core.calibration.neutral import NeutralHand
from core.cast import Cast, performer_names
from core.frames import FloatArray, HandFrame, HandKey
from core.takes.export.content import Content


def reported(content: Content, hand: HandFrame) -> tuple[FloatArray, FloatArray]:
    """theta_rad and theta_std of a hand, (26,) each, as angles.csv holds them: less the zeros, if that is asked for."""
    neutral = content.cast[hand.performer].neutral if content.options.neutral else None
    if neutral is None:
        return hand.theta_rad, hand.theta_std
    return neutral.reported(hand.side, hand.theta_rad, hand.theta_std)


def neutral_hand(content: Content, key: HandKey) -> NeutralHand | None:
    """What the angles of a hand count from, if that is asked for and it has a trial."""
    neutral = content.cast[key.performer].neutral if content.options.neutral else None
    return None if neutral is None else neutral.hands.get(key.side)


def neutral_words(cast: Cast) -> tuple[str, ...]:
    """A phrase for each performer with a neutral trial: 'angles from the neutral trial of flat.c3d, 2.0 to 4.0 s';
    where there are several performers, after the name: 'Anna: angles from ...'."""
    said = (
        (name, "" if profile.neutral is None else profile.neutral.words(profile.sides))
        for name, profile in zip(performer_names(cast), cast, strict=True)
    )
    return tuple(f"{name}: {words}" if name else words for name, words in said if words)


def neutral_facts(content: Content) -> list[dict[str, Any]]:
    """What NAME_export.json says of angles.csv: the trial of each hand that has one, without its numbers, and the names
    of the angles that it did not set; [] where angles are as they were tracked."""
    if not content.options.neutral:
        return []
    return [
        {
            "performer": called, "hand": side, "file": hand.source, "from_s": hand.from_s, "to_s": hand.to_s,
            "date": hand.date, "hidden": list(hand.hidden), "prior": list(hand.prior),
        }
        for called, profile in zip(content.performers, content.cast, strict=True)
        if profile.neutral is not None
        for side, hand in profile.neutral.hands.items()
        if side in profile.sides
    ]  # fmt: skip
