"""A capture session, with or without a window: devices, engine, takes, and the figures of all three.

    receiver thread per device -> of the stream that is solved: bounded queue -> engine thread -> latest-frame mailbox
                     |                                                              |
                     +-> take writer thread: every stream that is armed <-----------+ (solved)

No call here waits for a device, the engine or the disk unless its docstring says so.
"""

from __future__ import annotations

import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from app.armed import ArmedStream, armed_streams, stream_to_solve
from app.disk_wait import AT_ONCE_S, DiskWait, Opening
from app.live_numbers import LiveFrame, SolverNumbers, Trail
from app.mailbox import Latest
from app.notifications import NotificationCentre, log_folder
from app.receiver import Receiver
from app.recording import Recorder
from app.solver_thread import QUEUE_FRAMES, EngineLike, SolverThread
from app.take_info import take_info
from app.take_summary import RecordingNumbers, SealingNumbers, TakeSummary
from core.cast import Cast, cast_of, hands_of, with_profile
from core.engine import Engine
from core.engine import warm_up as warm_up_kernels
from core.errors import DeviceError, PhalanxError, TakeError
from core.frames import HandKey, MarkerFrame, Standstill, stood_still
from core.labelling.network import network_at
from core.level import Level
from core.profile import Profile
from core.streams import Sample
from core.takes.disk import RESERVE
from core.takes.safekeeping import Notice
from core.takes.take import Mark, TakeInfo
from devices.device import Device, Health

SWITCH_INTERVAL_S = 0.0005
"""How long a thread may hold the interpreter while another waits. At the default of 5 ms a busy window makes the
receiver lose packets at high rates."""


@dataclass(frozen=True)
class SessionNumbers:
    """Everything a panel shows, taken at one moment.

    recording: None while no take is written. sealing: takes being finished. opening: one that is to begin and waits for
    its disk.
    connects, changes: how often a device was connected, and the profiles were changed, up to now.
    """

    ready: bool
    status: str
    solver: SolverNumbers
    queue_depth: int
    queue_size: int
    recording: RecordingNumbers | None
    sealing: tuple[SealingNumbers, ...]
    opening: Opening | None = None
    connects: int = 0
    changes: int = 0


