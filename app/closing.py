"""What the operator is asked for before the window closes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtWidgets import QMessageBox

if TYPE_CHECKING:
    from app.main_window import MainWindow


class Closing:
    """The questions before a window closes, once at a time."""

    def __init__(self, window: MainWindow) -> None:
        self._window, self._asking = window, False

    @property
    def asking(self) -> bool:
        """One is open."""
        leaving = self._window.leaving
        return self._asking or (leaving is not None and leaving.box is not None)

    @property
    def may_lose(self) -> list[str]:
        """What becomes of that which is asked for, in words, if the window closes without an answer."""
        window = self._window
        becomes = []
        if window.worker.session.recording:
            becomes.append("the take is finished")
        if window.importing is not None and window.importing.batch is not None:
            becomes.append("the import is cancelled")
        if window.training.training:
            becomes.append("the training is ended")
        if window.leaving is not None and not window.leaving.free and not becomes:
            becomes.append("what is not saved in review is dropped")
        return becomes

    def may(self) -> bool:
        """Whether nothing would be lost that the operator has not been asked for. If a solution in review would be, the
        window closes itself once that is settled; while he is being asked, it does not close for being told again."""
        if self._asking:
            return False
        self._asking = True
        try:
            return _may_close(self._window)
        finally:
            self._asking = False


def _may_close(window: MainWindow) -> bool:
    if window.leaving is not None and not window.leaving.free:
        window.show_review(True)
        window.leaving.ask("Phalanx is closed", window.close)
        return False
    if window.worker.session.recording and not _may_stop(window):
        return False
    if window.importing is not None and window.importing.batch is not None and not _may_end_import(window):
        return False
    return not window.training.training or _may_end_training(window)


def _may_stop(window: MainWindow) -> bool:
    answer = QMessageBox.question(
        window,
        "Still recording",
        f"Take {window.worker.session.recording_name} is still being recorded. Stop it, save it and quit?",
        QMessageBox.StandardButton.Save | QMessageBox.StandardButton.Cancel,
        QMessageBox.StandardButton.Save,
    )
    return answer == QMessageBox.StandardButton.Save


def _may_end_import(window: MainWindow) -> bool:
    box = QMessageBox(QMessageBox.Icon.Question, "Still importing", "", QMessageBox.StandardButton.NoButton, window)
    batch = window.importing.batch if window.importing is not None else None
    if batch is not None:
        done, count = batch.at, len(batch.wanted)
        so_far = f"{done} of {count} {'is' if done == 1 else 'are'} done" if count > 1 else f"{batch.share:.0%} is done"
        box.setText(f"An import is running: {so_far}.")
    box.setInformativeText("Cancel it and quit? The takes that are made stay.")
    end = box.addButton("Cancel it and quit", QMessageBox.ButtonRole.DestructiveRole)
    go_on = box.addButton("Go on", QMessageBox.ButtonRole.RejectRole)
    box.setDefaultButton(go_on)
    box.setEscapeButton(go_on)
    box.exec()
    return box.clickedButton() is end


def _may_end_training(window: MainWindow) -> bool:
    box = QMessageBox(
        QMessageBox.Icon.Question,
        "Still training",
        "A labelling network is still being trained.",
        QMessageBox.StandardButton.NoButton,
        window,
    )
    box.setInformativeText("End that and quit? The best network so far is kept, if there is one yet.")
    end = box.addButton("End training and quit", QMessageBox.ButtonRole.DestructiveRole)
    box.setEscapeButton(box.addButton("Go on training", QMessageBox.ButtonRole.RejectRole))
    box.exec()
    return box.clickedButton() is end
