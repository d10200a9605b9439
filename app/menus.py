"""The menu bar: every action of the window by name, with its key."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QAction, QDesktopServices, QKeySequence
from PySide6.QtWidgets import QMainWindow, QMenu, QMenuBar, QMessageBox

from app import settings as names
from app import shortcuts
from app.notifications import log_folder
from app.viewport.viewport import Viewport

if TYPE_CHECKING:
    from app.main_window import MainWindow

ViewSetting = Callable[[Viewport, bool], None]

VIEWS: tuple[tuple[str, str, Callable[[Viewport], None]], ...] = (
    ("Fit to hands and props", shortcuts.FIT, Viewport.view_fit),
    ("Front", shortcuts.FRONT, Viewport.view_front),
    ("Side", shortcuts.SIDE, Viewport.view_side),
    ("Top", shortcuts.TOP, Viewport.view_top),
)
VIEW_SETTINGS: tuple[tuple[str, str, ViewSetting, bool], ...] = (
    ("Follow the hands", shortcuts.FOLLOW, Viewport.set_follow_hand, False),
    ("Surface", "", Viewport.set_surface_shown, True),
    ("Skeleton", shortcuts.SKELETON, Viewport.set_skeleton_shown, False),
    ("Marker names", shortcuts.NAMES, Viewport.set_names_shown, False),
    ("Colour by digit", shortcuts.DIGITS, Viewport.set_colour_by_digit, False),
)
ABOUT = "Phalanx\n\nMarker-based hand motion capture: live tracking, recording, review and export."


def make_action(window: QMainWindow, text: str, keys: str, do: Callable[[], object]) -> QAction:
    """An action that works anywhere in the window."""
    action = QAction(text, window)
    action.setShortcut(QKeySequence(keys))
    action.setShortcutContext(Qt.ShortcutContext.WindowShortcut)
    action.triggered.connect(lambda _=False: do())
    window.addAction(action)
    return action


def make_menus(window: MainWindow, bar: QMenuBar) -> list[tuple[QAction, ViewSetting]]:
    """Fill the bar. Returns the switches of the view, for a second viewport to follow."""
    file = bar.addMenu("File")
    file.setToolTipsVisible(True)
    file.addActions([window.open_action, window.import_action])
    _add(window, file, "Open take folder", "", window.recorder.show_folder)
    file.addSeparator()
    _add(window, file, "Quit", shortcuts.QUIT, window.close)

    edit = bar.addMenu("Edit")
    undo, redo = window.stacks.createUndoAction(window, "Undo"), window.stacks.createRedoAction(window, "Redo")
    undo.setShortcut(QKeySequence(shortcuts.UNDO))
    redo.setShortcuts([QKeySequence(shortcuts.REDO), QKeySequence(shortcuts.REDO_TOO)])
    edit.addActions([undo, redo])
    edit.aboutToShow.connect(lambda: window.keys.leave_fields())  # what was typed last is what Undo takes back

    session = bar.addMenu("Session")
    session.addActions([window.live_action, window.review_action])
    session.addSeparator()
    session.addActions([window.record_action, window.mark_action, window.look_back_action])
    session.addSeparator()
    session.addActions([window.connect_action, window.search_action])
    session.addSeparator()
    session.addActions([window.hold_action, window.prop_action])
    session.addSeparator()
    session.addAction(window.train_action)

    view = bar.addMenu("View")
    for text, keys, do in VIEWS:
        _add(window, view, text, keys, lambda do=do: do(window.shown_viewport))
    view.addSeparator()
    switches = []
    for text, keys, setting, on in VIEW_SETTINGS:
        action = _add(window, view, text, keys, lambda: None)
        action.setCheckable(True)
        action.setChecked(on)
        action.toggled.connect(lambda on, setting=setting: window.set_view(setting, on))
        key = names.VIEW + text.lower().replace(" ", "_")
        action.setChecked(window.settings.get(key, on))
        action.toggled.connect(lambda on, key=key: window.settings.set(key, on))
        switches.append((action, setting))

    panels = bar.addMenu("Window")
    for dock in window.docks.values():
        panels.addAction(dock.toggleViewAction())
    panels.addSeparator()
    _add(window, panels, "Reset layout", "", window.reset_layout)

    about = bar.addMenu("Help")
    _add(window, about, "Keyboard shortcuts", shortcuts.SHORTCUTS, lambda: shortcuts.ShortcutsDialog(window).show())
    _add(window, about, "Open log folder", "", lambda: QDesktopServices.openUrl(QUrl.fromLocalFile(str(log_folder()))))
    _add(window, about, "Left by earlier runs…", "", lambda: window.left_behind.look(asked=True))
    _add(window, about, "About Phalanx", "", lambda: QMessageBox.about(window, "About Phalanx", ABOUT))
    return switches


def _add(window: QMainWindow, menu: QMenu, text: str, keys: str, do: Callable[..., object]) -> QAction:
    action = make_action(window, text, keys, do)
    menu.addAction(action)
    return action