class Session:
    """Owns every thread but the window's. Thread-safe; commands come from one thread, figures go to any."""

    def __init__(
        self,
        profiles: Profile | Sequence[Profile],
        *,
        engine: Callable[[Cast], EngineLike] = Engine,
        warm_up: Callable[[], object] = warm_up_kernels,
        notifications: NotificationCentre | None = None,
        disk_reserve_bytes: int = RESERVE,
        engine_queue_frames: int = QUEUE_FRAMES,
    ) -> None:
        """profiles: of each performer in the volume."""
        cast = cast_of(profiles)
        self.notifications = notifications or NotificationCentre()
        self.latest: Latest[LiveFrame] = Latest()
        self.trail = Trail(hands_of(cast))
        self.on_take: Callable[[TakeSummary], None] = lambda summary: None
        self.on_begun: Callable[[Path], None] = lambda path: None
        self.on_moved: Callable[[Path, Path], None] = lambda before, now: None
        self.on_sealed: Callable[[Path], None] = lambda path: None
        """Told of every take that begins and is sealed: for what outlives this process, should it not end well."""
        self._solver = SolverThread(
            cast, engine, warm_up, self._solved, self.notifications, queue_frames=engine_queue_frames
        )
        self._reserve = disk_reserve_bytes
        self._lock = threading.RLock()
        self._receivers: list[Receiver] = []
        self._numbers: Counter[str] = Counter()  # of devices, by their kinds
        self._solving = self._chosen = ""  # keys of streams: the one that is solved, and that the operator wants to be
        self._recorder: Recorder | None = None
        self._recorded: dict[ArmedStream, Health] = {}  # with what had been counted when the take began
        self._opening: tuple[Path, DiskWait] | None = None  # a take that is to begin is with the disk
        self._sealing: list[Recorder] = []
        self._profiles = cast
        self._connects = self._changes = 0
        self._intake = threading.Lock()
        self._closed = self._ending = False

    # Life.

    def start(self) -> None:
        """Start the engine thread, which first prepares the kernels; see `ready`."""
        sys.setswitchinterval(SWITCH_INTERVAL_S)
        self._solver.start()

    @property
    def ready(self) -> bool:
        """The solver is prepared: a take may be recorded."""
        return self._solver.ready.is_set()

    def wait_ready(self, timeout_s: float = 120.0) -> None:
        """Wait for the solver. Raises PhalanxError if it does not get ready in time."""
        if not self._solver.ready.wait(timeout_s):
            raise PhalanxError(
                f"The solver was not ready after {timeout_s:g} s.",
                "The first start compiles it, which is long on a busy computer: start again, it goes on where it was. "
                f"The log is in {log_folder()}.",
            )

    def close(self, timeout_s: float = 60.0) -> None:
        """Stop and seal a running take, disconnect every device, end every thread. Waits as long as a take is being
        finished; one whose disk has not answered for `timeout_s` is given up. A solver that is still being prepared is
        not waited for."""
        with self._lock:
            if self._closed:
                return
            self._closed = self._ending = True
        self._stop_if_recording()
        for stream in self.receivers:
            stream.disconnect()
        for stream in self.receivers:
            stream.join(timeout_s)
        for recorder in list(self._sealing):
            recorder.wait_finished(timeout_s)
        self._solver.close(timeout_s)

    # Devices.

    @property
    def receivers(self) -> list[Receiver]:
        """The devices of the session, in the order they were added."""
        with self._lock:
            return list(self._receivers)

    @property
    def live_stream(self) -> Receiver | None:
        """The device that feeds the engine, or is to."""
        return self.solving_receiver or next((one for one in self.receivers if one.active), None)

    @property
    def streams(self) -> tuple[ArmedStream, ...]:
        """Those of all devices that stream, in the order in which these were connected."""
        return armed_streams(self.receivers)

    @property
    def solving(self) -> str:
        """Key of the optical stream that is solved, "" for none."""
        return self._solving

    @property
    def solving_receiver(self) -> Receiver | None:
        """Its device, None for none."""
        return next((one for one in self.receivers if self._solving.startswith(f"{one.key}/")), None)

    def solve(self, key: str) -> None:
        """Solve this stream, now and whenever it is connected again. Raises DeviceError for one that is not connected
        or has no markers, and while a take is recorded."""
        with self._lock:
            stream = next((one for one in self.streams if one.key == key), None)
            optical = ", ".join(one.key for one in self.streams if one.optical) or "none"
            if stream is None:
                raise DeviceError(f"No stream {key!r} is connected.", f"To be solved there is {optical}.")
            if not stream.optical:
                raise DeviceError(f"Stream {key} has no markers, so it cannot be solved.", f"There is {optical}.")
            if key != self._solving and self._taken:
                raise DeviceError(
                    "Another stream cannot be solved while a take is recorded.", "Stop the recording first."
                )
            self._chosen = key
            self._settle()

    def add_device(
        self, device_class: type[Device], settings: Mapping[str, object] | None = None, title: str = ""
    ) -> Receiver:
        """A device with its settings, not yet connected. Raises DeviceError for a wrong setting."""
        with self._lock:
            kind = device_class.kind
            receiver = Receiver(
                self._numbers[kind] + 1, device_class, settings or {}, self._received, self._device_failed, title,
                self._device_warned, self._stood_still, self._armed,
            )  # fmt: skip
            self._numbers[kind] += 1
            self._receivers.append(receiver)
        return receiver

    def restore_device(self, stream: Receiver, index: int) -> None:
        """Put a removed device back where it was."""
        with self._lock:
            if stream not in self._receivers:
                self._receivers.insert(index, stream)

    def remove_device(self, stream: Receiver) -> int:
        """Disconnect and forget a device. Raises DeviceError while it is being recorded. Returns its place."""
        with self._lock:
            self._refuse_if_recorded(stream, "removed")
            index = self._receivers.index(stream)
            self._let_go(stream)
            self._receivers.remove(stream)
        return index

    def connect(self, stream: Receiver, held: bool = False) -> None:
        """Begin to connect; `stream.health()` says how it goes. Its streams are armed once it is open.

        held: it sends nothing until `stream.begin()`.
        """
        with self._lock:
            if not self._closed:
                self._connects += 1
                stream.connect(held)

    def disconnect(self, stream: Receiver) -> None:
        """Begin to disconnect. Raises DeviceError while a take is recorded from it."""
        with self._lock:
            self._refuse_if_recorded(stream, "disconnected")
            self._let_go(stream)

    def _let_go(self, stream: Receiver) -> None:
        """Nothing that it has sent is seen from now on."""
        was_solved = stream is self.solving_receiver
        with self._intake:
            stream.disconnect()
        self._settle()
        if was_solved and not self._solving:
            self._solver.begin_anew()
            self.latest.clear()

    def _refuse_if_recorded(self, stream: Receiver, what: str) -> None:
        if any(one.receiver is stream for one in self._recorded):
            raise DeviceError(f"{stream.title} cannot be {what} while a take is recorded.", "Stop the recording first.")

    @property
    def _taken(self) -> bool:
        """A take is recorded, or is about to be: what is solved stays so."""
        return self.recording or self._opening is not None

    def _settle(self) -> None:
        """Solve the stream that is to be solved of those that are armed now. Under the lock."""
        if self._taken or self._closed:
            return
        before, now = self._solving, stream_to_solve(self.streams, self._solving, self._chosen)
        if now == before:
            return
        with self._intake:
            self._solving = now
            if now:
                self._solver.begin_anew()
        if now:
            self._solver.meter.begin()
            self._solver.reset()
            self.latest.clear()
            self.trail.clear()
            if before:
                self.notifications.warning(f"{now} is solved now, in place of {before}.", source="Solver")

    # The solver.

    @property
    def profiles(self) -> Cast:
        """The performers and layouts that are solved for."""
        return self._profiles

    @property
    def profile(self) -> Profile:
        """That of the first performer."""
        return self._profiles[0]

    def set_profiles(self, profiles: Profile | Sequence[Profile]) -> None:
        """Solve for other performers or layouts. Raises PhalanxError while recording, or for a network that cannot be
        run. One that is not in use may take a moment to be loaded."""
        cast = cast_of(profiles)
        for network in self.networks_to_load(cast):
            network_at(network)  # what cannot be run is not taken up
        with self._lock:
            if self.recording or self._opening is not None:
                raise PhalanxError("The profile is locked while a take is recorded.", "Stop the recording first.")
            self._profiles = cast
            self._changes += 1
            self._solver.set_profiles(cast)
            self.latest.clear()
            self.trail.begin(hands_of(cast))

    def networks_to_load(self, profiles: Sequence[Profile]) -> set[str | None]:
        """The networks that these profiles name and none in use does."""
        return {profile.network for profile in profiles} - {profile.network for profile in self._profiles}

    def set_profile(self, profile: Profile, performer: int = 0) -> None:
        """Solve for one performer with another profile, the others stay. Raises PhalanxError while recording."""
        self.set_profiles(with_profile(self._profiles, performer, profile))

    @property
    def look_ahead_s(self) -> float:
        """How long poses are held back so that gaps that end within it are filled [s]."""
        return self._solver.look_ahead_s

    def set_look_ahead(self, seconds: float) -> None:
        """Hold poses back for so long, 0 for not at all. Takes are recorded as they are solved, without it."""
        self._solver.set_look_ahead(seconds)

    @property
    def solve_every(self) -> int:
        """Every n-th frame of the stream is solved; 1: all."""
        return self._solver.solve_every

    def set_solve_every(self, n: int) -> None:
        """Solve every n-th frame from the next one on, where cameras are faster than the solver. Takes hold all of
        them, and count those left out under a reason of their own. Raises PhalanxError for less than 1 or too large an
        n."""
        self._solver.set_solve_every(n)

    def search_again(self, hand: HandKey | None = None) -> None:
        """Let go of a hand, or of all (None), and find it anew."""
        if hand is None:
            self._solver.reset()
        else:
            self._solver.search(hand)

    # Takes.

    @property
    def recording(self) -> bool:
        """A take is being written and accepts frames."""
        return self._recorder is not None

    @property
    def recording_name(self) -> str:
        """Name of the take being written, empty if none is."""
        recorder = self._recorder
        return recorder.info.name if recorder is not None else ""

    @property
    def unsealed(self) -> tuple[Path, ...]:
        """The takes that are being written or finished. Waits for nothing: to be asked at any moment."""
        return tuple(path for path, _ in self.unsealed_numbers)

    @property
    def unsealed_numbers(self) -> tuple[tuple[Path, SealingNumbers], ...]:
        """The same, each with how much of it is on the disk. Waits for nothing."""
        recorders = [recorder for recorder in list(self._sealing) if not recorder.finished.done()]
        recorder = self._recorder
        return tuple((one.path, one.sealing) for one in ([*recorders, recorder] if recorder is not None else recorders))

    def take_info(self, name: str, *, performer: str | None = None, notes: str = "", shot: str = "") -> TakeInfo:
        """What is known of a take that begins now: of its devices, and of its performers if nobody says who they
        are."""
        if performer is None:
            performer = ", ".join(filter(None, (profile.performer for profile in self._profiles)))
        return take_info(name, self.streams, self._solving, performer=performer, notes=notes, shot=shot)

    def start_recording(self, path: Path, info: TakeInfo) -> Future[TakeSummary]:
        """Begin a take of all streams that are armed now. Opens its file, so it may take some milliseconds. The future
        gives the summary once the take is finished, whoever or whatever ends it.

        After `begin_no_more` none begins, and no file is left.

        Raises TakeError if a take is running, the solver is not ready, no device streams, or the file cannot be made.
        """
        disk = DiskWait()
        with self._lock:
            streams, solving = self._may_record(path), self._solving
            self._opening = path.parent, disk
        try:
            # Not under the lock, which the window takes too: the disk may hang.
            with disk:
                recorder = Recorder(
                    path, info, self._profiles, [one.info for one in streams], solving,
                    on_fault=self._recording_failed, on_notice=self._notice, disk_reserve_bytes=self._reserve,
                )  # fmt: skip
            with self._lock:
                begins = not self._ending
                if begins:
                    try:
                        recorded = {one: one.receiver.counted(one.key) for one in streams}
                    except BaseException:
                        recorder.discard()
                        raise
                    self._recorded, self._recorder = recorded, recorder
                    self.on_begun(recorder.path)
            if not begins:
                with disk:
                    recorder.discard().exception()  # once it comes back, its file has gone
        finally:
            with self._lock:
                self._opening = None
                self._settle()
        for receiver in {one.receiver: None for one in self.streams}:
            self._say_late(receiver)
        return recorder.finished

    def _may_record(self, path: Path) -> tuple[ArmedStream, ...]:
        """The streams that would be recorded. Raises TakeError."""
        if self._recorder is not None:
            raise TakeError(f"Take {self._recorder.info.name} is still being recorded.", "Stop it first.")
        if self._opening is not None:
            raise TakeError("A take is being begun; its disk has not answered yet.", "Check the disk.")
        if not self.ready:
            raise TakeError(f"Recording is not possible yet: {self._solver.status}", "Try again in some seconds.")
        streams = self.streams
        if not streams:
            raise TakeError("No device is connected, so there is nothing to record.", "Connect a device first.")
        for finishing in self._sealing:
            if finishing.sealing.stalled_s and finishing.path.parent == path.parent:
                raise TakeError(
                    f"The disk of {path.parent} does not answer; take {finishing.info.name} waits for it.",
                    "Check the disk, or choose a folder on another one.",
                )
        return streams

    def _say_late(self, receiver: Receiver) -> None:
        """A take holds the streams that it began with, and so it is said of a device that comes later."""
        with self._lock:
            recorder = self._recorder
            late = receiver.streaming and all(one.receiver is not receiver for one in self._recorded)
        if recorder is not None and late:
            self.notifications.warning(
                f"{receiver.title} is not in take {recorder.info.name}, which began before it was connected.",
                "To record it too, stop the recording and begin another take.", receiver.title,
            )  # fmt: skip

    @property
    def opening(self) -> Opening | None:
        """A take that is to begin and waits for its disk, None if none does."""
        folder, disk = self._opening or (Path(), None)
        seconds = disk.seconds if disk is not None else 0.0
        return Opening(folder, seconds) if seconds >= AT_ONCE_S else None

    def begin_no_more(self) -> None:
        """The session ends: a take that waits for its disk does not begin any more."""
        with self._lock:
            self._ending = True

    def stop_recording(self) -> Future[TakeSummary]:
        """End the take. It is sealed on its own thread; the next may start at once.

        The future gives the summary. Raises TakeError if nothing is recorded.
        """
        recorder, meanwhile = self._end_take()
        return recorder.stop(meanwhile)

    def discard_recording(self) -> Future[TakeSummary]:
        """End a take that never really began: without a frame in it, it leaves no file. Raises as `stop_recording`."""
        recorder, _ = self._end_take()
        return recorder.discard()

    def give_up_finishing(self) -> None:
        """Wait no longer for takes that are being finished; what is on disk of them is said at once."""
        for recorder in list(self._sealing):
            recorder.give_up()

    def _end_take(self) -> tuple[Recorder, dict[str, Health]]:
        """The take that ends, and what became of its streams before they came here."""
        with self._lock:
            recorder, meanwhile = self._recorder, self._meanwhile()
            if recorder is None:
                raise TakeError("No take is being recorded.", "Start one first.")
            self._recorder, self._recorded = None, {}
            self._sealing.append(recorder)
            self._settle()
        recorder.finished.add_done_callback(lambda _: self._sealed(recorder))
        return recorder, meanwhile

    def _meanwhile(self) -> dict[str, Health]:
        """Of each stream that is recorded, what its device has counted since the take began."""
        return {one.key: one.receiver.counted(one.key).since(before) for one, before in self._recorded.items()}

    def _stop_if_recording(self) -> None:
        with suppress(TakeError):  # it may have been ended by a fault this moment
            self.stop_recording()

    def mark(self, text: str = "") -> Mark:
        """Remember this moment of the take. Raises TakeError if nothing is recorded."""
        recorder = self._recorder
        if recorder is None:
            raise TakeError("A mark needs a take.", "Start recording first.")
        return recorder.mark(text)

    def set_notes(self, text: str) -> None:
        """Notes of the take that is being written, or has just been ended by a fault and is being finished."""
        with self._lock:
            recorder = self._recorder or (self._sealing[-1] if self._sealing else None)
        if recorder is not None:
            recorder.set_notes(text)

    def seal(self, timeout_s: float) -> None:
        """End the take that runs, if one does, and wait until it and those before are on disk, so long at most [s]."""
        deadline = time.monotonic() + timeout_s
        self._stop_if_recording()
        for recorder in list(self._sealing):
            with suppress(TimeoutError):
                recorder.finished.exception(max(deadline - time.monotonic(), 0.1))
            while recorder in self._sealing and time.monotonic() < deadline:
                time.sleep(0.005)  # until `on_sealed` knows it: this process may end next

    def _sealed(self, recorder: Recorder) -> None:
        finished = recorder.finished
        error = finished.exception()
        if error is None and (finished.result().sealed or not finished.result().bytes):
            self.on_sealed(finished.result().path)
        with self._lock:
            self._sealing.remove(recorder)
        if error is not None:
            self.notifications.error(error, "Recorder", "Finishing the take")
            return
        summary = finished.result()
        verdict = summary.verdict
        action = " ".join(text for text in verdict.texts if text != summary.problem)  # said when it came
        if verdict.level is Level.PROBLEM:
            self.notifications.problem(f"Take {summary.name}: {verdict.headline}.", action, "Recorder")
        elif verdict.level is Level.WARNING:
            self.notifications.warning(f"Take {summary.name} is saved: {verdict.headline}.", action, "Recorder")
        else:
            self.notifications.info(f"Take {summary.name} is saved. {summary.line}.", source="Recorder")
        self.on_take(summary)

    def _recording_failed(self, fault: PhalanxError) -> None:
        self.notifications.error(fault, "Recorder")
        self._stop_if_recording()

    def _notice(self, notice: Notice) -> None:
        if notice.moved is not None:
            self.on_moved(*notice.moved)
        say = {Level.PROBLEM: self.notifications.problem, Level.WARNING: self.notifications.warning}
        over = partial(self.notifications.info, settles=True)
        say.get(notice.level, over)(notice.what, notice.action, "Recorder")

    # Figures.

    def numbers(self) -> SessionNumbers:
        """Everything measured, now."""
        recorder = self._recorder
        return SessionNumbers(
            ready=self.ready,
            status=self._solver.status,
            solver=self._solver.meter.numbers(self._solver.look_ahead_s),
            queue_depth=self._solver.queue_depth,
            queue_size=self._solver.queue_size,
            recording=recorder.numbers(self._meanwhile()) if recorder is not None else None,
            sealing=tuple(recorder.sealing for recorder in list(self._sealing)),
            opening=self.opening,
            connects=self._connects,
            changes=self._changes,
        )

    # What the receiver and engine threads call.

    def _armed(self, receiver: Receiver) -> None:
        with self._lock:
            self._settle()
        self._say_late(receiver)

    def _received(self, receiver: Receiver, sample: Sample) -> None:
        with self._intake:
            if not receiver.streaming:
                return
            recorder, frame = self._recorder, sample.frame
            if recorder is not None and not recorder.raw(*sample):
                recorder = None
            if sample.stream == self._solving and isinstance(frame, MarkerFrame):
                self._solver.offer(frame, recorder)

    def _solved(self, frame: LiveFrame) -> None:
        self.latest.put(frame)
        if frame.solved.hands:
            self.trail.add(frame.solved)

    def _device_failed(self, stream: Receiver, error: BaseException) -> None:
        self.notifications.error(error, stream.title)

    def _stood_still(self, stream: Receiver, one: Standstill) -> None:
        what = "What waited meanwhile is read now; what could not wait is counted as lost by this."
        self.notifications.warning(f"{stood_still([one])}.", what, stream.title)

    def _device_warned(self, stream: Receiver, text: str) -> None:
        self.notifications.warning(f"{stream.address or stream.title}: {text}", source=stream.title)
