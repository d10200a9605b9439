"""Looks at the start for what earlier runs left behind, and does with it what the operator wants."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from PySide6.QtWidgets import QWidget

from app import settings as names
from app.left_behind.cut_takes import CutTake, restore
from app.left_behind.dialog import LeftBehindDialog
from app.left_behind.found import Found, look, size_words
from app.left_behind.leftovers import Leftover, clear
from app.left_behind.run_file import EndedRun, settle
from app.review.job import Job, Report
from app.settings import Settings
from app.worker import SessionWorker

SOURCE = "Earlier runs"
WHERE = "See Help > Left by earlier runs…"


class LeftBehindDesk:
    """Nothing here is in the way of work: it looks off the window's thread, and its dialog takes no keys."""

    def __init__(
        self, worker: SessionWorker, settings: Settings, folder: Callable[[], Path], review: Callable[[Path], None],
        parent: QWidget,
    ) -> None:  # fmt: skip
        """folder: where takes go. review: opens a take."""
        self._worker, self._settings, self._folder, self._review, self._parent = (
            worker,
            settings,
            folder,
            review,
            parent,
        )
        self.dialog: LeftBehindDialog | None = None
        self.found = Found()
        self._told = ""  # of what there is, as the strip may still show it
        self._recovered: list[Path] = []
        self._job: Job | None = None
        self._recovering: Path | None = None

    def look(self, asked: bool = False) -> None:
        """Look, and show it if there is something; if asked for, in any case."""
        folder, kept = self._folder(), frozenset(self._kept)
        self._worker.background(lambda: look(folder, kept), lambda found: self._show(found, asked))

    def stop(self) -> None:
        """The application ends; a take that is being recovered stays as it was."""
        if self._job is not None:
            self._job.cancel()
            self._job.join()

    @property
    def _kept(self) -> list[str]:
        return [path for path in self._settings.get(names.LEFT_KEPT, []) if isinstance(path, str)]

    def _show(self, found: Found, asked: bool) -> None:
        self.found = found
        if found and not asked and self.dialog is None:
            self._worker.notifications.warning(found.words, WHERE, SOURCE)
            self._told = found.words
        elif self._told and self._told != found.words:
            self._told = found.words
            left = f"Still left by earlier runs: {found.words}" if found else "Nothing is left by earlier runs."
            self._worker.notifications.info(left, source=SOURCE, settles=True)
        if not found and not asked and self.dialog is None:
            return
        if self.dialog is None:
            self.dialog = LeftBehindDialog(self._parent)
            self.dialog.recover_asked.connect(self._recover)
            self.dialog.review_asked.connect(self._review)
            self.dialog.clear_asked.connect(self._clear)
            self.dialog.keep_asked.connect(self._keep)
            self.dialog.settled.connect(self._settle)
            asked = True
        self._refresh()
        if asked:
            self.dialog.show()
            self.dialog.raise_()

    def _refresh(self) -> None:
        if self.dialog is not None:
            self.dialog.show_found(self.found, tuple(self._recovered), self._recovering)

    def _recover(self, take: CutTake) -> None:
        from app.review.document import rescue

        def work(report: Report) -> Path:
            return rescue(restore(take.path) if take.only_copy else take.path, report)

        def done(path: Path) -> None:
            self._recovered.append(path)
            self._worker.notifications.info(f"Take {path.stem} is whole now.", source=SOURCE)
            ended()

        def ended() -> None:
            self._job = self._recovering = None
            self.look()

        self._recovering = take.path
        self._job = Job("Recovering", work, self._parent)
        self._job.succeeded.connect(done)
        self._job.failed.connect(lambda error: (self._worker.notifications.error(error, SOURCE, "Recovering"), ended()))
        self._job.cancelled.connect(ended)
        self._job.start()
        self._refresh()

    def _clear(self, files: Sequence[Leftover]) -> None:
        folder = self._folder()

        def work() -> int:
            gone, refused = clear(folder, files)
            for path, why in refused.items():
                self._worker.notifications.warning(f"{path} cannot be removed ({why}).", "Remove it by hand.", SOURCE)
            return sum(file.bytes for file in gone)

        def done(cleared: int) -> None:
            self._worker.notifications.info(
                f"{size_words(cleared)} of files that nobody needs were cleared.", source=SOURCE
            )
            self.look()

        self._worker.background(work, done)

    def _keep(self, paths: Sequence[Path]) -> None:
        self._settings.set(names.LEFT_KEPT, [*(path for path in self._kept if Path(path).exists()), *map(str, paths)])
        self.look()

    def _settle(self, run: EndedRun) -> None:
        settle(run)
        self.look()
