"""What the application remembers between starts: one JSON file in the platform's configuration folder."""

from __future__ import annotations

import json
import logging
import os
from pathlib import Path
from typing import Any, TypeVar

import platformdirs

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
LEFT_KEPT = "left_behind/kept"
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
        self._save()

    def forget(self, name: str) -> None:
        """Back to the default."""
        if self._values.pop(name, None) is not None:
            self._save()

    def _save(self) -> None:
        if self.path is None:
            return
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            part = self.path.with_suffix(f".{os.getpid()}.part")
            part.write_text(json.dumps(self._values, indent=1, ensure_ascii=False), encoding="utf-8")
            part.replace(self.path)
        except OSError as error:
            LOG.warning("Settings cannot be written to %s (%s)", self.path, error)
