"""Profiles, props, subspaces and networks: a half of one never has its name."""

from __future__ import annotations

import contextlib
from pathlib import Path

from core.errors import FormatError


def write_whole(path: Path, content: str | bytes, what: str) -> None:
    """Writes a file, in the place of an older one only when it is whole. content: text goes there in UTF-8.

    what: a noun for it, such as "Profile". Raises FormatError, and then leaves what was there.
    """
    half = path.with_name(path.name + ".part")
    try:
        half.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)
        half.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            half.unlink()
        raise FormatError(
            f"{what} {path} cannot be written ({error.strerror or error}).", "Choose another place with --out."
        ) from error
