"""What the application remembers between starts: one JSON file in the platform's configuration folder."""

from __future__ import annotations

import json
import logging
import os
from pathlib import Path
from typing import Any, TypeVar

import platformdirs

from core.printable import printable_json

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
PERFORMER = "takes/performer"
SHOT = "takes/shot"
WHOLE_TAKE_LABELS = "review/whole_take_labels"
IMPORT_FOLDER = "review/import_folder"
DEVICES = "devices"
VIEW = "view/"
"""Followed by the name of a switch of the 3D view."""


def default_path() -> Path:
    """Where the settings are kept."""
    return Path(platformdirs.user_config_path("phalanx", appauthor=False)) / "settings.json"


class Settings:
    """Names with JSON values. A file that cannot be read is set aside, never a reason not to start."""

    def __init__(self, path: Path | None) -> None:
        """path: None keeps everything in memory (tests, the demo tour)."""
        self.path = path
        self._values: dict[str, Any] = {}
        self._set_here: set[str] = set()
        if path is None or not path.exists():
            return
        try:
            values = json.loads(path.read_text(encoding="utf-8"))
            if not isinstance(values, dict):
                raise ValueError("not an object")
            self._values = values
        except (OSError, ValueError) as error:
            LOG.warning("Settings %s cannot be read (%s); starting with the defaults", path, error)
            try:
                path.replace(path.with_suffix(".unreadable.json"))
            except OSError:
                LOG.warning("and cannot be set aside")

    def get(self, name: str, default: T) -> T:
        """The value remembered if it has the type of `default`, else `default`."""
        value = self._values.get(name, default)
        return value if isinstance(value, type(default)) else default

    def set(self, name: str, value: Any) -> None:
        """Remember, and write at once."""
        if self._values.get(name) == value:
            return
        self._values[name] = value
        self._set_here.add(name)
        self._save()

    def forget(self, name: str) -> None:
        """Back to the default."""
        if self._values.pop(name, None) is not None:
            self._set_here.add(name)
            self._save()

    def _save(self) -> None:
        if self.path is None:
            return
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._take_up_others(self.path)
            part = self.path.with_suffix(f".{os.getpid()}.part")
            part.write_text(printable_json(json.dumps(self._values, indent=1, ensure_ascii=False)), encoding="utf-8")
            part.replace(self.path)
        except OSError as error:
            LOG.warning("Settings cannot be written to %s (%s)", self.path, error)

    def _take_up_others(self, path: Path) -> None:
        """What another window remembered meanwhile stays, where this one said nothing of its own."""
        try:
            written = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            return
        if isinstance(written, dict):
            own = {name: value for name, value in self._values.items() if name in self._set_here}
            others = {name: value for name, value in written.items() if name not in self._set_here}
            self._values = others | own
