"""A line for each prop: is it seen, how well it fits, and by how many of its markers."""

from __future__ import annotations

from PySide6.QtCore import QPoint, Qt, Signal
from PySide6.QtWidgets import QLabel, QSizePolicy, QToolButton, QWidget

from app.lights import Light, elided, label, lines_of
from app.panels.panel import clear
from core.frames import NO_POINT, PropFrame
from core.props.prop import Prop
from core.props.symmetry import symmetry_words
from devices.device import Level

_TIP = "Markers of the prop that are seen, and how far they lie from where its pose puts them (root mean square)."


def prop_state(prop: PropFrame | None) -> tuple[Level, str]:
    """The light of a prop and its state in words; None: never seen yet."""
    if prop is None:
        return Level.WARNING, "searching"
    seen, all_of_them = int((prop.point != NO_POINT).sum()), len(prop.point)
    if not prop.tracked:
        return Level.PROBLEM, f"lost · {seen} / {all_of_them} markers"
    return Level.GOOD, f"{seen} / {all_of_them} markers · {1e3 * prop.rms_m:.2f} mm"


class PropLines(QWidget):
    """The props of the profile, in its order."""

    menu_asked = Signal(str, QPoint)
    """What can be done with the prop of this name, at this place of the screen."""

    def __init__(self) -> None:
        super().__init__()
        self._grid = lines_of(self, wide=1)
        self._lines: dict[str, tuple[Light, QLabel]] = {}
        self._props: tuple[Prop, ...] = ()

    @property
    def shown(self) -> dict[str, str]:
        """Name to the words beside it."""
        return {name: words.text() for name, (_, words) in self._lines.items()}

    def show_props(self, props: tuple[Prop, ...], seen: tuple[PropFrame, ...] | None) -> None:
        """props: of the profile. seen: of the latest frame, None if there are no frames."""
        if props != self._props:
            self._props = props
            self._list(props)
        known = {prop.name: prop for prop in seen or ()}
        for name, (light, words) in self._lines.items():
            level, text = prop_state(known.get(name)) if seen is not None else (Level.IDLE, "–")
            light.set_level(level)
            if words.text() != text:
                words.setText(text)

    def _ask(self, name: str, at: QWidget) -> None:
        self.menu_asked.emit(name, at.mapToGlobal(QPoint(0, at.height())))

    def _list(self, props: tuple[Prop, ...]) -> None:
        clear(self._grid)
        self._lines.clear()
        for i, prop in enumerate(props):
            light, title, words, more = Light(10), elided(prop.name), label(), QToolButton(text="⋯")
            title.setToolTip(prop.name)
            title.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
            words.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            words.setToolTip(_TIP)
            symmetry = symmetry_words(prop.markers_m)
            if symmetry:
                title.setText(f"{prop.name} ⟲")
                title.setToolTip(f"{prop.name}. {symmetry}")
            more.setToolTip(f"Rename {prop.name}, change its shape, save or remove it.")
            more.setAutoRaise(True)
            more.clicked.connect(lambda _, name=prop.name, at=more: self._ask(name, at))
            for k, widget in enumerate((light, title, words, more)):
                self._grid.addWidget(widget, i, k)
            self._lines[prop.name] = light, words
