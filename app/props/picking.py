"""Props from points that are picked, in the live view and in review."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QDialog, QWidget

from app.props.bar import SelectionBar
from app.props.define_dialog import DefineDialog
from app.props.desk import PropDesk
from app.props.examined import Examined, examine
from app.props.picker import PointPicker
from app.review.document import ReviewDocument
from app.review.job import Report
from app.review.player import Player
from app.viewport.viewport import Viewport
from core.errors import PhalanxError
from core.frames import MarkerFrame
from core.profile import Profile
from core.props.prop import LEAST_MARKERS, Prop
from core.takes.reader import open_take


class Picking(QObject):
    """Picker, bar and dialog of one view."""

    def __init__(self, viewport: Viewport, desk: PropDesk, live: bool) -> None:
        super().__init__(viewport)
        self.viewport, self.desk = viewport, desk
        self.picker = PointPicker(viewport)
        self.bar = SelectionBar(self.picker, live)
        self.bar.make_asked.connect(self.make)
        self.dialog: DefineDialog | None = None

    def make(self) -> None:
        """Ask for name and shape of a prop of the points picked. What does not do is told."""
        rows = self.picker.rows
        missing = sum(row < 0 for row in rows)
        if self.dialog is not None:
            return
        try:
            if len(rows) < LEAST_MARKERS:
                raise PhalanxError(
                    f"A prop takes {LEAST_MARKERS} points or more; {len(rows) or 'none'} picked.",
                    "In the 3D view, Shift+click points that are no hand's, or Ctrl+drag around them.",
                )
            if missing:
                raise PhalanxError(
                    f"{missing} of the {len(rows)} points picked are not in this frame.",
                    "Go to a moment at which all are seen.",
                )
            work = self._work(rows)
        except PhalanxError as error:
            self.desk.worker.notifications.error(error, "Props")
            return
        names = tuple(prop.name for prop in self.desk.props)
        self.dialog = DefineDialog(work, self.desk.free_name(), names, self._can_solve, self._window())
        self.dialog.finished.connect(self._answered)
        self.dialog.open()

    def stop(self) -> None:
        """The application ends: so does a dialog that is open."""
        if self.dialog is not None:
            self.dialog.stop()

    @property
    def _can_solve(self) -> bool:
        """Whether to offer to solve again with the prop."""
        return False

    def _work(self, rows: list[int]) -> Callable[[Report], Examined]:
        """What examines the points. Raises PhalanxError."""
        raise NotImplementedError

    def _made(self, prop: Prop, solve: bool) -> None:
        """A prop was made."""
        self.desk.add(prop)

    def _window(self) -> QWidget:
        return self.viewport.window()

    def _answered(self, result: int) -> None:
        dialog, self.dialog = self.dialog, None
        if dialog is None:
            return
        dialog.deleteLater()
        if result == QDialog.DialogCode.Accepted and dialog.prop is not None:
            self.picker.clear()
            self._made(dialog.prop, dialog.solve.isChecked())


class LivePicking(Picking):
    """Of the live view, which can be held: what comes in is then kept from the screen and nothing else.

    A prop is looked at in all frames that came in the last seconds before the view was held.
    """

    def __init__(self, viewport: Viewport, desk: PropDesk) -> None:
        super().__init__(viewport, desk, live=True)
        self.held = False
        self._before: tuple[Sequence[MarkerFrame], int] | None = None
        """While the view is held: the frames that came, and which of them is shown."""
        self.bar.hold_asked.connect(self.toggle_hold)

    def toggle_hold(self) -> None:
        """Hold the view, or go on."""
        self._hold(not self.held and self.picker.frame is not None and self.viewport.isVisible())

    def forget(self) -> None:
        """Nothing comes any more, or from elsewhere."""
        self._hold(False)

    def make(self) -> None:
        """The points must not run away meanwhile."""
        if len(self.picker.selection) >= LEAST_MARKERS and self.picker.frame is not None:
            self._hold(True)
        super().make()

    def _hold(self, held: bool) -> None:
        if held != self.held:
            shown = self.picker.frame
            self._before = self.desk.worker.session.look_back.about(shown) if held and shown is not None else None
            self.held = held
            self.bar.show_held(held)

    def _work(self, rows: list[int]) -> Callable[[Report], Examined]:
        if self._before is None:
            raise PhalanxError("The frame that is shown is not known any more.", "Pick the points again.")
        frames, at = self._before
        return lambda report: examine(frames, at, rows, report)

    def _made(self, prop: Prop, solve: bool) -> None:
        super()._made(prop, solve)
        self._hold(False)


class ReviewPicking(Picking):
    """Of a take in review.

    document: the take that can be read now. solve: solves it again.
    """

    solve_asked = Signal(object)
    """Profile."""

    def __init__(
        self, viewport: Viewport, desk: PropDesk, player: Player, document: Callable[[], ReviewDocument | None]
    ) -> None:
        super().__init__(viewport, desk, live=False)
        self._player, self._document = player, document

    @property
    def reading(self) -> bool:
        """Whether the file of the take is being read."""
        return self.dialog is not None

    @property
    def _can_solve(self) -> bool:
        return self._profile() is not None

    def make(self) -> None:
        """The points must not run away meanwhile."""
        self._player.pause()
        super().make()

    def _profile(self) -> Profile | None:
        document = self._document()
        return document.solved.profile if document is not None and document.solved is not None else None

    def _work(self, rows: list[int]) -> Callable[[Report], Examined]:
        document, at = self._document(), self._player.frame
        if document is None:
            raise PhalanxError("No take can be read now.", "Open a take, or wait until this one is saved.")
        path = document.path

        def work(report: Report) -> Examined:
            with open_take(path) as take:
                return examine(take.raw, at, rows, report)

        return work

    def _made(self, prop: Prop, solve: bool) -> None:
        profile = self._profile()
        super()._made(prop, solve)
        if solve and profile is not None:
            self.solve_asked.emit(profile.with_prop(prop))


def with_props(profile: Profile, props: tuple[Prop, ...]) -> Profile:
    """A profile with more props; those of the same name are replaced."""
    names = {prop.name for prop in props}
    return replace(profile, props=(*(prop for prop in profile.props if prop.name not in names), *props))
