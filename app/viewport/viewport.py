"""The 3D view of hands, markers and props, as a widget."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QEvent, QPoint, Qt, QTimer, Signal
from PySide6.QtGui import (
    QFocusEvent,
    QHelpEvent,
    QHideEvent,
    QKeyEvent,
    QMouseEvent,
    QResizeEvent,
    QShowEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QLabel, QToolTip, QVBoxLayout, QWidget

from app.hand_words import performer_titles
from app.viewport import hover
from app.viewport.camera import OrbitCamera
from app.viewport.drawing_surface import DrawingSurface
from app.viewport.gl_support import gl_support
from app.viewport.legend import Legend
from app.viewport.marker_states import MarkerView, hand_points_m, marker_view, prop_points_m, tracked_hands
from app.viewport.name_tags import HoverTag, NameTags
from app.viewport.overlay import AxesGizmo, FocusRing, Message
from app.viewport.points_visual import MARKER_RADIUS_M, SMALLEST_PX
from app.viewport.scene import Scene, prop_poses
from app.viewport.tags import tags_of_hands, tags_of_markers, tags_of_props
from core.cast import Cast, cast_of, props_of, same_cast
from core.frames import FloatArray, MarkerFrame, TrackedFrame
from core.hand.model import template
from core.markers.layout import MarkerLayout
from core.profile import Profile

FRAMES_PER_SECOND = 60
FRAMES_PER_SECOND_SOFTWARE = 30
EMPTY_TITLE = "No device connected"
EMPTY_DETAIL = "Add one in the Devices panel, or start the demo there."
_ORBIT_RAD_PER_PIXEL = 0.008
_FOLLOW = 0.12
_EARLY = 0.3
_ROOM_TO_MOVE = 1.3
_OVERLAY_MARGIN = 10
_BY_KEYBOARD = (Qt.FocusReason.TabFocusReason, Qt.FocusReason.BacktabFocusReason)
_NOTHING, _POINTS = 0, 1
"""What the view was fitted to; with hands, _POINTS and their number."""


class Viewport(QWidget):
    """Shows the latest frame it was given, at most 60 times a second (30 where the processor draws).

    Left drag orbits, middle or Shift+left drag pans, the wheel zooms. Keys: F fit, 1 front, 3 side, 7 top.
    Without OpenGL it says why and shows nothing; everything else about it works.
    """

    drawn = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.camera = OrbitCamera()
        self.follow_hand = False
        self._frame: MarkerFrame | None = None
        self._tracked: TrackedFrame | None = None
        self._cast: Cast = ()
        self._performers: tuple[str, ...] = ()
        self._markers: MarkerView = marker_view(None, None, None)
        self._names_shown = False
        self._surface_shown, self._skeleton_shown, self._by_digit = True, False, False
        self._changed = True
        self._fitted = _NOTHING
        self._turned = False
        """Has the operator moved the camera? Then it stays."""
        self._drag_from: QPoint | None = None
        self._pointer: QPoint | None = None
        self._surface: DrawingSurface | None = None
        self.failure = ""
        self.frame_cost_s = 0.0

        support = gl_support()
        self.period_s = 1.0 / (FRAMES_PER_SECOND_SOFTWARE if support.software else FRAMES_PER_SECOND)
        self._last_draw_s = 0.0
        self._timer = QTimer(self, singleShot=True, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._draw_now)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMinimumSize(240, 180)
        self.setLayout(QVBoxLayout())
        self.layout().setContentsMargins(0, 0, 0, 0)
        if support.reason:
            self._fail(support.reason)
            return
        self._surface = DrawingSurface(self, self._make_scene, self._draw)
        self._surface.failed.connect(self._fail)
        self.layout().addWidget(self._surface)
        self._message = Message(self)
        self._tags = NameTags(self)
        self._legend = Legend(self)
        self._gizmo = AxesGizmo(self)
        self._hover = HoverTag(self)
        self._ring = FocusRing(self)
        self._ring.hide()
        self.setMouseTracking(True)
        self.show_empty(EMPTY_TITLE, EMPTY_DETAIL)

    # what is shown

    def show_frame(
        self,
        frame: MarkerFrame | None,
        tracked: TrackedFrame | None,
        profiles: Profile | Sequence[Profile] | None,
    ) -> None:
        """Show one sample; frame and tracked belong together. Cheap: drawing follows at the display's rate.

        profiles: of each performer.
        """
        cast = cast_of(profiles) if profiles else ()
        if frame is self._frame and tracked is self._tracked and same_cast(cast, self._cast):
            return
        self._frame, self._tracked, self._cast = frame, tracked, cast
        self._performers = performer_titles(cast) if cast else ()
        self._changed = True
        self.request_draw()

    def show_empty(self, title: str, detail: str = "") -> None:
        """What to say while there is no frame."""
        if self._surface is not None:
            self._message.say(title, detail)

    @property
    def shown(self) -> tuple[MarkerFrame | None, TrackedFrame | None, Cast]:
        """The sample that was given last, and the profiles of its performers."""
        return self._frame, self._tracked, self._cast

    @property
    def message(self) -> str:
        """What the view says instead of a scene, empty if it shows one."""
        if self.failure:
            return self.failure
        return self._message.text if self._frame is None and self._tracked is None else ""

    @property
    def legend_text(self) -> str:
        """What the legend says, one line per row."""
        return self._legend.text if self._surface is not None else ""

    # how it is shown

    def set_surface_shown(self, shown: bool) -> None:
        """Show or hide the skin."""
        self._surface_shown = shown
        self._refresh()

    def set_skeleton_shown(self, shown: bool) -> None:
        """Show or hide the bones; with them the skin is translucent."""
        self._skeleton_shown = shown
        self._refresh()

    def set_names_shown(self, shown: bool) -> None:
        """Show or hide the names of markers."""
        self._names_shown = shown
        self._refresh()

    @property
    def names_shown(self) -> bool:
        """Are markers named?"""
        return self._names_shown

    @property
    def coloured_by_digit(self) -> bool:
        """Are the hands' markers coloured by digit?"""
        return self._by_digit

    def set_colour_by_digit(self, by_digit: bool) -> None:
        """Colour the hands' markers by digit rather than by state."""
        self._by_digit = by_digit
        self._refresh()

    def set_follow_hand(self, follow: bool) -> None:
        """Keep the tracked hands in the middle."""
        self.follow_hand = follow
        self.request_draw()

    def view_fit(self) -> None:
        """Bring the tracked hands and props into view, or all points, or the place where hands will be."""
        points_m = np.concatenate([hand_points_m(self._tracked), prop_points_m(self._tracked, props_of(self._cast))])
        if not len(points_m) and self._frame is not None:
            points_m = self._frame.points_m[np.isfinite(self._frame.points_m).all(axis=1)]
        if len(points_m):
            self.camera.fit(points_m, max(self.width(), 1) / max(self.height(), 1))
        else:
            home = OrbitCamera()
            self.camera.target_m, self.camera.distance_m = home.target_m, home.distance_m
        self.request_draw()

    def view_fit_next(self) -> None:
        """Fit as soon as there is something to see."""
        self._fitted, self._turned = _NOTHING, False
        self._changed = True

    def view_front(self) -> None:
        """Look along -Z."""
        self._look_from(0.0, 0.0)

    def view_side(self) -> None:
        """Look along -X."""
        self._look_from(math.pi / 2, 0.0)

    def view_top(self) -> None:
        """Look straight down."""
        self._look_from(0.0, math.pi / 2)

    def _look_from(self, azimuth_rad: float, elevation_rad: float) -> None:
        self.camera.look_from(azimuth_rad, elevation_rad)
        self.request_draw()

    # drawing

    def request_draw(self) -> None:
        """Draw soon, not oftener than the display's rate."""
        if self._surface is None or self._timer.isActive() or not self.isVisible():
            return
        wait_s = self._last_draw_s + self.period_s - time.monotonic()
        if wait_s < _EARLY * self.period_s:
            self._draw_now()  # in the same turn as whatever else changed: the window is put together once
        else:
            self._timer.start(math.ceil(wait_s * 1000))

    def _refresh(self) -> None:
        self._changed = True
        self.request_draw()

    def _draw_now(self) -> None:
        if self._surface is not None:
            self._last_draw_s = time.monotonic()
            self._surface.redraw()

    def _make_scene(self) -> Scene:
        self._changed = True
        return Scene(template())

    def _draw(self, scene: Scene, size_px: tuple[int, int], pixel_ratio: float) -> None:
        """Inside the surface's paint event, its context current."""
        began_s = time.perf_counter()
        self._update_scene(scene)
        self._follow()
        scene.draw(self.camera, size_px, pixel_ratio)
        self._update_overlays()
        self.frame_cost_s = time.perf_counter() - began_s
        self.drawn.emit()

    def _update_scene(self, scene: Scene) -> None:
        if not self._changed:
            return
        self._changed = False
        if self._cast:
            scene.set_models(tuple(profile.hand for profile in self._cast))
            scene.set_props(props_of(self._cast))
        self._markers = marker_view(self._frame, self._tracked, self._layouts)
        scene.surface_shown, scene.skeleton_shown = self._surface_shown, self._skeleton_shown
        scene.colour_by_digit = self._by_digit
        scene.set_frame(self._frame, self._tracked, self._markers)
        self._fit_at_first()

    def _fit_at_first(self) -> None:
        """Fit to the first points, then to the first hand found, with room to move, and again to a further hand that
        is not in view; until somebody moves the camera. Once everything is gone, what comes next is fitted anew."""
        hands = len(tracked_hands(self._tracked))
        found = _POINTS + hands if hands else _POINTS if len(self._markers.positions_m) else _NOTHING
        if self._tracked is None and self._frame is None:
            self._fitted = _NOTHING
        if found <= self._fitted or self._turned:
            return
        if self._fitted <= _POINTS or not self._in_view(hand_points_m(self._tracked)):
            self.view_fit()
            self.camera.zoom(_ROOM_TO_MOVE)
        self._fitted = found

    def _in_view(self, points_m: FloatArray) -> bool:
        x, y, depth_m = self.points_on_screen(points_m).T
        return bool(((x >= 0) & (x <= self.width()) & (y >= 0) & (y <= self.height()) & (depth_m > 0)).all())

    def _camera_turned(self) -> None:
        self._turned = True
        self.request_draw()

    def _follow(self) -> None:
        points_m = hand_points_m(self._tracked) if self.follow_hand else np.empty((0, 3))
        if len(points_m):
            self.camera.target_m = self.camera.target_m + _FOLLOW * (points_m.mean(axis=0) - self.camera.target_m)

    # over the scene

    def _update_overlays(self) -> None:
        self._message.setVisible(bool(self.message))
        self._legend.setVisible(not self.message)
        self._legend.show_view(self._markers, self._tracked, self._by_digit, self._performers)
        self._gizmo.show_camera(self.camera)
        self._place_overlays()
        self._update_tags()
        self._update_hover()

    def _place_overlays(self) -> None:
        for whole in (self._message, self._tags, self._ring):
            if whole.size() != self.size():
                whole.resize(self.size())
        legend, gizmo = self._legend, self._gizmo
        legend.move(self.width() - legend.width() - _OVERLAY_MARGIN, _OVERLAY_MARGIN)
        gizmo.move(_OVERLAY_MARGIN, self.height() - gizmo.height() - _OVERLAY_MARGIN)

    def _update_tags(self) -> None:
        tags = tags_of_props(prop_poses(self._frame, self._tracked), self.points_on_screen)
        tags += tags_of_hands(self._tracked, self._performers, self.points_on_screen)
        screen = np.empty((0, 3))
        if self._names_shown and self._cast:
            screen = self._on_screen()
            tags += tags_of_markers(
                self._markers, screen, self._tracked, self._layouts, self._by_digit, self._performers
            )
        self._tags.setVisible(bool(tags))
        if tags:
            screen = screen[screen[:, 2] > 0.0]
            depth_m = float(np.median(screen[:, 2])) if len(screen) else 1.0
            radius_px = MARKER_RADIUS_M * self.camera.pixels_per_metre(depth_m, self.height())
            self._tags.show_tags(tags, screen[:, :2], max(radius_px, SMALLEST_PX))

    def _update_hover(self) -> None:
        """The words follow the marker under the pointer."""
        place = self._pointer
        if place is None or self._drag_from is not None or self.message or self._legend.geometry().contains(place):
            self._hover.show_words("", 0.0, 0.0)
            return
        screen = self._on_screen()
        marker = hover.marker_under(screen, place.x(), place.y())
        x, y = screen[marker, :2].tolist() if marker is not None else (0.0, 0.0)
        self._hover.show_words(self.text_at(place) if marker is not None else "", x, y)

    def _on_screen(self) -> FloatArray:
        return self.points_on_screen(self._markers.positions_m)

    # Qt

    def _fail(self, reason: str) -> None:
        """No scene: say why, and what still works."""
        self.failure = reason
        self._timer.stop()
        self._surface = None
        for child in self.findChildren(QWidget, options=Qt.FindChildOption.FindDirectChildrenOnly):
            child.hide()
        label = QLabel(f"No 3D view\n\n{reason}\n\nTracking, recording and export work without it.")
        label.setAlignment(Qt.AlignmentFlag.AlignCenter)
        label.setWordWrap(True)
        label.setMargin(24)
        self.layout().addWidget(label)

    def event(self, event: QEvent) -> bool:
        """The legend explains itself; what a marker is, is said beside it."""
        if event.type() == QEvent.Type.ToolTip and isinstance(event, QHelpEvent):
            if self._surface is not None and self._legend.geometry().contains(event.pos()):
                QToolTip.showText(event.globalPos(), self.text_at(event.pos()), self)
            else:
                QToolTip.hideText()
            return True
        return super().event(event)

    def text_at(self, place: QPoint) -> str:
        """What is at a place of the widget, in words; empty if nothing is."""
        if self._surface is None or self.message:
            return ""
        if self._legend.geometry().contains(place):
            return hover.LEGEND
        marker = hover.marker_under(self._on_screen(), place.x(), place.y())
        if marker is None:
            return ""
        return hover.marker_words(self._markers, marker, self._tracked, self._layouts, self._performers)

    @property
    def _layouts(self) -> tuple[MarkerLayout, ...]:
        """What each performer wears."""
        return tuple(profile.layout for profile in self._cast)

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802 (Qt's name)
        """Draw what came while nobody looked."""
        super().showEvent(event)
        self.request_draw()

    def hideEvent(self, event: QHideEvent) -> None:  # noqa: N802 (Qt's name)
        """Nothing to draw for nobody."""
        super().hideEvent(event)
        self._timer.stop()

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802 (Qt's name)
        """Keep the overlays in their corners."""
        super().resizeEvent(event)
        if self._surface is not None:
            self._place_overlays()

    def focusInEvent(self, event: QFocusEvent) -> None:  # noqa: N802 (Qt's name)
        """Reached by the keyboard, it shows so; a click needs no telling."""
        super().focusInEvent(event)
        if self._surface is not None and event.reason() in _BY_KEYBOARD:
            self._ring.show()

    def focusOutEvent(self, event: QFocusEvent) -> None:  # noqa: N802 (Qt's name)
        """The keyboard acts elsewhere."""
        super().focusOutEvent(event)
        if self._surface is not None:
            self._ring.hide()

    def mousePressEvent(self, event: QMouseEvent) -> None:  # noqa: N802 (Qt's name)
        """Begin to orbit or pan."""
        self._drag_from = event.position().toPoint()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:  # noqa: N802 (Qt's name)
        """Orbit with the left button, pan with the middle one or Shift; without a button, say what is there."""
        here = self._pointer = event.position().toPoint()
        if self._drag_from is None:
            self._update_hover()
            return
        moved = here - self._drag_from
        self._drag_from = here
        left = bool(event.buttons() & Qt.MouseButton.LeftButton)
        shift = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        if left and not shift:
            self.camera.orbit(-moved.x() * _ORBIT_RAD_PER_PIXEL, moved.y() * _ORBIT_RAD_PER_PIXEL)
        else:
            self.camera.pan(-moved.x() / self.height(), moved.y() / self.height())
        self._camera_turned()

    def leaveEvent(self, event: QEvent) -> None:  # noqa: N802 (Qt's name)
        """Nothing is under the pointer."""
        super().leaveEvent(event)
        self._pointer = None
        if self._surface is not None:
            self._update_hover()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:  # noqa: N802 (Qt's name)
        """End of a drag."""
        self._drag_from = None

    def wheelEvent(self, event: QWheelEvent) -> None:  # noqa: N802 (Qt's name)
        """Zoom."""
        self.camera.zoom(0.9985 ** event.angleDelta().y())
        self._camera_turned()
        event.accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802 (Qt's name)
        """F fit, 1 front, 3 side, 7 top."""
        actions = {
            Qt.Key.Key_F: self.view_fit,
            Qt.Key.Key_1: self.view_front,
            Qt.Key.Key_3: self.view_side,
            Qt.Key.Key_7: self.view_top,
        }
        action = actions.get(Qt.Key(event.key()))
        if action is None or event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier:
            super().keyPressEvent(event)
        else:
            action()

    def points_on_screen(self, points_m: FloatArray) -> FloatArray:
        """(n, 3) float64: x right and y down in the widget's pixels, then depth [m]; points_m (n, 3) [m]."""
        return self.camera.project(points_m, (max(self.width(), 1), max(self.height(), 1)))
