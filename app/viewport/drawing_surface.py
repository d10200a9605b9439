"""Where the scene is drawn: a vispy canvas that survives being moved to another window."""

from __future__ import annotations

import logging
from collections.abc import Callable

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QVBoxLayout, QWidget
from vispy import app as vispy_app

from app.viewport.scene import Scene

log = logging.getLogger(__name__)
# Bare machines have no tool to ask, and nothing here looks at it: Qt knows the screen.
logging.getLogger("vispy").addFilter(lambda record: "could not determine DPI" not in record.getMessage())

Draw = Callable[[Scene, tuple[int, int], float], None]


class DrawingSurface(QWidget):
    """Calls `draw(scene, size_px, pixel_ratio)` in its paint event, with the GL context current.

    `make_scene` is called at the first drawing, and again where Qt replaces the context (a dock that floats, a
    widget moved to another window): what the old one held is gone then.
    `failed` carries the reason when drawing raised; nothing is drawn after it.
    """

    failed = Signal(str)

    def __init__(self, parent: QWidget, make_scene: Callable[[], Scene], draw: Draw) -> None:
        super().__init__(parent)
        self._make_scene, self._draw = make_scene, draw
        # mouse and keys go to the parent, in Qt's own events
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setLayout(QVBoxLayout())
        self.layout().setContentsMargins(0, 0, 0, 0)
        self._make_canvas()

    def redraw(self) -> None:
        """Draw at the next turn of the event loop."""
        self._canvas.native.update()

    def image(self) -> QImage:
        """The scene as drawn now, in device pixels."""
        return self._canvas.native.grabFramebuffer()

    def _make_canvas(self) -> None:
        self._scene: Scene | None = None
        self._usable, self._contexts = True, 0
        self._canvas = vispy_app.Canvas(
            app="pyside6", parent=self, show=False, keys=None, vsync=False, autoswap=False,
            config={"samples": 0, "depth_size": 24, "double_buffer": True},
        )  # fmt: skip
        self._canvas.events.initialize.connect(self._on_initialize)
        self._canvas.events.draw.connect(self._on_draw)
        self._canvas.native.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.layout().addWidget(self._canvas.native)

    def _on_initialize(self, event: object) -> None:
        self._contexts += 1
        if self._contexts > 1 and self._usable:
            self._usable = False
            QTimer.singleShot(0, self, self._replace_canvas)

    def _replace_canvas(self) -> None:
        """vispy cannot move what a canvas holds to another context."""
        old = self._canvas.native
        self._canvas.events.disconnect()
        self.layout().removeWidget(old)
        old.hide()
        old.deleteLater()
        self._make_canvas()

    def _on_draw(self, event: object) -> None:
        if not self._usable:
            return
        try:
            if self._scene is None:
                self._scene = self._make_scene()
            self._draw(self._scene, self._canvas.physical_size, self._canvas.native.devicePixelRatioF())
        except Exception as error:
            # a driver that fails must not take the recording with it
            log.exception("the 3D view cannot draw")
            self._usable = False
            reason = f"The graphics driver failed ({error}). Update it, then start Phalanx again."
            QTimer.singleShot(0, self, lambda: self.failed.emit(reason))
