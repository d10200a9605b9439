"""The strip at the bottom: one light per thing that can go wrong, and in its tooltip what to do."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QWidget

from app.armed import healths
from app.disk_room import free_text, recording_left
from app.every_nth import every_words
from app.hand_words import hand_titles, performer_titles
from app.lights import StatusField, elided, set_property
from app.live_latency import NO_LATENCY, latency_parts, latency_value
from app.live_numbers import LiveFrame
from app.live_streams import Incoming, ended_device, gravest, incoming, solved_one
from app.losses import Losses
from app.notifications import Notification, Severity
from app.session import SessionNumbers
from app.why_lost import GOOD_RMS_M, state_in
from app.worker import SessionWorker
from core.cast import Cast
from core.frames import HandFrame, HandState
from core.printable import printable
from core.takes.disk import LOW, RESERVE, WARN_BELOW_S, duration_text
from devices.device import Health, Level

LATENCY_GOOD_S = 0.020
LATENCY_LIMIT_S = 0.050
STALE_S = 1.0
"""A pose older than this is no longer shown as the present one."""
LITTLE_DISK_S = 60.0
MESSAGE_S = 12.0
CLICK = "Click to read all messages."


class StatusStrip(QFrame):
    """Rate, latency, fit, dropped, solver, disk, and the latest message."""

    message_clicked = Signal()
    work_clicked = Signal()

    def __init__(
        self, worker: SessionWorker, work: Callable[[], str] = lambda: "", reading: Callable[[], bool] = lambda: False
    ) -> None:
        """work: what goes on beside the session and takes of the processor, in words; "" for nothing. reading: whether
        the messages are in sight, where whoever looks has read them."""
        super().__init__()
        self._work, self._reading = work, reading
        self.setObjectName("strip")
        self.setFixedHeight(27)
        self._worker = worker
        self.folder = Path()
        self._latest: LiveFrame | None = None
        self._latest_at = -math.inf
        self._losses = Losses()
        self._rate = 0.0  # of the last take [byte/s]
        self._message_at = -math.inf
        self._unread: Notification | None = None
        """The warning or problem that is shown, until somebody reads it or its own part says that it is over."""

        self.stream = StatusField("Stream", "1000.0 Hz")
        self.latency = StatusField("Latency", "1000.0 ms")
        self.fit = StatusField("RMS", "L 0.00  R 0.00 mm")
        self.dropped = StatusField("Dropped", "00,000")
        self.solver = StatusField("Solver", "preparing…")
        self.disk = StatusField("Disk", "000.0 GB free")
        self.message = elided()
        self.message.clicked.connect(self.message_clicked)
        self.message.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        row = QHBoxLayout(self)
        row.setContentsMargins(4, 0, 10, 0)
        row.setSpacing(0)
        for field in (self.stream, self.latency, self.fit, self.dropped, self.solver, self.disk):
            row.addWidget(field)
            row.addWidget(_rule())
        row.addWidget(self.message, 1)
        self.message.setMinimumWidth(60)
        self.work = elided("", "muted")
        self.work.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.work.setFixedWidth(self.work.fontMetrics().horizontalAdvance("Importing 00 of 00: 100 %") + 12)
        self.work.setToolTip("It uses the processor that the solver needs. Click to look at it or to cancel it.")
        self.work.setCursor(Qt.CursorShape.PointingHandCursor)
        self.work.clicked.connect(self.work_clicked)
        self.work.hide()
        row.addWidget(self.work)

        worker.frame.connect(self._take)
        for changed in (worker.solving_changed, worker.profile_changed):
            changed.connect(self._forget)
        worker.numbers.connect(self._refresh)
        worker.notified.connect(self._say)
        for note in worker.notifications.history:
            self._say(note)

    def _take(self, frame: LiveFrame) -> None:
        self._latest, self._latest_at = frame, time.monotonic()

    def _forget(self) -> None:
        """What was solved for other performers, or came from elsewhere, is shown no more."""
        self._latest, self._latest_at = None, -math.inf

    def _say(self, note: Notification) -> None:
        if self._waits_behind(note):
            return
        self._unread = note if note.severity is not Severity.INFO else None
        self._message_at = time.monotonic()
        level = {Severity.PROBLEM: "problem", Severity.WARNING: "warning"}.get(note.severity, "")
        set_property(self.message, "level", level)
        self.message.setCursor(Qt.CursorShape.PointingHandCursor)
        self.message.setText(note.text)
        self.message.setToolTip("\n".join(filter(None, (note.action, CLICK))))

    def _waits_behind(self, note: Notification) -> bool:
        """Whether it is an ordinary message, and a warning stands there that nobody has read and that is not over."""
        unread = self._unread
        if unread is None or note.severity is not Severity.INFO:
            return False
        return not (note.settles and note.source == unread.source)

    def _refresh(self, numbers: SessionNumbers) -> None:
        if self._reading():
            self._unread = None
        streams = incoming(self._worker.session)
        solved = solved_one(streams)
        health, flowing = (solved.health, solved.flows) if solved is not None else (Health(), False)
        self._show_stream(streams)
        self._show_latency(numbers, health)
        self._show_fit(numbers, flowing)
        self._show_dropped(numbers, any(one.health.connected for one in streams))
        self._show_solver(numbers, health, flowing)
        self._show_disk(numbers)
        self.work.setText(self._work())
        self.work.setVisible(bool(self.work.text()))
        if self._unread is None and time.monotonic() - self._message_at > MESSAGE_S and self.message.text():
            self.message.setText("")
            self.message.setToolTip("")
            self.message.unsetCursor()

    def _show_stream(self, streams: list[Incoming]) -> None:
        """The rate of the one that is solved, the light of the gravest, and every one of them in the tooltip."""
        if not streams:
            ended = ended_device(self._worker.session)
            level, tip = Level.IDLE, "No device is connected."
            if ended is not None:
                health = ended.health()
                level, tip = health.level, f"{ended.title}: {health.reason}"
            self.stream.show_state(level, "none", tip)
            return
        shown = solved_one(streams) or streams[0]  # what flows is before what failed
        value = f"{shown.health.rate_hz:.1f} Hz" if shown.flows else "none" if shown.receiver.failed else "no frames"
        lines = [one.reason for one in streams]
        if len(streams) > 1:
            lines = [f"{one.reason} {'Solved.' if one.solved else ''}".rstrip() for one in streams]
        self.stream.show_state(gravest(streams).health.level, value, "\n".join(lines))

    def _show_latency(self, numbers: SessionNumbers, health: Health) -> None:
        solver = numbers.solver
        value, tip, level = latency_value(solver, health), latency_parts(solver, health), Level.GOOD
        median, p99 = solver.latency_s - solver.look_ahead_s, solver.latency_p99_s - solver.look_ahead_s
        if value == NO_LATENCY:
            level = Level.IDLE
        elif median > LATENCY_LIMIT_S:
            level = Level.PROBLEM
        elif median > LATENCY_GOOD_S or p99 > LATENCY_LIMIT_S:
            level = Level.WARNING
        if level in (Level.PROBLEM, Level.WARNING):
            tip += "\nClose other programs, or lower the camera rate."
        self.latency.show_state(level, value, tip)

    def _show_fit(self, numbers: SessionNumbers, flowing: bool) -> None:
        fresh = flowing and time.monotonic() - self._latest_at < STALE_S
        hands = self._latest.solved.hands if self._latest is not None and fresh else ()
        if not hands:
            self.fit.show_state(Level.IDLE, "–", "Distance of the markers to the model [mm]. No hand is tracked.")
            return
        tracked = [hand for hand in hands if hand.state is HandState.TRACKED]
        assert self._latest is not None
        cast = self._latest.profiles
        value = _fits(hands, cast)
        if len(tracked) < len(hands):
            lost = any(hand.state is HandState.LOST for hand in hands)
            level, tip = Level.PROBLEM if lost else Level.WARNING, self._missing_words(self._latest)
        elif any(hand.rms_m > GOOD_RMS_M for hand in tracked):
            level, tip = Level.WARNING, "The fit is loose: check the marker layout and the hand size."
        else:
            every = "Both" if len(hands) == 2 else "All"
            level, tip = (
                Level.GOOD,
                f"{every} hands fit their markers." if len(hands) > 1 else "The hand fits its markers.",
            )
        if len(cast) > 1:
            tip += "\n" + "\n".join(f"{number}: {name}" for number, name in enumerate(performer_titles(cast), start=1))
        self.fit.show_state(level, value + " mm", tip)

    def _missing_words(self, latest: LiveFrame) -> str:
        """A line for each hand that is not tracked."""
        raw, solved, titles = latest.raw, latest.solved, hand_titles(latest.profiles)
        return "\n".join(
            f"{titles[hand.key]}: {state_in(hand, raw, solved, self._worker.missing.seconds(hand.key, solved))[1]}"
            for hand in solved.hands
            if hand.state is not HandState.TRACKED
        )

    def _show_dropped(self, numbers: SessionNumbers, connected: bool) -> None:
        losses, now_s = self._losses, time.monotonic()
        losses.take(now_s, numbers, healths(self._worker.session.streams))
        level = losses.level(now_s)
        if level is Level.GOOD and not connected:
            level = Level.IDLE
        self.dropped.show_state(level, f"{losses.total:,}", losses.tip(now_s, numbers.recording is not None))

    def _show_solver(self, numbers: SessionNumbers, health: Health, flowing: bool) -> None:
        if not numbers.ready:
            failed = "could not" in numbers.status
            tip = numbers.status if failed else "The solver is compiled at the first start; recording waits for it."
            self.solver.show_state(
                Level.PROBLEM if failed else Level.WARNING, "failed" if failed else "preparing…", tip
            )
            return
        step_ms = numbers.solver.step_s * 1000
        value = f"{step_ms:.2f} ms" if math.isfinite(step_ms) else "ready"
        skipped_hz, waiting = numbers.solver.skipped_hz, numbers.queue_depth
        tip = f"{waiting} of {numbers.queue_size} frames wait for the solver."
        if flowing:
            tip = f"{numbers.solver.rate_hz:.0f} of {health.rate_hz:.0f} frames are solved per second. {tip}"
        if (every := self._worker.session.solve_every) > 1:
            tip = f"{every_words(every, health.rate_hz if flowing else 0.0)}, as chosen in Tracking.\n{tip}"
        level = Level.GOOD
        if skipped_hz:
            level = Level.WARNING
            tip += (
                f"\nIt cannot keep up: {skipped_hz:.0f} frames of the last second were skipped, so that you see what "
                "happens now.\nClose other programs or lower the camera rate. Takes keep every raw frame: "
                "Solve again in review gives the skipped ones their poses."
            )
        elif waiting > numbers.queue_size / 2:
            level = Level.WARNING
            tip += "\nThe machine was held up: they are being worked off, and none is lost."
        self.solver.show_state(level, value, tip)

    def _show_disk(self, numbers: SessionNumbers) -> None:
        recording = numbers.recording
        self._rate = recording.bytes_per_s if recording is not None else self._rate
        stalled_s = max((take.stalled_s for take in (recording, *numbers.sealing) if take is not None), default=0.0)
        if numbers.opening is not None and numbers.opening.stalled:
            stalled_s = max(stalled_s, numbers.opening.seconds)
        if stalled_s:
            tip = "The take folder's disk does not take what is written. Check the disk and its cable or network."
            self.disk.show_state(Level.PROBLEM, f"hangs {stalled_s:.0f} s", tip)
            return
        if recording is not None and recording.trouble:
            self.disk.show_state(recording.level, "see Recorder", f"{recording.trouble}.\n{recording.path}")
            return
        if recording is not None and math.isfinite(recording.seconds_left):
            left = recording.seconds_left
            level = Level.GOOD if left > WARN_BELOW_S else Level.WARNING if left > LITTLE_DISK_S else Level.PROBLEM
            tip = f"At {recording.bytes_per_s / 1e6:.2f} MB/s; the recording is ended then, with room left to save it."
            if level is not Level.GOOD:
                tip += "\nFree some space, or use another folder for the next take."
            self.disk.show_state(level, f"{duration_text(left)} left", tip)
            return
        free = self._worker.disk_free
        if free is None:
            self.disk.show_state(Level.IDLE, "–", f"Asking how much room {printable(self.folder)} has.")
            return
        low = free < RESERVE
        level = Level.PROBLEM if low else Level.WARNING if free < LOW else Level.GOOD
        tip = f"Free in {printable(self.folder)}."
        if level is not Level.GOOD:
            tip += " Recording needs 1 GB: free some space." if low else " Free some space before a long day."
        if lasts := recording_left(free, self._rate):
            tip += f"\n{lasts}"
        self.disk.show_state(level, f"{free_text(free)} free", tip)


def _fits(hands: Sequence[HandFrame], cast: Cast) -> str:
    """'L 0.8  R 1.1', with several performers '1 L 0.8 R 1.1   2 L –' by their numbers."""
    groups: dict[int, list[str]] = {}
    for hand in hands:
        rms = f"{hand.rms_m * 1000:.1f}" if math.isfinite(hand.rms_m) else "–"
        groups.setdefault(hand.performer, []).append(f"{hand.side[0].upper()} {rms}")
    if len(cast) == 1:
        return "  ".join(part for parts in groups.values() for part in parts)
    return "   ".join(" ".join([f"{performer + 1}:", *parts]) for performer, parts in groups.items())


def _rule() -> QWidget:
    line = QFrame()
    line.setFixedSize(1, 14)
    line.setStyleSheet("background: #2d3138;")
    return line
