"""What every dock panel has in common."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QSize, Qt, Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QLayout, QScrollArea, QVBoxLayout, QWidget

from app.lights import label, set_property

MARGIN = 10
SPACING = 8


class Panel(QWidget):
    """A dock's content. `title` names its tab, `key` its place in the saved layout."""

    title = ""
    key = ""
    titled = Signal(str)
    """Its tab is to be called so from now on."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("panel")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.in_sight = False
        """Not behind another tab; Qt calls a panel there visible, too."""

    def set_in_sight(self, seen: bool) -> None:
        """Its tab was brought to the front, or is no longer."""
        self.in_sight = seen


class _Tall(QScrollArea):
    """Never narrower than what it holds, its scroll bar beside it."""

    def minimumSizeHint(self) -> QSize:  # noqa: N802
        body, least = self.widget(), super().minimumSizeHint()
        if body is None:
            return least
        width = body.minimumSizeHint().width() + self.verticalScrollBar().sizeHint().width()
        return QSize(max(width, least.width()), least.height())

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802
        if watched is self.widget() and event.type() == QEvent.Type.LayoutRequest:
            self.updateGeometry()
        return super().eventFilter(watched, event)


def scrolling(body: QWidget) -> QScrollArea:
    """`body` in an area that scrolls vertically only, so that nothing is clipped on a small screen."""
    area = _Tall()
    area.setWidgetResizable(True)
    area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    area.setFrameShape(QFrame.Shape.NoFrame)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    body.setObjectName("panelBody")
    area.setWidget(body)
    keep_room_for(area)
    return area


def keep_room_for(area: QScrollArea) -> None:
    """The scroll bar has its room always, so that nothing moves when it comes; it is seen when it is needed."""
    area.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOn)
    bar = area.verticalScrollBar()
    bar.rangeChanged.connect(lambda low, high: set_property(bar, "idle", low == high))
    set_property(bar, "idle", bar.minimum() == bar.maximum())


def keep_room(*widgets: QWidget) -> None:
    """Widgets that come and go leave their room free, so that nothing moves."""
    for widget in widgets:
        policy = widget.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        widget.setSizePolicy(policy)


def clear(layout: QLayout, first: int = 0) -> None:
    """Take away what a layout holds from an item on; it is out of sight at once, for Qt removes it later."""
    while (item := layout.takeAt(first)) is not None:
        if (widget := item.widget()) is not None:
            widget.hide()
            widget.deleteLater()


def column(parent: QWidget | None = None, margin: int = MARGIN, spacing: int = SPACING) -> QVBoxLayout:
    """A vertical layout with the panels' spacing."""
    layout = QVBoxLayout(parent) if parent is not None else QVBoxLayout()
    layout.setContentsMargins(margin, margin, margin, margin)
    layout.setSpacing(spacing)
    return layout


def row(*widgets: QWidget | None, spacing: int = 6) -> QHBoxLayout:
    """Widgets side by side; None is a stretch."""
    layout = QHBoxLayout()
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(spacing)
    for widget in widgets:
        if widget is None:
            layout.addStretch(1)
        else:
            layout.addWidget(widget)
    return layout


def card() -> tuple[QFrame, QVBoxLayout]:
    """A framed group within a panel."""
    frame = QFrame()
    frame.setObjectName("card")
    return frame, column(frame, 10, 6)


def section(text: str) -> QLabel:
    """The heading of a group."""
    return label(text, "section")
