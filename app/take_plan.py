"""What the next take will be called and where it goes: template, performer, shot, number, notes."""

from __future__ import annotations

import os
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

import platformdirs
from PySide6.QtCore import QObject, Signal

from app import settings as names
from app.ask_disk import AskDisk, SilentDiskError
from app.settings import Settings
from app.take_folder import TakeFolder
from core.disk_error import why
from core.errors import PhalanxError, TakeError
from core.takes.take_names import DEFAULT_TEMPLATE, TakeNames

SHOT = "shot"
PERFORMER = "performer"
NAMED_BY = ("template", "performer", "shot")
"""Fields that make the name of a take."""

_LONGEST_NAME, _LONGEST_PATH = 255, 1024
"""Of any folder [byte]; paths may be longer on some systems."""


def default_folder() -> Path:
    """Where takes go unless another folder is chosen."""
    return Path(platformdirs.user_documents_path()) / "Phalanx takes"


def _folder(remembered: str) -> Path:
    """The folder of the last time, also while it is away; the default where no folder can have this name. Asks no disk:
    one that hangs would keep the window from opening."""
    path = Path(remembered)
    names_fit = all(len(os.fsencode(part)) <= _LONGEST_NAME for part in path.parts)
    return path if remembered and names_fit and len(os.fsencode(path)) < _LONGEST_PATH else default_folder()


class Preview(NamedTuple):
    """What the next take will be called. name: "" if it cannot be recorded. problem: why, and what to do. at_fault: the
    field that says so, "template" or "folder". instead: in place of the name, in few words."""

    name: str
    problem: str = ""
    at_fault: str = ""
    instead: str = ""


class TakePlan(QObject):
    """Fields with one signal. The take number is not kept between starts: it follows from what is in the folder, and
    what was recorded since, wherever that is now: no name is given twice."""

    changed = Signal()
    notes_changed = Signal()

    def __init__(self, settings: Settings) -> None:
        super().__init__()
        self._settings = settings
        self.template = settings.get(names.TAKE_TEMPLATE, DEFAULT_TEMPLATE)
        self.performer = settings.get(names.PERFORMER, PERFORMER)
        self.shot = settings.get(names.SHOT, SHOT)
        self.folder = _folder(settings.get(names.TAKE_FOLDER, ""))
        self.notes = ""
        self._typed: dict[str, str] = {}
        self._known = TakeFolder(self.folder, meant=self.folder == default_folder())
        self._used: set[str] = set()  # names of the takes since the start
        self._ask: AskDisk[Path] = AskDisk()

    def set_template(self, text: str) -> None:
        """Use another template; `preview` says whether it is a good one."""
        self._set("template", names.TAKE_TEMPLATE, text)

    def set_performer(self, text: str) -> None:
        """Whose hands they are."""
        self._set("performer", names.PERFORMER, text)

    def set_shot(self, text: str) -> None:
        """What is being captured."""
        self._set("shot", names.SHOT, text)

    def set_folder(self, folder: Path) -> None:
        """Where takes go. Chosen again it is made anew, should it have gone."""
        self._known = TakeFolder(folder, meant=True)
        self.folder = folder
        self._settings.set(names.TAKE_FOLDER, str(folder))
        self.changed.emit()

    def make_folder(self) -> None:
        """Make the folder if it is to be made. Raises TakeError if it has gone, and OSError."""
        folder, known = self.folder, self._known

        def make() -> Path:
            known.check()
            folder.mkdir(parents=True, exist_ok=True)
            return folder

        self._ask(folder, make)

    def take_begun(self, name: str) -> None:
        """A take of this name is being recorded."""
        self._known.take_begun()
        self._used.add(name)

    def reserve(self, name: str) -> None:
        """A take of this name is about to be written: the next one has another."""
        self._used.add(name)
        self.changed.emit()

    def take_finished(self, name: str, kept: bool) -> None:
        """It is done with. kept: there is something of it; else its name is free."""
        if not kept:
            self._used.discard(name)
        self.changed.emit()

    def set_notes(self, text: str) -> None:
        """Notes of the take that runs; while none does, of the next."""
        if text != self.notes:
            self.notes = text
            self.notes_changed.emit()

    def next(self) -> tuple[str, Path]:
        """Name and path of the next take, which does not exist. Raises TakeError if the template is no good, or the
        folder's disk is away or does not answer."""
        return self._next(self.template, self.performer, self.shot)

    def show_typed(self, field: str, text: str) -> None:
        """Let the preview follow what is being typed; it counts once it is set."""
        if self._typed.get(field, getattr(self, field)) != text:
            self._typed[field] = text
            self.changed.emit()

    def preview(self) -> Preview:
        """The next take as typed so far, or what is wrong."""
        named_by = [self._typed.get(field, getattr(self, field)) for field in NAMED_BY]
        try:
            TakeNames(*named_by).name(1, datetime.now())
        except PhalanxError as error:
            return Preview("", str(error), "template", "No valid name")
        try:
            return Preview(self._next(*named_by)[0])
        except SilentDiskError as error:
            return Preview("", str(error), "folder", "Disk does not answer")
        except PhalanxError as error:
            return Preview("", str(error), "folder", "Take folder not usable")

    def _next(self, template: str, performer: str, shot: str) -> tuple[str, Path]:
        take_names, folder, known = TakeNames(template, performer, shot), self.folder, self._known
        used = tuple(self._used)

        def look() -> Path:
            try:
                known.check()
                return take_names.next_path(folder, datetime.now(), used)
            except OSError as error:  # a share that is broken, a folder in one that may not be entered
                raise TakeError(
                    f"The take folder {folder} cannot be used ({why(folder, error)}).",
                    "Check its disk or network folder, or choose another folder.",
                ) from error

        path = self._ask(folder, look)
        return path.stem, path

    def _set(self, field: str, name: str, text: str) -> None:
        self._typed.pop(field, None)
        if getattr(self, field) != text:
            setattr(self, field, text)
            self._settings.set(name, text)
            self.changed.emit()
