"""Recordings of other programs become takes: chosen, solved beside the window, opened."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Qt, QTimer, Signal
from PySide6.QtWidgets import QWidget

from app.notifications import NotificationCentre
from app.review import document as work
from app.review.import_batch import Batch, Wanted
from app.review.import_dialog import ImportDialog, choose_recordings
from app.review.job import Report
from app.review.job_bar import JobBar
from app.review.outcome import Outcome
from app.review.solving import Run
from app.settings import IMPORT_FOLDER, WHOLE_TAKE_LABELS, Settings
from app.take_plan import TakePlan
from core.cast import Cast
from core.errors import CancelledError
from core.profile import Profile
from core.takes.drafts import clear_drafts

IMPORTING = "Importing"
SOURCE = "Import"
WAIT_MS = 200


class Importing(QObject):
    """Each recording is a take as soon as it is solved; one that cannot be read does not stop the others. What is
    chosen while others are imported, or while another job runs, follows them."""

    began = Signal()
    one_made = Signal()
    """There is one take more; from the thread of the job."""

    def __init__(
        self,
        room: QWidget,
        plan: TakePlan,
        settings: Settings,
        notifications: NotificationCentre,
        profiles: Callable[[], Sequence[Profile]],
        run: Run,
        made: Callable[[Path], bool],
        jobs: JobBar,
        outcome: Outcome,
    ) -> None:
        """made: called with the last take that was made, when all are; whether it is opened. jobs: where `run` runs."""
        super().__init__(room)
        self._room, self._plan, self._settings, self._notifications = room, plan, settings, notifications
        self._profiles, self._run, self._made = profiles, run, made
        self._jobs, self._outcome = jobs, outcome
        self.dialog: ImportDialog | None = None
        self.batch: Batch | None = None
        """What is being imported, None if nothing is."""
        clear_drafts(plan.folder)

    def ask(self, paths: Sequence[Path] = ()) -> None:
        """Ask for recordings and performers, and import."""
        if self.dialog is not None:
            self.dialog.set_files(paths or self.dialog.paths)
            return
        paths = paths or choose_recordings(self._room, self._settings, self._plan.folder)
        if not paths:
            return
        whole = self._settings.get(WHOLE_TAKE_LABELS, True)
        dialog = ImportDialog(paths, self._profiles(), self._plan.folder, self._room, whole, self._settings)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.accepted.connect(self._asked)
        dialog.finished.connect(lambda _: setattr(self, "dialog", None))
        self.dialog = dialog
        dialog.open()

    def _asked(self) -> None:
        dialog = self.dialog
        if dialog is not None:
            self._settings.set(WHOLE_TAKE_LABELS, dialog.whole.isChecked())
            self._settings.set(IMPORT_FOLDER, str(dialog.paths[0].parent))
            self.import_files(dialog.paths, dialog.profiles)

    def import_files(self, paths: Sequence[Path], cast: Cast) -> None:
        """Import these, with these performers; points named as was chosen last."""
        folder, live_labels = self._plan.folder, not self._settings.get(WHOLE_TAKE_LABELS, True)
        wanted = [Wanted(path, folder, cast, live_labels) for path in paths]
        if not wanted:
            return
        if self.batch is not None:
            self.batch.wanted += wanted
            self._say_waiting(len(wanted), "those before")
            return
        if self._jobs.job is not None:
            self._say_waiting(len(wanted), self._jobs.job.title.lower())
        self.batch = Batch(wanted)
        self._outcome.hide()
        self.began.emit()
        self._start()

    @property
    def words(self) -> str:
        """How far it is, "" if nothing is imported."""
        return self.batch.words if self.batch is not None else ""

    def cancel(self) -> None:
        """Stop; the takes that are made stay."""
        if self.batch is not None and self._jobs.job is not None and self._jobs.job.title == IMPORTING:
            self._jobs.cancel()
        else:
            self._ended(cancelled=True)

    def stop(self) -> None:
        """The application ends: nothing begins any more."""
        self.batch = None

    def _say_waiting(self, n: int, what: str) -> None:
        text = "One more recording is imported" if n == 1 else f"{n} more recordings are imported"
        self._notifications.info(f"{text} after {what}.", source=SOURCE)

    def _start(self) -> None:
        """Once no other job runs."""
        batch = self.batch
        if batch is None:
            return
        if self._jobs.job is not None:
            QTimer.singleShot(WAIT_MS, self, self._start)
            return
        self._run(
            IMPORTING,
            lambda report: self._import(batch, report),
            lambda _: self._ended() if batch.at >= len(batch.wanted) else self._start(),  # some came at the last moment
            lambda: self._ended(cancelled=True),
        )

    def _import(self, batch: Batch, report: Report) -> None:
        """In the thread of the job; messages may come from any."""
        while batch.at < len(batch.wanted):
            one = batch.wanted[batch.at]
            part = _Part(report, batch)
            part(0.0, "Reading")  # its process takes a moment to start
            try:
                target, told = work.import_recording(one.path, one.folder, one.cast, one.live_labels, part)
            except CancelledError:
                raise
            except Exception as error:
                batch.failed.append((one.path, error))
                self._notifications.error(error, SOURCE, f"Importing {one.path.name}")
            else:
                batch.made.append(target)
                self._tell(batch, one.path, target, told)
                self.one_made.emit()
            batch.at += 1

    def _tell(self, batch: Batch, path: Path, target: Path, told: dict[str, Any]) -> None:
        names = "its labels are used" if told["labels_given"] else "its points were named anew"
        self._notifications.info(
            f"{path.name} was imported as {target.name}: {told['frames']:,} frames, {names}.", source=SOURCE
        )
        said = [*told["warnings"], *told["doubts"]]
        for text in said:
            self._notifications.warning(f"{path.name}: {text}", source=SOURCE)
        if said:
            batch.doubtful.append((path, said))

    def _ended(self, cancelled: bool = False) -> None:
        batch, self.batch = self.batch, None
        if batch is None:
            return
        opened = bool(batch.made) and not cancelled and self._made(batch.made[-1])
        words = batch.summary(cancelled)
        if cancelled or len(batch.wanted) > 1:
            tell = self._notifications.info if batch.well else self._notifications.warning
            tell(words, source=SOURCE)
        if cancelled or not opened or not batch.well:
            path = batch.made[-1] if batch.made and not opened else None
            self._outcome.say(words, batch.reasons, path)


class _Part(Report):
    """The report of one of several recordings, which names its file."""

    def __init__(self, whole: Report, batch: Batch) -> None:
        self._whole, self._batch = whole, batch

    def __call__(self, share: float, text: str = "") -> bool:
        """As a Report."""
        at, wanted = self._batch.at, self._batch.wanted
        self._batch.share = share
        text = f"{wanted[at].path.name}: {text[:1].lower()}{text[1:]}"
        if len(wanted) > 1:
            text = f"{at + 1} of {len(wanted)}: {text}"
        return self._whole((at + share) / len(wanted), text)

    @property
    def stopped(self) -> bool:
        """As a Report."""
        return self._whole.stopped
