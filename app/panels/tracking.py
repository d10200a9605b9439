"""The tracking panel: how well each hand and prop is followed, what is hidden, and where the time goes."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QComboBox, QLabel, QPushButton, QWidget

from app import theme
from app.editing import leave_wheel_to_panel
from app.every_nth import MOST, every_words
from app.hand_words import hand_titles
from app.lights import ShareBar, label, lines_of
from app.live_numbers import LiveFrame
from app.live_streams import incoming, solved_one
from app.panels.hand_card import HandCard
from app.panels.hand_size_chooser import HandSizeChooser
from app.panels.panel import Panel, column, row, scrolling, section
from app.panels.performers import PerformersBox
from app.panels.profile_chooser import ProfileChooser
from app.panels.props_box import PropsBox
from app.panels.solved_stream import SolvedStream
from app.props.desk import PropDesk
from app.session import SessionNumbers
from app.undo import UndoStack
from app.why_lost import state_in
from app.worker import SessionWorker
from core.cast import same_cast
from core.frames import HandKey
from core.markers.layout import layout_names
from core.profile import Profile
from core.words import ordinal

LOOK_AHEAD_MS = (0, 50, 100, 200)
SOLVE_EVERY = range(1, MOST + 1)
SOLVE_EVERY_TIP = (
    "For cameras that are faster than the solver: choose so that it keeps up, and poses come evenly. Hands that\n"
    "move fast are followed from 60 Hz on. The frames between are no loss: takes hold all of them, and Solve again\n"
    "in Review gives every one its pose."
)


class TrackingPanel(Panel):
    """A card per hand, a line per prop, the stage times, and which performers are solved for."""

    title, key = "Tracking", "tracking"

    def __init__(self, worker: SessionWorker, undo: UndoStack) -> None:
        super().__init__()
        self._worker, self._undo = worker, undo
        self._latest: LiveFrame | None = None

        self.solved = SolvedStream(worker, undo)
        self.performers = PerformersBox(worker, undo)
        self.again = QPushButton("Search again")
        self.again.setToolTip("Let go of all hands and find them anew (Ctrl+F).")
        self.again.clicked.connect(lambda: worker.session.search_again())
        self.look_ahead = leave_wheel_to_panel(QComboBox())
        for ms in LOOK_AHEAD_MS:
            self.look_ahead.addItem(f"{ms} ms" if ms else "Off", ms)
        self.look_ahead.setToolTip(
            "Hold every pose back for so long: hidden fingers that come back within it are led there smoothly.\n"
            "Adds this much latency to what is shown. Takes are recorded as solved, without it; solve a take again in\n"
            "Review and all of its gaps are filled. Off: the difference is worked off after the gap."
        )
        self.look_ahead.activated.connect(lambda index: self.choose_look_ahead(self.look_ahead.itemData(index)))
        self.solve_every = leave_wheel_to_panel(QComboBox())
        for n in SOLVE_EVERY:
            self.solve_every.addItem(f"Every {ordinal(n)} frame" if n > 1 else "Every frame", n)
        self.solve_every.activated.connect(lambda index: self.choose_solve_every(self.solve_every.itemData(index)))
        self.solved_rate = label("", "muted")
        self.hands: dict[HandKey, HandCard] = {}
        self._cards = column(margin=0, spacing=10)
        self.props = PropsBox(PropDesk(worker, undo))
        self.stages = StageTable()

        body = QWidget()
        inside = column(body, 8)
        inside.addWidget(self.solved)
        inside.addWidget(self.performers)
        ahead = row(label("Look-ahead", "muted"), self.look_ahead, self.again)
        ahead.setStretch(1, 1)
        inside.addLayout(ahead)
        every = row(label("Solve", "muted"), self.solve_every, self.solved_rate)
        every.setStretch(1, 1)
        inside.addLayout(every)
        inside.addLayout(self._cards)
        inside.addWidget(self.props)
        inside.addWidget(section("Time per frame"))
        inside.addWidget(self.stages)
        inside.addStretch(1)
        layout = column(self, 0, 0)
        layout.addWidget(scrolling(body))

        worker.frame.connect(self._take)
        worker.numbers.connect(self._refresh)
        worker.profile_changed.connect(lambda _: self._list_hands())
        worker.look_ahead_changed.connect(lambda _: self._show_look_ahead())
        worker.solve_every_changed.connect(lambda _: self._show_solve_every(0.0))
        self._list_hands()
        self._show_look_ahead()
        self._show_solve_every(0.0)

    def choose_look_ahead(self, ms: int) -> None:
        """Hold poses back for so long, as one step that can be undone."""
        before, after = self._worker.session.look_ahead_s, ms / 1000.0
        if before != after:
            self._undo.change(
                f"look-ahead {ms} ms" if ms else "no look-ahead",
                lambda: self._worker.set_look_ahead(after),
                lambda: self._worker.set_look_ahead(before),
            )

    def _show_look_ahead(self) -> None:
        ms = round(1000.0 * self._worker.session.look_ahead_s)
        self.look_ahead.setCurrentIndex(self.look_ahead.findData(ms))

    def choose_solve_every(self, n: int) -> None:
        """Solve every n-th frame, as one step that can be undone."""
        before = self._worker.session.solve_every
        if before != n:
            self._undo.change(
                f"solve every {ordinal(n)} frame" if n > 1 else "solve every frame",
                lambda: self._worker.set_solve_every(n),
                lambda: self._worker.set_solve_every(before),
            )

    def _show_solve_every(self, rate_hz: float) -> None:
        """rate_hz: of the stream, 0 if none flows."""
        n = self._worker.session.solve_every
        index = self.solve_every.findData(n)
        if index != self.solve_every.currentIndex():
            self.solve_every.setCurrentIndex(index)
        self.solved_rate.setText(f"{rate_hz / n:.0f} of {rate_hz:.0f} Hz" if n > 1 and rate_hz > 0 else "")
        self.solved_rate.setVisible(bool(self.solved_rate.text()))
        tip = f"{every_words(n, rate_hz)}.\n{SOLVE_EVERY_TIP}"
        for shown in (self.solve_every, self.solved_rate):
            if shown.toolTip() != tip:
                shown.setToolTip(tip)

    def choose(self, name_or_path: str) -> None:
        """Solve for another profile of the first performer, as one step that can be undone."""
        self.profile.choose(name_or_path)

    @property
    def profile(self) -> ProfileChooser:
        """That of the first performer."""
        return self.performers.blocks[0].profile

    @property
    def size(self) -> HandSizeChooser:
        """That of the first performer."""
        return self.performers.blocks[0].size

    def _list_hands(self) -> None:
        """A card for every hand of the profiles in use."""
        wanted = hand_titles(self._worker.session.profiles)
        for key in [key for key in self.hands if key not in wanted]:
            card = self.hands.pop(key)
            self._cards.removeWidget(card)
            card.hide()
            card.deleteLater()
        several = len(self._worker.session.profiles) > 1
        for i, (key, title) in enumerate(wanted.items()):
            if key not in self.hands:
                self.hands[key] = HandCard(title)
                self.hands[key].search_asked.connect(lambda key=key: self._worker.session.search_again(key))
                self._cards.insertWidget(i, self.hands[key])
            self.hands[key].set_title(title, theme.hand_colour(key) if several else "")
        self.hands = {key: self.hands[key] for key in wanted}

    def _take(self, frame: LiveFrame) -> None:
        self._latest = frame

    def _refresh(self, numbers: SessionNumbers) -> None:
        solved = solved_one(incoming(self._worker.session))
        rate_hz = solved.health.rate_hz if solved is not None else 0.0
        cast = self._worker.session.profiles
        latest = self._latest if rate_hz > 0 and self._latest and same_cast(self._latest.profiles, cast) else None
        shown = {hand.key: hand for hand in latest.solved.hands} if latest is not None else {}
        for key, card in self.hands.items():
            if latest is not None and key in shown:
                hand, missed_s = shown[key], self._worker.missing.seconds(key, latest.solved)
                state = state_in(hand, latest.raw, latest.solved, missed_s)
                worn = cast[key.performer]
                card.show_hand(hand, worn.layout.marker_names, state, worn.hand.skeleton.length_m)
            else:
                card.show_nothing("No frames" if numbers.ready else numbers.status)
        self.props.show_props(cast[0].props, latest.solved.props if latest is not None else None)
        self._show_solve_every(rate_hz)
        budget_s = self._worker.session.solve_every / rate_hz if rate_hz > 0 else 0.0
        self.stages.show_times(numbers.solver.stage_s, numbers.solver.step_s, budget_s)


class StageTable(QWidget):
    """Median time of each stage, and its share of the time between two frames."""

    def __init__(self) -> None:
        super().__init__()
        self._grid = lines_of(self, wide=2)
        self._rows: dict[str, tuple[QLabel, ShareBar]] = {}
        self._empty = label("Shown while frames are solved.", "faint")
        self._grid.addWidget(self._empty, 0, 0, 1, 3)

    @property
    def shown(self) -> dict[str, str]:
        """Stage to the text beside it."""
        return {name: value.text() for name, (value, _) in self._rows.items()}

    def show_times(self, stage_s: dict[str, float], step_s: float, budget_s: float) -> None:
        """stage_s by name, the whole step, and the time between two frames that are solved; all [s]."""
        solving = bool(stage_s) and bool(np.isfinite(step_s))
        self._empty.setVisible(not solving)
        for value, bar in self._rows.values():
            if not solving:
                value.setText("–")
                bar.show_share(0.0, "")
        if not solving:
            return
        for name, seconds in {**stage_s, "whole frame": step_s}.items():
            value, bar = self._rows.get(name) or self._add(name)
            value.setText(f"{seconds * 1000:.2f} ms")
            share = seconds / budget_s if budget_s > 0 else 0.0
            bar.show_share(share, f"{share * 100:.0f} %")
            bar.setToolTip(f"{share * 100:.1f} % of the {budget_s * 1000:.2f} ms between two frames that are solved.")

    def _add(self, name: str) -> tuple[QLabel, ShareBar]:
        line = len(self._rows) + 1
        value, bar = label("–"), ShareBar()
        value.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        value.setMinimumWidth(value.fontMetrics().horizontalAdvance("00.00 ms"))
        self._grid.addWidget(label(name.capitalize(), "muted"), line, 0)
        self._grid.addWidget(value, line, 1)
        self._grid.addWidget(bar, line, 2)
        self._rows[name] = value, bar
        return value, bar


def profile_key(profile: Profile) -> str:
    """What the settings remember: the name of a shipped layout, else nothing."""
    return profile.layout.name if profile.layout.name in layout_names() and not profile.performer else ""
