"""A take of what has just happened."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from math import isfinite
from pathlib import Path

from app.armed import ArmedStream
from app.look_back import Past
from app.look_back_solving import solved_beside
from app.receiver import Receiver
from app.recording import Recorder
from app.take_info import take_info
from app.take_summary import SealingNumbers, TakeSummary
from core.cast import Cast
from core.errors import CancelledError, TakeError
from core.frames import MarkerFrame, TrackedFrame
from core.streams import ClockSample, Sample
from core.takes.disk import RESERVE
from core.takes.safekeeping import Notice
from core.takes.take import Mark, TakeInfo
from core.words import count, listed
from devices.common.clock import host_clock
from devices.device import Health

LOG = logging.getLogger("phalanx")

CANCELLED, BROKE_DOWN, FAILED = "solving cancelled", "solving broke down", "solver error"
_LOOK_S = 0.1
_SOLVING = 0.9  # of the work; the rest is sealing
_ONE_AT_A_TIME = threading.Lock()
_BREATH_FRAMES, _BREATH_S = 8, 0.002
"""After so many frames the live ones have the interpreter for so long: half a minute at 120 Hz is written in 1.5 s."""
_BREATH_SEALING_S = 0.02


class LookBackTake(Recorder):
    """All frames are there when it begins: they are written at once, then solved beside, and then it is sealed.

    It can be read from the first moment on, as one that is recorded. Ended before it is solved, by whatever means, it
    is sealed without the poses that are missing: those can be made again.
    """

    def __init__(
        self,
        path: Path,
        info: TakeInfo,
        profiles: Cast,
        past: Past,
        solving: str,
        *,
        on_fault: Callable[[Exception], None] = lambda error: None,
        on_notice: Callable[[Notice], None] = lambda notice: None,
        disk_reserve_bytes: int = RESERVE,
    ) -> None:
        """past: what came; solving: key of the stream of it that is solved, "" for none. on_fault: called when the disk
        fails, or solving does. The rest as of Recorder. Opens the file; raises TakeError."""
        self._end_s, self._profiles, self._say = past.end_s, profiles, on_fault
        self._counted = {key: past.counted(key) for key in past.streams}
        self._lasted_s = past.end_s - past.begin_s
        self._cancelled = threading.Event()
        self._done = self._handled = 0
        super().__init__(
            path, info, profiles, list(past.streams.values()), solving,
            on_fault=self._failed, on_notice=on_notice, disk_reserve_bytes=disk_reserve_bytes,
            queue_frames=2 * len(past.kept) + 1, began_s=past.begin_s,
        )  # fmt: skip
        self._owed: list[MarkerFrame] = []
        for one in past.kept:
            if self.raw(one.stream.key, one.record) and isinstance(one.record, MarkerFrame):
                self._owed.append(one.record)
        self._solver = threading.Thread(target=self._solve, name=f"phalanx-look-back-{info.name}", daemon=True)
        self._solver.start()

    def announced(self, before: Sequence[str]) -> str:
        """What becomes of it now. before: names of the takes that are solved first."""
        solved = f", and solved after {listed(before)}" if before else " and solved"
        frames = count(self.sealing.received, "frame")
        return (
            f"Take {self.info.name}, the last {self._lasted_s:.0f} s with {frames}, is written now"
            f"{solved if self._owed else ''}."
        )

    @property
    def sealing(self) -> SealingNumbers:
        """How far it is in being solved and finished."""
        sealing, solving = super().sealing, not self._stopping.is_set()
        solved = self._done / max(len(self._owed), 1) if solving else 1.0
        return replace(sealing, part=_SOLVING * solved + (1.0 - _SOLVING) * sealing.part, solving=solving)

    def stop(self, meanwhile: Mapping[str, Health] | None = None, ended_s: float | None = None) -> Future[TakeSummary]:
        """Solve no more, and seal it. What the devices lost and when it ended it knows itself."""
        self._cancelled.set()
        return super().stop(self._counted, self._end_s)

    def wait_finished(self, patience_s: float) -> None:
        """As Recorder; it is not waited for to be solved."""
        self.stop()
        super().wait_finished(patience_s)
        self._solver.join(patience_s)

    def _put(self, item: Sample | TrackedFrame | Mark) -> None:
        """What is live goes first, until somebody waits for this."""
        super()._put(item)
        self._handled += 1
        if self._handled % _BREATH_FRAMES == 0:
            self._cancelled.wait(_BREATH_S)

    def _sealed_part(self, part: float) -> None:
        super()._sealed_part(part)
        self._cancelled.wait(_BREATH_SEALING_S)

    def _failed(self, error: Exception) -> None:
        """There is no use in solving what cannot be written. It ends where it is solved, so that all is counted."""
        self._say(error)
        self._cancelled.set()

    def _solve(self) -> None:
        """On a thread of its own, and those of several takes one after the other: each wants a processor."""
        left = BROKE_DOWN
        try:
            while not _ONE_AT_A_TIME.acquire(timeout=_LOOK_S):
                if self._cancelled.is_set():
                    raise CancelledError
            try:
                for pose in solved_beside(self._owed, self._profiles, self._cancelled.is_set):
                    if pose is not None:
                        self.solved(pose)
                    else:
                        self.unsolved(FAILED)
                    self._done += 1
            finally:
                _ONE_AT_A_TIME.release()
        except CancelledError:
            left = CANCELLED
        except Exception as error:
            LOG.exception("Solving what just happened, for take %s", self.info.name)
            self._say(error)
        for _ in self._owed[self._done :]:
            self.unsolved(left)
        super().stop(self._counted, self._end_s)


def stream_to_solve_of(past: Past, solving: str) -> str:
    """Key of the stream of which there will be poses: that which is solved now if something came of it, or else the
    first optical one; "" for none."""
    silent = {one.key for one in past.silent}
    optical = [key for key, stream in past.streams.items() if stream.what == "markers" and key not in silent]
    return solving if solving in optical else next(iter(optical), "")


def info_of(info: TakeInfo, past: Past, solving: str, receivers: Sequence[Receiver]) -> TakeInfo:
    """The same name and words, with when that was, and what the devices say of themselves that it came from. Raises
    TakeError where nothing came."""
    if not any(not isinstance(one.record, ClockSample) for one in past.kept):
        raise TakeError("Nothing has come from a device yet, so there is nothing to save.", "Connect a device first.")
    streams = [
        ArmedStream(stream, receiver)
        for key, stream in past.streams.items()
        for receiver in receivers
        if key.startswith(f"{receiver.key}/")
    ]
    about = take_info(info.name, streams, solving, performer=info.performer, notes=info.notes, shot=info.shot)
    solved, first = past.streams.get(solving), next(iter(past.streams.values()))
    rate_hz = about.rate_hz if isfinite(about.rate_hz) or solved is None else solved.rate_hz
    device = about.device or {"kind": first.kind, "title": first.title}  # it was removed since
    began = datetime.now(UTC) - timedelta(seconds=host_clock() - past.begin_s)
    return replace(about, created_utc=began, rate_hz=rate_hz, device=device, looked_back=True)
