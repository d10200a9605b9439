"""How every file of ours begins: {"format": "phalanx-...", "version": n, ...}."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from core.errors import FormatError
from core.untrusted.values import shown


def checked_form(data: Any, source: str, form: str, versions: Sequence[int], what: str, mend: str) -> dict[str, Any]:
    """The JSON object `data`, if it is of format `form` and of one of `versions`.

    what: a noun for it, such as "subspace". mend: what to do with one of another version than Phalanx knows, beside
    updating. Raises FormatError naming `source`.
    """
    if not isinstance(data, dict) or data.get("format") != form:
        raise FormatError(f"{source} is not a {what}.", f'Its "format" must be "{form}".')
    version = data.get("version")
    if type(version) is not int or version not in versions:
        raise FormatError(
            f"{source} is a {what} of version {shown(version)}; this Phalanx reads up to {max(versions)}.",
            f"Update Phalanx or {mend}." if mend else "Update Phalanx.",
        )
    return data
