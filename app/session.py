"""A capture session, with or without a window: devices, engine, takes, and the figures of all three.

    receiver thread per device -> of the stream that is solved: bounded queue -> engine thread -> latest-frame mailbox
                     |                                                              |
                     +-> take writer thread: every stream that is armed <-----------+ (solved)

No call here waits for a device, the engine or the disk unless its docstring says so.
"""

from __future__ import annotations

import sys
import threading
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path

from app.armed import ArmedStream, armed_streams, stream_to_solve
from app.disk_wait import Opening
from app.live_numbers import LiveFrame, SolverNumbers, Trail
from app.look_back import LookBack, Past
from app.look_back_take import LookBackTake, info_of, stream_to_solve_of
from app.mailbox import Latest
from app.notifications import NotificationCentre, log_folder
from app.receiver import Receiver
from app.session_takes import SessionTakes
from app.solver_thread import CHANGED, QUEUE_FRAMES, EngineLike, SolverThread
from app.take_summary import RecordingNumbers, SealingNumbers, TakeSummary
from core.cast import Cast, cast_of, hands_of, with_profile
from core.engine import Engine
from core.engine import warm_up as warm_up_kernels
from core.errors import DeviceError, PhalanxError, TakeError
from core.frames import HandKey, MarkerFrame, Standstill, stood_still
from core.labelling.network import network_at
from core.profile import Profile
from core.streams import Sample
from core.takes.disk import RESERVE
from core.takes.take import TakeInfo
from devices.device import Device

SWITCH_INTERVAL_S = 0.0005
"""How long a thread may hold the interpreter while another waits. At the default of 5 ms a busy window makes the
receiver lose packets at high rates."""


@dataclass(frozen=True)
class SessionNumbers:
    """Everything a panel shows, taken at one moment.

    recording: None while no take is written. sealing: takes being finished. opening: one that is to begin and waits for
    its disk.
    changes: how often the profiles were changed, up to now.
    """

    ready: bool
    status: str
    solver: SolverNumbers
    queue_depth: int
    queue_size: int
    recording: RecordingNumbers | None
    sealing: tuple[SealingNumbers, ...]
    opening: Opening | None = None
    changes: int = 0


class Session(SessionTakes):
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
        super().__init__(notifications or NotificationCentre(), disk_reserve_bytes)
        self.latest: Latest[LiveFrame] = Latest()
        self.trail = Trail(hands_of(cast))
        self.look_back = LookBack()
        self._solver = SolverThread(
            cast, engine, warm_up, self._solved, self.notifications, queue_frames=engine_queue_frames
        )
        self._receivers: list[Receiver] = []
        self._numbers: Counter[str] = Counter()  # of devices, by their kinds
        self._solving = self._chosen = ""  # keys of streams: the one that is solved, and that the operator wants to be
        self._profiles = cast
        self._changes = 0
        self._intake = threading.Lock()
        self._closed = False

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
            self._closed = True
            self.begin_no_more()
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
            self._settle(by_choice=True)

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
                stream.connect(held)

    def disconnect(self, stream: Receiver) -> None:
        """Begin to disconnect. Raises DeviceError while a take is recorded from it."""
        with self._lock:
            self._refuse_if_recorded(stream, "disconnected")
            self._let_go(stream)

    def _let_go(self, stream: Receiver) -> None:
        """Nothing that it has sent is seen from now on."""
        before, was_solved = self._solving, stream is self.solving_receiver
        with self._intake:
            stream.disconnect()
        self._settle()
        if was_solved and self._solving in ("", before):  # no other has begun
            self._solver.begin_anew()
            self.latest.clear()

    def _refuse_if_recorded(self, stream: Receiver, what: str) -> None:
        if any(one.receiver is stream for one in self._recorded):
            raise DeviceError(f"{stream.title} cannot be {what} while a take is recorded.", "Stop the recording first.")

    def _settle(self, by_choice: bool = False) -> None:
        """Solve the stream that is to be solved of those that are armed now; it is said where nobody has just chosen
        it. Under the lock."""
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
            if before and not by_choice:
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

    # Figures, and what takes are to know.

    def _why_not_ready(self) -> str:
        return "" if self.ready else self._solver.status

    def just_happened(self) -> Past:
        """What came in the last seconds, and which streams were connected then and sent nothing."""
        past = self.look_back.recent()
        return past.among([one.info for one in self.streams if past.kept and one.receiver.connected_s <= past.end_s])

    def save_look_back(self, path: Path, info: TakeInfo, past: Past | None = None) -> Future[TakeSummary]:
        """Write the last seconds of all streams as a take, while one is recorded as well as while none is: what is in
        that one is in both. Opens its file, so it may take some milliseconds; the frames are then solved beside, and it
        is sealed. The future gives the summary.

        info: name and words; the rest of it is known here. past: None: what has come up to now. Raises TakeError if
        nothing has come, or the file cannot be made.
        """
        past = self.just_happened() if past is None else past
        solving = stream_to_solve_of(past, self._solving)
        info = info_of(info, past, solving, self.receivers)
        if self._ending:
            raise TakeError("Phalanx is being closed.", "Start it again.")
        take = LookBackTake(
            path, info, self._profiles, past, solving, on_notice=self._notice, disk_reserve_bytes=self._reserve,
            on_fault=lambda error: self.notifications.error(error, "Recorder"),
        )  # fmt: skip
        with self._lock:
            before = [one.info.name for one in self._sealing if one.sealing.solving]
            self._sealing.append(take)
        self.notifications.info(take.announced(before), source="Recorder")
        self.on_begun(take.path)
        take.finished.add_done_callback(lambda _: self._sealed(take))
        return take.finished

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
            changes=self._changes,
        )

    # What the receiver and engine threads call.

    def _armed(self, receiver: Receiver) -> None:
        with self._lock:
            self._settle()
        self._say_late(receiver)
        self._say_twice(receiver)

    def _say_twice(self, receiver: Receiver) -> None:
        """Two devices that receive the same are most often a port that was forgotten."""
        place = receiver.device_class, receiver.address
        live = receiver.streaming and receiver.address and not receiver.device_class.has_end
        for one in self.receivers if live else ():
            earlier = one.streaming and one.connected_s < receiver.connected_s
            if earlier and (one.device_class, one.address) == place:
                self.notifications.warning(
                    f"{receiver.key} receives from the same place as {one.key}, {receiver.address}: one stream is "
                    "recorded twice.", "Check its address and ports.", receiver.title,
                )  # fmt: skip
                return

    def _received(self, receiver: Receiver, sample: Sample) -> None:
        self.look_back.add(receiver.stream(sample.stream), sample.frame, receiver.counted)
        with self._intake:
            if not receiver.streaming:
                return
            recorder = self._recorder
            if recorder is not None and not recorder.raw(*sample):
                recorder = None  # it wants no pose
            if sample.stream == self._solving and isinstance(sample.frame, MarkerFrame):
                self._solver.offer(sample.frame, recorder)
            elif recorder is not None:
                recorder.unsolved(CHANGED)

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
