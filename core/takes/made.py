"""What a solution came from, as far as the files that it is exported to can say it: hashes, and how it was solved."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from core.cast import Cast
from core.profile import Profile
from core.untrusted.files import open_file


@dataclass(frozen=True)
class Made:
    """source_sha256: of the recording's file, "" where that is not known. profiles_sha256: of each performer's profile
    (profile_sha256). settings: how it was solved, in words, such as {"gaps": "fill"}; empty where that is not known,
    as of a take."""

    profiles_sha256: tuple[str, ...]
    source_sha256: str = ""
    settings: Mapping[str, str] = field(default_factory=dict)

    @property
    def lines(self) -> tuple[str, ...]:
        """The settings, each as one text: "gaps: fill"."""
        return tuple(f"{name}: {value}" for name, value in self.settings.items())


def made_with(cast: Cast) -> Made:
    """Of a solution of which only the profiles are known."""
    return Made(tuple(map(profile_sha256, cast)))


def profile_sha256(profile: Profile) -> str:
    """Of the text that Profile.to_json gives: of a file that this version of Phalanx saved, the hash of that file."""
    return hashlib.sha256(profile.to_json().encode("utf-8")).hexdigest()


def file_sha256(path: Path) -> str:
    """Of what is in a file. Raises OSError."""
    with open_file(path) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
