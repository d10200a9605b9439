"""The docks: where panels sit, remembered between starts, and put aside while review has the room."""

from __future__ import annotations

import base64
from collections.abc import Sequence

from PySide6.QtCore import QByteArray, QPoint, QRect, QSize, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QDockWidget, QMainWindow

from app import settings as names
from app.panels.panel import Panel
from app.settings import Settings

LAYOUT_VERSION = 1
LARGE_ENOUGH = QSize(1600, 950)
TITLE_BAR_PX = 32
"""Left to the desktop's frame around the window."""
LEFT_WIDTH, RIGHT_WIDTH, BOTTOM_HEIGHT = 320, 320, 210
DEVICES_SHARE, RECORDER_SHARE = 300, 500
LEFT, RIGHT, BOTTOM = (
    Qt.DockWidgetArea.LeftDockWidgetArea,
    Qt.DockWidgetArea.RightDockWidgetArea,
    Qt.DockWidgetArea.BottomDockWidgetArea,
)
AREAS = {"devices": LEFT, "recorder": LEFT, "tracking": RIGHT, "plots": BOTTOM, "messages": BOTTOM}


class Docks:
    """A dock per panel, by the panel's key."""

    def __init__(self, window: QMainWindow, panels: Sequence[Panel], settings: Settings) -> None:
        self._window, self._settings = window, settings
        self._put_aside: QByteArray | None = None
        self.docks = {panel.key: self._dock(panel) for panel in panels}
        window.setDockOptions(
            QMainWindow.DockOption.AnimatedDocks
            | QMainWindow.DockOption.AllowTabbedDocks
            | QMainWindow.DockOption.AllowNestedDocks
        )
        for corner, area in (
            (Qt.Corner.BottomLeftCorner, LEFT),
            (Qt.Corner.TopLeftCorner, LEFT),
            (Qt.Corner.BottomRightCorner, RIGHT),
            (Qt.Corner.TopRightCorner, RIGHT),
        ):
            window.setCorner(corner, area)

    def first_size(self) -> None:
        """The window as a new operator meets it: as large as is of use, on a smaller screen all of it."""
        window, screen = self._window, self._window.screen().availableGeometry()
        room = QSize(screen.width(), screen.height() - TITLE_BAR_PX)
        window.resize(LARGE_ENOUGH.boundedTo(room))
        window.move(screen.topLeft() + QPoint((screen.width() - window.width()) // 2, 0))
        if window.size() != LARGE_ENOUGH:
            window.setWindowState(Qt.WindowState.WindowMaximized)

    def arrange(self) -> None:
        """The layout a new operator meets."""
        window, docks = self._window, self.docks
        for key, dock in docks.items():
            dock.setFloating(False)
            window.addDockWidget(AREAS[key], dock)
            dock.show()
        window.tabifyDockWidget(docks["plots"], docks["messages"])
        docks["plots"].raise_()
        horizontal, vertical = Qt.Orientation.Horizontal, Qt.Orientation.Vertical
        window.resizeDocks([docks["devices"], docks["tracking"]], [LEFT_WIDTH, RIGHT_WIDTH], horizontal)
        window.resizeDocks([docks["devices"], docks["recorder"]], [DEVICES_SHARE, RECORDER_SHARE], vertical)
        window.resizeDocks([docks["plots"]], [BOTTOM_HEIGHT], vertical)
        self._default = window.saveState(LAYOUT_VERSION)

    def reset(self) -> None:
        """Back to the layout of a fresh start."""
        self._put_aside = None
        self._window.restoreState(self._default, LAYOUT_VERSION)
        self.arrange()
        self._settings.forget(names.LAYOUT)

    def put_aside(self) -> None:
        """Hide every dock until `bring_back`."""
        if self._put_aside is None:
            self._put_aside = self._window.saveState(LAYOUT_VERSION)
            for dock in self.docks.values():
                dock.hide()

    def bring_back(self) -> None:
        """The docks as they were before `put_aside`."""
        if self._put_aside is not None:
            self._window.restoreState(self._put_aside, LAYOUT_VERSION)
            self._put_aside = None

    def save(self) -> None:
        """Remember size and layout of the window."""
        state = self._put_aside or self._window.saveState(LAYOUT_VERSION)
        self._settings.set(names.GEOMETRY, base64.b64encode(self._window.saveGeometry().data()).decode())
        self._settings.set(names.LAYOUT, base64.b64encode(state.data()).decode())

    def restore(self) -> None:
        """Size and layout as they were remembered, if they were."""
        geometry, state = self._settings.get(names.GEOMETRY, ""), self._settings.get(names.LAYOUT, "")
        try:
            if geometry:
                self._window.restoreGeometry(QByteArray(base64.b64decode(geometry)))
            if state:
                self._window.restoreState(QByteArray(base64.b64decode(state)), LAYOUT_VERSION)
        except ValueError:
            self.reset()
        self._onto_screen()

    def _onto_screen(self) -> None:
        """A place remembered from another screen is brought into one there is."""
        window, held = self._window, self._window.geometry()
        middle = window.screen() if not held.isValid() else QGuiApplication.screenAt(held.center()) or window.screen()
        screen = middle.availableGeometry()
        size = held.size().boundedTo(screen.size())
        left = min(max(held.left(), screen.left()), screen.left() + screen.width() - size.width())
        top = min(max(held.top(), screen.top()), screen.top() + screen.height() - size.height())
        if QRect(left, top, size.width(), size.height()) != held:
            window.setGeometry(left, top, size.width(), size.height())

    def _dock(self, panel: Panel) -> QDockWidget:
        dock = QDockWidget(panel.title, self._window)
        dock.setObjectName(panel.key)
        dock.setWidget(panel)
        panel.titled.connect(dock.setWindowTitle)
        dock.visibilityChanged.connect(panel.set_in_sight)
        dock.setFeatures(
            QDockWidget.DockWidgetFeature.DockWidgetMovable
            | QDockWidget.DockWidgetFeature.DockWidgetFloatable
            | QDockWidget.DockWidgetFeature.DockWidgetClosable
        )
        return dock
