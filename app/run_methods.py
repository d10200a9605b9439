"""What was done, as one paragraph that the methods section of a paper can take over, with the numbers of this run."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

from app.angle_methods import angle_sentences
from core.labelling.network import SHIPPED_NAME
from core.takes.export.csv_tables import ANGLES
from core.takes.take import EXTENSION


def methods(deciding: Mapping[str, Any], figures: Mapping[str, Any], files: Collection[str]) -> str:
    """deciding, figures: as they stand in a run.json (app.run_record). files: the names of what was written."""
    settings, profiles = deciding["settings"], deciding["profiles"]
    return " ".join(
        [
            f"Hand motion was solved offline with Phalanx {deciding['program_version']} (The Phalanx developers; "
            "to be cited as its CITATION.cff says).",
            _recording(deciding["input"], figures),
            *_part(settings, files),
            *(_performer(profile, len(profiles) > 1) for profile in profiles),
            _labels(profiles, figures, settings),
            "In each frame the 26 parameters of each hand (position and rotation of the wrist, four angles per digit) "
            "were fitted to its markers by least squares (Levenberg-Marquardt) within joint limits; where the markers "
            "do not determine an angle, a statistical model of usual hand postures does, weakly. No filter was applied "
            "to what was measured.",
            _gaps(figures, settings),
            _outcome(figures),
            *(angle_sentences(profiles, figures) if ANGLES.file_name in files else ()),
        ]
    )


def _recording(source: Mapping[str, Any], figures: Mapping[str, Any]) -> str:
    at = "" if figures["rate_hz"] is None else f" at {figures['rate_hz']:g} Hz"
    text = f"The recording {source['file']} (SHA-256 {source['sha256']}) has {figures['frames']:,} frames{at}, "
    text += f"{figures['duration_s']:.2f} s"
    missing = figures["holes"]["frames"]
    if missing:
        text += f", and lacks about {sum(missing):,} frames in {_count(len(missing), 'stretch', 'stretches')} of time"
    return text + "."


def _part(settings: Mapping[str, Any], files: Collection[str]) -> Iterator[str]:
    """Exports may hold a part of it; takes and figures are always of all."""
    ends = [("from", settings.get("from_s")), ("to", settings.get("to_s"))]
    part = " ".join(f"{word} {value:g} s" for word, value in ends if value is not None)
    if part:
        take = ", the take all frames" if any(name.endswith(EXTENSION) for name in files) else ""
        yield f"The exported files hold the part {part}{take}; the figures given here are of the whole recording."


def _performer(profile: Mapping[str, Any], several: bool) -> str:
    sides = " and ".join(profile["sides"])
    who = (profile["performer"] or "one without a name") if several else ""
    whose = f"Of performer {who}, the" if several else "The"
    hands = "hands were" if len(profile["sides"]) > 1 else "hand was"
    text = f"{whose} {sides} {hands} looked for with {profile['markers']} markers each, of layout {profile['layout']}, "
    return text + f"on a hand model {_model(profile)} (profile: SHA-256 {profile['sha256']})."


def _model(profile: Mapping[str, Any]) -> str:
    if profile["shape"] == "generic" and not profile.get("calibrated"):
        size = "size was found from the motion" if profile["scale"] is None else f"scale was {profile['scale']:.4g}"
        text = f"of generic proportions whose {size}"
    else:
        text = "of the performer's own proportions"
        if profile["scale"] is not None and profile["scale"] != 1.0:
            text += f" at scale {profile['scale']:.4g}"
    more = [
        words
        for key, words in (
            ("calibrated", "calibrated from a recording"),
            ("limits", "with joint limits of its own"),
        )
        if profile.get(key)
    ]
    return ", ".join([text, *more])


def _labels(profiles: Sequence[Mapping[str, Any]], figures: Mapping[str, Any], settings: Mapping[str, Any]) -> str:
    if figures["labels_given"]:
        left = sum(figures["labels_left_out"].values())
        out = (
            f"; {left:,} of {figures['labelled_points']:,} labelled points did not fit their markers and were left out"
        )
        return "Markers were named by the labels of the file" + (out if left else "") + "."
    networks = dict.fromkeys(
        ("shipped with it" if one["network"]["file"] == SHIPPED_NAME else one["network"]["file"])
        + f" (SHA-256 {one['network']['sha256']})"
        for one in profiles
    )
    how = (
        "each frame from those before it, as live"
        if settings.get("live_labels")
        else "from the whole recording, forward and backward in time"
    )
    withheld = " (the labels of the file were withheld)" if settings.get("unlabelled") or settings.get("no_ids") else ""
    return f"Markers were named by Phalanx{withheld}, {how}, with the labelling network {'; '.join(networks)}."


def _gaps(figures: Mapping[str, Any], settings: Mapping[str, Any]) -> str:
    if settings.get("gaps") == "live":
        return (
            "While the markers of a joint were hidden, its angle was carried on from its motion before and the usual "
            "postures; gaps were not filled."
        )
    return (
        "While the markers of a joint were hidden, its angle was led smoothly from where it was to where it was seen "
        f"again, which concerns {100.0 * figures['filled']:.2f} % of the frames."
    )


def _outcome(figures: Mapping[str, Any]) -> str:
    if not figures["hands"]:
        return "No hand was found."
    each = [
        f"the {name} hand was tracked in {100.0 * hand['tracked']:.2f} % of them{_rms(hand['rms_m'])}"
        for name, hand in figures["hands"].items()
    ]
    return f"Of the frames that the recording should have, {' and '.join(each)}."


def _rms(rms_m: float | None) -> str:
    return "" if rms_m is None else f" (seen markers lie {1000.0 * rms_m:.2f} mm from the model, root mean square)"


def _count(n: int, one: str, many: str) -> str:
    return f"{n} {one if n == 1 else many}"
