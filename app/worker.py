"""The session as the window sees it: Qt signals out, commands in. The window's thread never waits for it."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Qt, QTimer, Signal, Slot

from app.daemon_pool import DaemonPool
from app.disk_wait import STALL_S
from app.live_streams import incoming
from app.notifications import NotificationCentre
from app.receiver import Receiver
from app.session import Session
from app.why_lost import Missing
from core.cast import with_profile
from core.errors import DeviceError, TakeError
from core.labelling.network import network_at
from core.profile import Profile
from core.takes.disk import free_bytes
from core.takes.take import TakeInfo
from devices.device import Device, Level

PANEL_HZ = 10
RECONNECT_S = 5.0
DISK_EVERY_S = 2.0
CLOSE_S = 20.0
ERRANDS_S = 1.0
"""How long the end waits for what is done beside the session [s]: nothing is lost that is not done."""
_LOOK_S = 0.05
_NAMES_TRIED = 20
NextTake = Callable[[], tuple[str, Path]]
"""Name and path of a take that is not there yet."""


class SessionWorker(QObject):
    """Signals arrive on the window's thread, whatever thread caused them."""

    frame = Signal(object)
    """LiveFrame, at display rate, only if there is a newer one."""
    numbers = Signal(object)
    """SessionNumbers, ten times a second."""
    notified = Signal(object)
    """Notification."""
    devices_changed = Signal()
    """A device was added, removed, connected or disconnected, or has other settings."""
    solving_changed = Signal(str)
    """Key of the stream that is solved from now on, "" for none: it is another one, or was connected anew. What was
    solved before is of the past."""
    profile_changed = Signal(object)
    """Profile of the first performer; `session.profiles` has all. One of them changed, came or went."""
    look_ahead_changed = Signal(float)
    solve_every_changed = Signal(int)
    """Seconds."""
    recording_changed = Signal(bool)
    """A take began or ended."""
    recording_refused = Signal(object)
    """The error of a take that could not begin."""
    take_finished = Signal(object)
    """TakeSummary, once the take is sealed."""
    _call = Signal(object)

    def __init__(self, session: Session, frame_rate_hz: int = 60, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self._seen = 0
        self._changes = 0  # of profiles that were asked for
        self._loaded: set[str | None] = set()
        self._was_recording = self._opening_said = False
        self._red: set[tuple[Receiver, str]] = set()
        self._streaming: set[Receiver] = set()
        self._solving = ""
        self._given_up = threading.Event()
        self._commands = DaemonPool(1, "phalanx-commands")
        self._errands = DaemonPool(2, "phalanx-errands")
        self._look_backs = DaemonPool(2, "phalanx-look-backs")
        self._reconnecting: list[Receiver] = []
        self._one_reconnects = threading.Lock()
        self._folder: Path | None = None
        self._disk_free: int | None = None
        self._disk_asked_s = -math.inf
        self._call.connect(self._run_here, Qt.ConnectionType.QueuedConnection)
        self._unsubscribe = session.notifications.subscribe(self.notified.emit)
        session.on_take = self.take_finished.emit
        self.missing = Missing()
        """Since when each hand is not tracked, as of the last `frame`."""
        for changed in (self.solving_changed, self.profile_changed):
            changed.connect(lambda *_: self.missing.forget())
        self._frames = QTimer(self, timerType=Qt.TimerType.PreciseTimer)
        self._frames.timeout.connect(self._look)
        self._frames.start(round(1000 / frame_rate_hz))
        self._panels = QTimer(self)
        self._panels.timeout.connect(self._tick)
        self._panels.start(round(1000 / PANEL_HZ))

    @property
    def notifications(self) -> NotificationCentre:
        """The message centre of the session."""
        return self.session.notifications

    def later(self, function: Callable[[], Any]) -> None:
        """Run `function` on the window's thread. May be called from any."""
        self._call.emit(function)

    def background(
        self,
        work: Callable[[], Any],
        done: Callable[[Any], None] | None = None,
        failed: Callable[[], None] | None = None,
    ) -> None:
        """Run `work` off the window's thread; then `done` with its result on the window's.

        What it raises is told to the operator, then `failed` is called.
        """
        self._submit(self._errands, work, done, failed)

    def _submit(
        self,
        pool: DaemonPool,
        work: Callable[[], Any],
        done: Callable[[Any], None] | None = None,
        failed: Callable[[], None] | None = None,
    ) -> None:
        def run() -> None:
            try:
                result = work()
            except Exception as error:
                self.notifications.error(error)
                if failed is not None:
                    self.later(failed)
                return
            if done is not None:
                self.later(lambda: done(result))

        pool.submit(run)

    def watch_disk(self, folder: Path) -> None:
        """Ask from now on how much room this folder has."""
        self._folder, self._disk_asked_s, self._disk_free = folder, -math.inf, None

    @property
    def disk_free(self) -> int | None:
        """Bytes free where takes go, asked every other second off this thread; None if unknown."""
        return self._disk_free

    # Commands.

    def add_device(self, device_class: type[Device], settings: Mapping[str, object], title: str = "") -> Receiver:
        """Add a device. Raises DeviceError for a wrong setting."""
        stream = self.session.add_device(device_class, settings, title)
        self.devices_changed.emit()
        return stream

    def connect_device(self, stream: Receiver) -> None:
        """Begin to connect; a refusal is told."""
        self._guarded(lambda: self.session.connect(stream))

    def disconnect_device(self, stream: Receiver) -> None:
        """Begin to disconnect; a refusal is told."""
        self._guarded(lambda: self.session.disconnect(stream))

    def solve(self, key: str) -> None:
        """Solve this stream from now on. Raises DeviceError while recording, or where it is gone or not optical."""
        self.session.solve(key)
        self._watch_solving()

    def reconnecting(self, stream: Receiver) -> bool:
        """Other settings were asked for and are not in force yet."""
        return stream in self._reconnecting

    def configure_device(self, stream: Receiver, settings: Mapping[str, object]) -> None:
        """Use other settings; a connected device is connected anew. Raises DeviceError for a wrong value."""
        if not stream.active and not self.reconnecting(stream):
            stream.configure(settings)
            self.devices_changed.emit()
            return

        def reconnect() -> None:
            with self._one_reconnects:  # in the order in which they were asked for
                solved = self.session.solving if stream is self.session.solving_receiver else ""
                self.session.disconnect(stream)
                stream.join(RECONNECT_S)
                try:
                    stream.configure(settings)
                finally:
                    self.session.connect(stream)
                if solved and self.session.solving:  # another took over meanwhile
                    with suppress(DeviceError):  # that it cannot be reached is told already
                        stream.wait_connected(RECONNECT_S)
                        self.session.solve(solved)

        def done() -> None:
            self._reconnecting.remove(stream)
            if stream is self.session.solving_receiver:
                self._solving = ""  # the same key, and another connection
            self._watch_solving()
            self.devices_changed.emit()

        self._reconnecting.append(stream)
        self.background(reconnect, lambda _: done(), done)

    def _guarded(self, command: Callable[[], Any]) -> None:
        self._guard(command)
        self._watch_solving()
        self.devices_changed.emit()

    def _guard(self, command: Callable[[], Any]) -> None:
        try:
            command()
        except Exception as error:
            self.notifications.error(error)

    def set_profile(self, profile: Profile, performer: int = 0) -> None:
        """Solve for one performer with another profile, the others stay; see `set_profiles`."""
        self.set_profiles(with_profile(self.session.profiles, performer, profile))

    def set_profiles(self, profiles: Sequence[Profile]) -> None:
        """Solve for these performers. Raises PhalanxError while recording.

        A network that was never loaded is loaded first, off this thread, and it is done then, if nothing else was asked
        for meanwhile; what cannot be loaded is told, and all stays as it is.
        """
        self._changes += 1
        number = self._changes

        def change() -> None:
            if number == self._changes:
                self._loaded |= {profile.network for profile in self.session.profiles}
                self.session.set_profiles(profiles)
                self.profile_changed.emit(self.session.profile)

        self.with_networks(profiles, change)

    def with_networks(self, profiles: Sequence[Profile], then: Callable[[], object], fresh: bool = False) -> None:
        """Call `then` once the networks of these profiles are loaded: at once if they are, else later, on this thread.

        What cannot be loaded is told, and `then` is not called. fresh: load also what was, for its file may be another.
        """
        networks = {profile.network for profile in profiles} if fresh else self.session.networks_to_load(profiles)
        networks -= set() if fresh else self._loaded
        if not networks:
            then()
            return

        def load() -> None:
            for network in networks:
                network_at(network)

        def done(_: object) -> None:
            self._loaded |= networks
            self._guard(then)

        self.background(load, done)

    def set_look_ahead(self, seconds: float) -> None:
        """Hold poses back for so long, so that gaps that end within it are filled."""
        self.session.set_look_ahead(seconds)
        self.look_ahead_changed.emit(seconds)

    def set_solve_every(self, n: int) -> None:
        """Solve every n-th frame, 1 for all."""
        self.session.set_solve_every(n)
        self.solve_every_changed.emit(n)

    def start_recording(
        self, path: Path, info: TakeInfo, another: Callable[[], tuple[str, Path]] | None = None
    ) -> None:
        """Begin a take; `recording_changed` follows, and `recording_refused` if it cannot begin.

        another: gives a name and path that are free now, for when another Phalanx took these just before.
        """

        def begin() -> None:
            try:
                _begin(self.session.start_recording, path, info, another)
            except Exception as error:
                refusal = error
                self.later(lambda: self.recording_refused.emit(refusal))
                raise

        self._submit(self._commands, begin, lambda _: self._tick(), lambda: self._announce(force=True))

    def save_look_back(
        self, path: Path, info: TakeInfo, another: NextTake, refused: Callable[[Exception], None]
    ) -> None:
        """Save what just happened; `take_finished` follows. another: as of `start_recording`. refused: called with the
        error, which is told, if it cannot be done."""
        past = self.session.just_happened()  # now, however long the disk takes to answer
        waits = [True]

        def save() -> None:
            try:
                _begin(lambda path, info: self.session.save_look_back(path, info, past), path, info, another)
            except Exception as error:
                refusal = error
                self.later(lambda: refused(refusal))
                raise

        def say_waiting() -> None:
            if waits:
                what = f"What just happened is not saved yet: the take folder has not answered for {STALL_S:.0f} s."
                action = "Check its disk. It is kept in memory, and saved when the disk answers."
                self.notifications.problem(what, action, "Recorder")

        def begun(_: object) -> None:
            waits.clear()
            self._tick()

        self._submit(self._look_backs, save, begun, waits.clear)
        QTimer.singleShot(round(1000 * STALL_S), self, say_waiting)

    def stop_recording(self) -> None:
        """End the take; `recording_changed` follows at once and `take_finished` when it is sealed."""
        self._submit(self._commands, self.session.stop_recording, lambda _: self._tick())

    def pause(self) -> None:
        """Look no more at the session, and begin no take: the first half of closing, on the window's thread."""
        self.session.begin_no_more()
        self._frames.stop()
        self._panels.stop()

    def close(self) -> None:
        """After `pause`: stop and seal a running take, disconnect, end every thread. Waits, though not for what never
        comes back; from any thread."""
        deadline = time.monotonic() + CLOSE_S
        for pool in (self._commands, self._look_backs):
            while not pool.close(_LOOK_S) and not self._given_up.is_set() and time.monotonic() < deadline:
                pass
        self._errands.close(ERRANDS_S, drop=True)
        self.session.close()
        self._unsubscribe()

    def give_up(self) -> None:
        """Let `close` wait no longer for a disk that hangs."""
        self._given_up.set()
        self.session.give_up_finishing()

    # The window's thread.

    @Slot(object)
    def _run_here(self, function: Callable[[], Any]) -> None:
        function()

    def _look(self) -> None:
        number, frame = self.session.latest.newer(self._seen)
        if frame is not None:
            self._seen = number
            self.missing.take(frame.solved)
            self.frame.emit(frame)

    def _tick(self) -> None:
        self._announce()
        self._watch_solving()
        self._watch_devices()
        self._watch_opening()
        self._ask_disk()
        self.numbers.emit(self.session.numbers())

    def _ask_disk(self) -> None:
        """A folder on a network may take its time to answer: the window does not wait for it."""
        folder, now = self._folder, time.monotonic()
        if folder is None or now - self._disk_asked_s < DISK_EVERY_S:
            return
        self._disk_asked_s = math.inf  # until it has answered

        def answered(free: int | None) -> None:
            if folder == self._folder:
                self._disk_free, self._disk_asked_s = free, time.monotonic()

        def ask() -> None:
            free = free_bytes(folder)
            self.later(lambda: answered(free))

        # A thread of its own: nothing else must wait for a disk that hangs, not even the next folder's.
        threading.Thread(target=ask, name="disk", daemon=True).start()

    def _watch_opening(self) -> None:
        """Say when a take cannot begin because its disk does not answer."""
        opening = self.session.opening
        if opening is not None and opening.stalled and not self._opening_said:
            what = f"The take has not begun: the take folder has not answered for {opening.seconds:.0f} s."
            self.notifications.problem(what, "Check its disk. Recording begins when it answers.", "Recorder")
            self._opening_said = True
        elif opening is None and self._opening_said:
            self.notifications.info("The take folder answers again.", source="Recorder", settles=True)
            self._opening_said = False

    def _watch_solving(self) -> None:
        """Say when another stream is solved."""
        solving = self.session.solving
        if solving != self._solving:
            self._solving = solving
            self.solving_changed.emit(solving)

    def _watch_devices(self) -> None:
        """Say when a connected stream turns red, and when it has come back."""
        active = {(one.receiver, one.key): one for one in incoming(self.session) if one.receiver.streaming}
        for which, one in active.items():
            health, was_red = one.health, which in self._red
            if health.level is Level.PROBLEM and not was_red:
                self._red.add(which)
                what, _, action = health.reason.partition(". ")
                self.notifications.problem(what.removesuffix(".") + ".", action, one.title)
            elif was_red and (health.level is Level.GOOD or health.rate_hz > 0):  # amber, but there
                self._red.discard(which)
                self.notifications.info(f"{one.title} is back.", health.reason, one.title, settles=True)
        self._red &= set(active)
        streaming = {receiver for receiver, _ in active}
        if streaming != self._streaming:
            self._streaming = streaming
            self.devices_changed.emit()

    def _announce(self, force: bool = False) -> None:
        recording = self.session.recording
        if force or recording != self._was_recording:
            self._was_recording = recording
            self.recording_changed.emit(recording)


def _begin(begin: Callable[[Path, TakeInfo], object], path: Path, info: TakeInfo, another: NextTake | None) -> None:
    """Begin a take, under another name as long as this one is taken. Raises what `begin` does."""
    for tries_left in reversed(range(_NAMES_TRIED)):
        try:
            begin(path, info)
            return
        except TakeError as error:
            if another is None or not tries_left or not isinstance(error.__cause__, FileExistsError):
                raise
        name, path = another()
        info = replace(info, name=name)
