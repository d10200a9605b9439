"""What a run starts from: the recording's file, the profiles with their networks, and the options that count."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from app.run_record import Origin
from core.cast import Cast
from core.errors import FormatError
from core.labelling.network import SHIPPED_NAME, network_bytes
from core.printable import printable
from core.profile import Profile, load_profile
from core.takes.made import Made, file_sha256, profile_sha256
from core.takes.reader import open_take
from core.takes.take import EXTENSION

LABELS = {
    "given": "as given in the file",
    "whole": "from the whole recording",
    "live": "each frame from those before it, as live",
}
"""Where the names of the points come from, in words."""

_SAID_OF_EACH_FILE = {"joints", "measured", "up", "unit", "bones", "rate", "from_s", "to_s", "no_neutral"}
_SAID_AS_LABELS = {"unlabelled", "no_ids", "live_labels"}


def origin_of(path: Path, profiles: Sequence[str], network: str | None, settings: Mapping[str, Any]) -> Origin:
    """profiles, network: as `--profile` and `--network` take them; () for those of a take. Raises FormatError and
    TakeError."""
    cast, given = cast_of_words(path, profiles)
    try:
        size, sha256 = path.stat().st_size, file_sha256(path)
    except OSError as error:
        raise FormatError(
            f"{path} cannot be read ({error.strerror or error}).", "Look whether it is there and may be read."
        ) from error
    return Origin(
        {"file": printable(path.name), "bytes": size, "sha256": sha256},
        [
            _said_of(profile, word, network or profile.network or SHIPPED_NAME)
            for profile, word in zip(cast, given, strict=True)
        ],
        dict(settings),
    )


def cast_of_words(path: Path, profiles: Sequence[str]) -> tuple[Cast, Sequence[str]]:
    """The profiles, and the name of the file or layout that each was given as; "" for one in a take. Raises FormatError
    and TakeError."""
    if profiles:
        return tuple(map(load_profile, profiles)), [printable(Path(word).name) for word in profiles]
    if path.suffix != EXTENSION:
        return (), ()
    with open_take(path) as take:
        return take.profiles, [""] * len(take.profiles)


def made(origin: Origin, labels: str) -> Made:
    """What exported files say of it. labels: one of LABELS."""
    aside = _SAID_OF_EACH_FILE | _SAID_AS_LABELS
    others = {name: _word(value) for name, value in origin.settings.items() if name not in aside}
    networks = dict.fromkeys(f"{one['network']['file']} {one['network']['sha256'][:16]}" for one in origin.profiles)
    return Made(
        tuple(one["sha256"] for one in origin.profiles),
        origin.input["sha256"],
        {"labels": LABELS[labels], **others, "network": ", ".join(networks)},
    )


def _word(value: object) -> str:
    return {True: "yes", False: "no"}[value] if isinstance(value, bool) else str(value)


def _said_of(profile: Profile, given: str, network: str) -> dict[str, Any]:
    """Without the network that it names: that is said beside it."""
    parts = profile.to_dict()
    return {
        **({"file": given} if given else {"in_the_take": True}),
        "sha256": profile_sha256(profile),
        "performer": profile.performer,
        "layout": profile.layout.name,
        "markers": len(profile.layout.marker_names),
        "sides": list(profile.sides),
        "scale": profile.scale,
        "shape": "generic" if (profile.shape.ratios == 1.0).all() else "of the performer",
        **{name: True for name in ("calibrated", "neutral", "limits") if parts.get(name) is not None},
        "network": {"file": printable(Path(network).name), "sha256": _network_sha256(network)},
    }


def _network_sha256(name: str) -> str:
    """Raises FormatError."""
    try:
        return hashlib.sha256(network_bytes(None if name == SHIPPED_NAME else Path(name))).hexdigest()
    except FormatError as error:
        action = f"{error.action.removesuffix('.')}, or --network {SHIPPED_NAME} for the one of Phalanx."
        raise FormatError(error.what, action) from error
