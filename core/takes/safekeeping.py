"""What becomes of the file of a take while it is recorded, and that nothing of it is lost by that."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from core.errors import TakeError
from core.level import Level
from core.takes.place import Fate, is_at
from core.takes.record_file import RecordFile
from core.takes.rescue import Rescue

_LOOKS_BETWEEN_TRIES = 20
"""After a rescue that found no room."""


@dataclass(frozen=True)
class Notice:
    """Something that befell the file of a take. level: the light. what, action: in sentences. moved: from where to
    where, if it is recorded on elsewhere."""

    level: Level
    what: str
    action: str = ""
    moved: tuple[Path, Path] | None = None


class Safekeeping:
    """Looks after the file of a take. For the thread that writes it; `trouble` may be read from any.

    A file that was moved is followed. One that was deleted or replaced, or whose folder is gone, is copied from the
    open descriptor beside its old name, or else to the refuge, while the recording goes on. So is what is left of one
    that another program cut short or wrote into: who does that once may do it again.
    """

    def __init__(
        self, file: RecordFile, beginning: bytes, name: str, refuge: Path | None, notify: Callable[[Notice], None]
    ) -> None:
        """beginning: what the file holds before its first frame. name: of the take. refuge: where it is put in safety
        if its own folder is gone or full. Raises OSError if the folder is gone already."""
        self._file, self._name, self._refuge, self._notify = file, name, refuge, notify
        self._beginning = beginning
        self._home = file.path.parent
        self._home_status = self._home.stat()
        self._rescue: Rescue | None = None
        self._fate = self._said = Fate.HERE
        self._failed: TakeError | None = None
        self._pause = 0  # looks until the next try
        self.cut = False
        """Whether another program has cut it short or written into it: what was there may be lost."""
        self.trouble = ""
        """What is wrong with the file, in a few words; "" while it is where it was."""
        self.history = ""
        """What befell the file and where it is safe now, as a sentence; "" if nothing did."""

    @property
    def rescuing(self) -> bool:
        """What the file holds is being copied: `rescue_on` is to be called."""
        return self._rescue is not None

    @property
    def safe(self) -> bool:
        """Whether the file has a name under which it is found."""
        return self._rescue is None and self._failed is None

    @property
    def level(self) -> Level:
        """Of `trouble`: what was cut off is lost, whatever is safe now."""
        return Level.WARNING if self.safe and not self.cut else Level.PROBLEM

    def look(self) -> None:
        """Looks whether the file still has its name, and does what must be done if not. To be called about twice a
        second. Never raises."""
        if self._file.closed:
            return
        if self._rescue is not None:
            if self._rescue.target.place.fate is Fate.HERE:
                return
            self.give_up()  # the copy was deleted as well
            self._said = Fate.HERE
        place = self._file.place
        if place.fate is Fate.HERE:
            self._failed, self._said = None, Fate.HERE
        elif place.fate is Fate.MOVED and place.path is not None:
            self._follow(place.path)
        else:
            self._begin_rescue(place.fate)

    def rescue_on(self) -> None:
        """Copies a slice of the file to where it is safe. Never raises."""
        rescue = self._rescue
        if rescue is None:
            return
        try:
            done = rescue.step()
        except TakeError as error:
            self._not_rescued(error)
            return
        self.trouble = f"{self._befallen}: {rescue.share:.0%} of it is copied to a safe place"
        if done:
            self._settle(rescue)

    def secure(self) -> None:
        """Makes sure that the file has a name. Raises TakeError if what it holds can be copied nowhere."""
        self._pause, self._failed = 0, None
        self.look()
        while self._rescue is not None:
            self.rescue_on()
        if self._failed is not None:
            raise self._failed

    def find_out(self) -> bool:
        """Puts the file in safety, as `secure` does; whether anything that was in it may be lost. Raises TakeError."""
        self.secure()
        return self.cut

    def give_up(self) -> None:
        """Takes away what is copied so far."""
        if self._rescue is not None:
            self._rescue.give_up()
            self._rescue = None

    @property
    def _befallen(self) -> str:
        return f"Its file {self._fate.value}"

    def _follow(self, path: Path) -> None:
        before, self._file.path = self._file.path, path
        self._fate, self._failed = Fate.MOVED, None
        self._remember_home()
        self.history = f"Its file was moved while it was recorded, to {path}."
        self.trouble = f"Its file was moved to {path}"
        self._notify(
            Notice(Level.WARNING, f"Take {before} was moved: it is recorded on in {path}.", moved=(before, path))
        )

    def _begin_rescue(self, fate: Fate) -> None:
        if self._pause > 0:
            self._pause -= 1
            return
        if self._said is not fate:
            self._fate = self._said = fate
            self.trouble = self._befallen
            what = f"While it is recorded, take {self._file.path} {fate.value}."
            action = "What it holds is copied to a safe place. Keep other programs off the take folder."
            if fate is Fate.CUT:
                action = "What came before may be lost: record it again, and keep other programs off the take folder."
            self._notify(Notice(Level.PROBLEM, what, action))
        self.cut = self.cut or self._file.cut_at is not None
        folders = [self._home] if is_at(self._home_status, self._home) else []
        if self._refuge is not None and self._refuge != self._home:
            folders.append(self._refuge)
        try:
            self._rescue = Rescue(self._file, self._beginning, folders, self._name)
        except TakeError as error:
            self._not_rescued(error)

    def _not_rescued(self, error: TakeError) -> None:
        self._rescue = None
        self._pause = _LOOKS_BETWEEN_TRIES
        self._failed = error
        self.trouble = f"{self._befallen} and could not be copied to a safe place"
        self._notify(Notice(Level.PROBLEM, error.what, error.action))

    def _settle(self, rescue: Rescue) -> None:
        self._rescue, self._failed, self._said = None, None, Fate.HERE
        before = self._file.path
        self._file.take_over(rescue.target)
        self._remember_home()
        what = "what could be saved of it is" if self.cut else "it was rescued as"
        self.history = f"{self._befallen} while it was recorded; {what} {self._file.path}."
        self.trouble = f"{self._befallen}: rescued as {self._file.path.name}"
        if self.cut:
            self.trouble = "Its file was cut by another program: frames may be lost"
        if rescue.unreadable:
            self.history += f" {rescue.unreadable:,} bytes of it could not be read."
        safe = "goes on" if self.cut else "is safe"
        what = f"Take {self._name} {safe}: it is recorded on in {self._file.path}."
        self._notify(Notice(Level.WARNING, what, moved=(before, self._file.path)))

    def _remember_home(self) -> None:
        self._home = self._file.path.parent
        with contextlib.suppress(OSError):  # what is gone already is found out by the next look
            self._home_status = self._home.stat()
