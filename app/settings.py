"""What the application remembers between starts: one JSON file in the platform's configuration folder."""

from __future__ import annotations

import contextlib
import errno
import json
import logging
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import platformdirs

from core.errors import FormatError
from core.printable import printable_json
from core.untrusted.json_text import read_json
from core.untrusted.values import shown

LOG = logging.getLogger("phalanx")
T = TypeVar("T")

LAYOUT = "window/layout"
GEOMETRY = "window/geometry"
PROFILE = "profile"
HAND_SIZE = "profile/hand_size"
PROFILE_WHOLE = "profile/whole"
OTHER_PROFILES = "profile/others"
TAKE_FOLDER = "takes/folder"
TAKE_TEMPLATE = "takes/template"
LOOK_AHEAD_MS = "tracking/look_ahead_ms"
SOLVE_EVERY = "tracking/solve_every"
PERFORMER = "takes/performer"
SHOT = "takes/shot"
WHOLE_TAKE_LABELS = "review/whole_take_labels"
IMPORT_FOLDER = "review/import_folder"
DEVICES = "devices"
LEFT_KEPT = "left_behind/kept"
VIEW = "view/"
"""Followed by the name of a switch of the 3D view."""


def default_path() -> Path:
    """Where the settings are kept."""
    return Path(platformdirs.user_config_path("phalanx", appauthor=False)) / "settings.json"


MOST_BYTES = 1 << 22
_LONGEST = 100_000  # characters of a text
_LARGEST_WHOLE = (1 << 31) - 1  # what a field of a window can hold
_MOST_SET_ASIDE = 100


class Settings:
    """Names with JSON values. A file that cannot be read is set aside, never a reason not to start."""

    def __init__(self, path: Path | None) -> None:
        """path: None keeps everything in memory (tests, the demo tour)."""
        self.path = path
        self._values: dict[str, Any] = {}
        self._set_here: set[str] = set()
        self._troubles: list[tuple[str, str]] = []
        self._tell: Callable[[str, str], None] = lambda what, action: self._troubles.append((what, action))
        self._unwritten = False
        self._in_the_way = False  # a file that can neither be read nor set aside: it is not written over
        if path is None:
            return
        try:
            self._values = _read(path)
        except FormatError as error:
            if not isinstance(error.__cause__, FileNotFoundError):
                self._set_aside(path, error.what)

    def tell_with(self, tell: Callable[[str, str], None]) -> None:
        """Have told what goes wrong with the file: what, and what to do. What did so far is told now."""
        self._tell = tell
        while self._troubles:
            tell(*self._troubles.pop(0))

    def get(self, name: str, default: T) -> T:
        """The value remembered if it is of the type of `default` and can be one, else `default`."""
        value = self._values.get(name, default)
        if isinstance(default, float) and type(value) is int:
            value = float(value)
        return value if type(value) is type(default) and _can_be(value) else default

    def set(self, name: str, value: Any) -> None:
        """Remember, and write at once."""
        if self._values.get(name) == value:
            return
        try:
            _text(value)
        except (ValueError, TypeError) as error:  # such as a folder whose name is not of this machine's characters
            LOG.warning("%s cannot be remembered (%s)", name, error)
            self._tell(f"{shown(value)} cannot be remembered.", "It holds until Phalanx is closed.")
            return
        self._values[name] = value
        self._set_here.add(name)
        self._save()

    def forget(self, name: str) -> None:
        """Back to the default."""
        if self._values.pop(name, None) is not None:
            self._set_here.add(name)
            self._save()

    def _set_aside(self, path: Path, what: str) -> None:
        names = (f"{path.stem}.unreadable{f'-{n}' if n > 1 else ''}.json" for n in range(1, _MOST_SET_ASIDE))
        try:
            aside = next((new for new in map(path.with_name, names) if not os.path.lexists(new)), None)
            if aside is None:
                raise FileExistsError(errno.EEXIST, "too many are there already")
            path.rename(aside)
            kept = f"It is kept as {aside.name} beside it."
        except OSError as error:
            self._in_the_way = os.path.lexists(path)
            kept = f"It stays where it is, and nothing will be remembered ({error.strerror or error})."
        LOG.warning("%s %s", what, kept)
        self._tell(f"{what} Phalanx has started with its defaults.", kept)

    def _save(self) -> None:
        if self.path is None or self._in_the_way:
            return
        part = self.path.with_suffix(f".{os.getpid()}.part")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._take_up_others(self.path)
            part.write_text(_text(self._values), encoding="utf-8")
            part.replace(self.path)
            self._unwritten = False
        except OSError as error:
            with contextlib.suppress(OSError):
                part.unlink(missing_ok=True)
            if not self._unwritten:
                self._unwritten = True
                LOG.warning("Settings cannot be written to %s (%s)", self.path, error)
                self._tell(
                    f"The settings cannot be written to {self.path} ({error.strerror or error}).",
                    "What you change holds until Phalanx is closed.",
                )

    def _take_up_others(self, path: Path) -> None:
        """What another window remembered meanwhile stays, where this one said nothing of its own."""
        try:
            written = _read(path)
        except FormatError:
            return
        own = {name: value for name, value in self._values.items() if name in self._set_here}
        others = {name: value for name, value in written.items() if name not in self._set_here}
        self._values = others | own


def _read(path: Path) -> dict[str, Any]:
    values = read_json(path, f"The settings file {path}", "", MOST_BYTES)
    if not isinstance(values, dict):
        raise FormatError(f"The settings file {path} holds {shown(values)} in place of names and values.")
    return values


def _text(value: Any) -> str:
    """Raises ValueError and TypeError for what a file cannot hold."""
    text = json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False)
    text.encode("utf-8")
    return printable_json(text)


def _can_be(value: object) -> bool:
    """Whether a window can show it: nothing larger than a field holds, no text that ends in its middle."""
    if isinstance(value, str):
        return "\0" not in value and len(value) <= _LONGEST
    return not isinstance(value, int) or abs(value) <= _LARGEST_WHOLE
