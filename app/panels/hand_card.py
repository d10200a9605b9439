"""How one hand is doing, in words and figures."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFrame, QGridLayout, QLabel, QToolButton

from app.label_trust import DOUBTED, WRONG, percent, trust, trust_level, worst_label
from app.lights import Light, elided, label, set_property
from app.panels.panel import column, row
from app.pose_words import least_sure, plus_minus_mm
from app.why_lost import hand_state
from core.frames import FloatArray, HandFrame, HandState
from core.hand.certainty import guesses
from core.hand.skeleton import N_DOFS
from devices.device import Level

SMOOTHING = 0.15
"""Weight of the newest frame in the figures shown: numbers that jump cannot be read."""

LABELS_TIP = (
    "How sure it is that every marker carries its own name, mean over all.\n"
    f"In amber if some label is less sure than {100 * DOUBTED:.0f} %, in red below {100 * WRONG:.0f} %."
)
SIZE_TIP = (
    "Scale on top of the hand size chosen above; found from the motion, else 1.\n"
    "In brackets: from the wrist to the tip of the middle finger."
)
UNSURE_TIP = (
    "The joint of which the markers say least, and one standard deviation of its angle.\n"
    "In pale blue from 5° on, where it is a guess; the 3D view draws such joints as glass of that colour."
)


def hidden_markers(hand: HandFrame, marker_names: tuple[str, ...]) -> str:
    """'RingTip ±9 mm, PinkyTip', the markers that no point explains and the error to expect of their places."""
    each = zip(marker_names, hand.observed, hand.marker_std_m, strict=True)
    return ", ".join(f"{name}{plus_minus_mm(std_m)}" for name, seen, std_m in each if not seen)


def _size(scale: float, length_m: float | None) -> str:
    return f"{scale:.3f}" if length_m is None else f"{scale:.3f} ({1000 * scale * length_m:.0f} mm)"


class HandCard(QFrame):
    """One hand in words and figures."""

    search_asked = Signal()
    """Let go of this hand and find it anew."""

    def __init__(self, title: str) -> None:
        super().__init__()
        self.setObjectName("card")
        self.light = Light(10)
        self.state = label("No frames", "muted", wrap=True, lines=2)
        self.rms = label("–", "number")
        self.rms.setToolTip("Root mean square distance of the seen markers to the model [mm].\nOver 8 mm is no pose.")
        self._rms_mm = float("nan")
        self.figures: dict[str, QLabel] = {}
        grid = QGridLayout()
        grid.setContentsMargins(18, 0, 0, 0)
        grid.setHorizontalSpacing(8)
        grid.setVerticalSpacing(1)
        for i, (name, tip) in enumerate(
            (
                ("Markers", "Seen now, of those on the glove."),
                ("Places", "Confidence in where the markers are, mean over all: 100 % is certain."),
                ("Labels", LABELS_TIP),
                ("Hand size", SIZE_TIP),
            )
        ):
            heading, value = label(name, "small"), label("–")
            heading.setToolTip(tip)
            value.setToolTip(tip)
            grid.addWidget(heading, 0, i)
            grid.addWidget(value, 1, i)
            grid.setColumnStretch(i, 1)
            self.figures[name] = value
        size = self.figures["Hand size"]
        size.setMinimumWidth(size.fontMetrics().horizontalAdvance(_size(1.0, 0.2)))  # so that the panel keeps its width
        self._theta_std = np.full(N_DOFS, np.nan)
        self.unsure = elided("", "small")
        self.unsure.setToolTip(UNSURE_TIP)
        self.hidden = label("", "small", wrap=True, lines=2)  # so that nothing jumps
        self.hidden.setToolTip("Markers that no point explains: their places are predicted, with the error to expect.")
        layout = column(self, 9, 5)
        self.title = elided(title, "heading", Qt.TextElideMode.ElideMiddle)  # whose it is, and which
        self.again = QToolButton(text="Search")
        self.again.setProperty("flat", True)
        self.again.setToolTip("Let go of this hand and find it anew; the others are followed on.")
        self.again.setAccessibleName(f"Search {title.lower()} again")
        self.again.clicked.connect(self.search_asked.emit)
        unit = label("mm RMS", "small")
        layout.addLayout(row(self.light, self.title, None, self.rms, unit))
        for widget in (self.state, self.unsure, self.hidden):
            indented = row(widget)
            indented.setContentsMargins(18, 0, 0, 0)
            if widget is self.state:  # not beside the name, which needs the room
                indented.setStretch(0, 1)
                indented.addWidget(self.again, 0, Qt.AlignmentFlag.AlignTop)
            layout.addLayout(indented)
            if widget is self.state:
                layout.addLayout(grid)

    def set_title(self, title: str, colour: str) -> None:
        """Whose hand it is. colour: '#rrggbb' of a line at its left, "" for none."""
        self.title.setText(title)
        self.setStyleSheet(f"#card {{ border-left: 3px solid {colour}; }}" if colour else "")

    def show_nothing(self, reason: str) -> None:
        """No data for this hand."""
        self.light.set_level(Level.IDLE)
        self._say(self.state, reason, "")
        self._rms_mm = float("nan")
        self._theta_std = np.full(N_DOFS, np.nan)
        for widget in (self.rms, *self.figures.values()):
            widget.setText("–")
        for line in (self.unsure, self.hidden):
            self._say(line, "", "")

    def show_hand(
        self,
        hand: HandFrame,
        marker_names: tuple[str, ...],
        state: tuple[Level, str] | None = None,
        length_m: float | None = None,
    ) -> None:
        """The hand in the latest frame. state: its light and its reason in words; None for what the hand alone says.
        length_m: of the profile's hand at scale 1, from wrist to middle fingertip [m]; None leaves millimetres out."""
        level, words = state or hand_state(hand)
        self.light.set_level(level)
        self._say(self.state, words, level.value if level is not Level.GOOD else "")
        tracked = hand.state is HandState.TRACKED
        if tracked and np.isfinite(hand.rms_m):
            now = hand.rms_m * 1000
            self._rms_mm = now if np.isnan(self._rms_mm) else self._rms_mm + SMOOTHING * (now - self._rms_mm)
        else:
            self._rms_mm = float("nan")
        self.rms.setText("–" if np.isnan(self._rms_mm) else f"{self._rms_mm:.1f}")
        observed = hand.observed
        self.figures["Markers"].setText(f"{int(observed.sum())} / {len(observed)}" if tracked else "–")
        self.figures["Places"].setText(percent(float(hand.confidence.mean())) if tracked else "–")
        self._show_labels(hand, marker_names)
        self.figures["Hand size"].setText(_size(hand.scale, length_m) if tracked else "–")
        self._show_least_sure(hand.theta_std if tracked else np.full(N_DOFS, np.nan))
        words = f"Hidden: {hidden_markers(hand, marker_names) or 'none'}" if tracked else ""
        self._say(self.hidden, words, "")

    def _show_labels(self, hand: HandFrame, marker_names: tuple[str, ...]) -> None:
        """The mean, in the colour of the worst."""
        mean, worst = trust(hand)
        value, known = self.figures["Labels"], bool(np.isfinite(worst))
        level = trust_level(worst)
        self._say(value, percent(mean) if known else "–", level.value if known and level is not Level.GOOD else "")
        value.setToolTip(
            f"{LABELS_TIP}\nLeast sure: {worst_label(hand.label_confidence, marker_names)}" if known else LABELS_TIP
        )

    def _show_least_sure(self, theta_std: FloatArray) -> None:
        """Doubt is shown at once and goes slowly."""
        eased = self._theta_std + SMOOTHING * (theta_std - self._theta_std)
        self._theta_std = np.where(np.isnan(theta_std), np.nan, np.fmax(theta_std, eased))
        words = least_sure(self._theta_std)
        guess = bool(guesses(self._theta_std).any())
        self._say(self.unsure, f"Least sure: {words}" if words else "", "guess" if guess else "")

    @staticmethod
    def _say(widget: QLabel, text: str, level: str) -> None:
        if widget.text() != text:
            widget.setText(text)
        set_property(widget, "level", level)
