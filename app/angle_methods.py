"""What a methods section has to say of angles.csv: where its angles count from, and what its deviations hold."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from core.takes.export.csv_tables import ANGLES

_CALIBRATED = "what the calibration left open"
_OPEN = (
    "what is open before a hand is seen, for it was not calibrated: how the hands of a population differ, and how well "
    "markers are placed as the layout has them"
)


def angle_sentences(profiles: Sequence[Mapping[str, Any]], figures: Mapping[str, Any]) -> Iterator[str]:
    """profiles, figures: as they stand in a run.json (app.run_record)."""
    trials = figures["neutral"]
    if trials:
        yield (
            f"In {ANGLES.file_name} joint angles count from a neutral trial ({'; '.join(trials)}): each is the angle "
            "that was tracked less its zero, by which it was off in that trial; an angle that the trial did not tell "
            "has no zero, or that of a trial before."
        )
    elif any(profile.get("neutral") for profile in profiles):
        yield f"The neutral trial in the profile was not used: angles in {ANGLES.file_name} are as they were tracked."
    held = ", with how well the joint was held in the trial" if trials else ""
    yield (
        f"Columns of {ANGLES.file_name} ending in _std are one standard deviation of an angle in its frame by itself "
        f"(noise of the points, markers that are hidden, what usual postures leave open{held}); they grow where "
        "markers are hidden."
    )
    stance = (
        "; of an angle that counts from a neutral trial it is that of the difference from the trial's stance"
        if trials
        else ""
    )
    yield (
        "Columns ending in _std_fixed are one standard deviation of what errors of bones and of marker places add, the "
        f"same in all frames of one posture{stance}. {_known(profiles)} Neither deviation knows that joints are not "
        "the hinges of the model."
    )


def _known(profiles: Sequence[Mapping[str, Any]]) -> str:
    """What the fixed deviations rest on; of several performers that differ in it, of each."""
    each = [_CALIBRATED if profile.get("calibrated") else _OPEN for profile in profiles]
    if len(set(each)) == 1:
        return f"They follow from {each[0]}."
    names = [profile["performer"] or "one without a name" for profile in profiles]
    return " ".join(f"Of performer {name} they follow from {what}." for name, what in zip(names, each, strict=True))
