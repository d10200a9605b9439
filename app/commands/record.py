"""`phalanx record DEVICE --beside DEVICE`: capture without a window, by the session that the window uses."""

from __future__ import annotations

import argparse
import math
import os
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, wait
from contextlib import suppress
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Any

from app.commands.device_options import add_device_options, add_device_parsers, device_settings
from app.commands.out import out_file
from app.commands.result import Result
from app.commands.terminal import Progress, Stopped, say, tell, until_stopped, warn
from app.commands.verdict import status_of, verdict_figures
from app.device_kinds import device_class, device_classes
from app.every_nth import MOST
from app.silences import LONG_SILENCE_S
from core.disk_error import remedy, why
from core.errors import DeviceError, NoAnswerError, PhalanxError, TakeError
from core.level import Level
from core.printable import printable

if TYPE_CHECKING:
    from app.notifications import Notification
    from app.receiver import Receiver
    from app.session import Session
    from app.stream_figures import StreamFigures
    from app.take_summary import RecordingNumbers, TakeSummary
    from devices.device import Value

LAYOUT = "han19"
CONNECT_S = 15.0
"""How long a device that is no other's, as the performer, may take to open [s]."""
COMPILING_S = 20.0
"""After this it is said why the solver takes so long, and again each minute [s]."""
SEAL_S = 600.0
"""A disk that has not answered for so long while a take is finished is not waited for any longer."""
CLOSE_S = 10.0
_BESIDE = (
    "another device, recorded into the same take, with its options: --beside natnet server=192.168.1.7 "
    "command-port=1610; again for each. Solved is the first optical one that is named"
)
_LOOK_S = 0.05
_AT_ONCE_S = 1.0
_SOON_S = 0.5


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser(
        "record", help="capture a take without a window", description="Captures a take without a window."
    )
    for kind, child in add_device_parsers(parser, device_classes()):
        child.add_argument(
            "--out", metavar="TAKE", type=out_file, required=True, help="file of the take, ends in .mcap"
        )
        child.add_argument(
            "--beside", metavar=("KIND", "NAME=VALUE"), nargs="+", action="append", default=[], help=_BESIDE
        )
        child.add_argument(
            "--seconds", metavar="S", type=float, help="how long [s]; default: until Ctrl+C, or until files end"
        )
        child.add_argument(
            "--profile",
            metavar="P",
            action="append",
            help=f"profile file or layout, once for each performer in the volume; default {LAYOUT} on a generic hand",
        )
        child.add_argument(
            "--wait", metavar="S", type=float, default=10.0, help="how long to wait for the first frame [s]; default 10"
        )
        child.add_argument(
            "--solve-every", metavar="N", type=int, choices=range(1, MOST + 1), default=1,
            help="solve every Nth frame, where cameras are faster than the solver; the take holds all. Default 1",
        )  # fmt: skip
        child.add_argument("--shot", default="", help="kept in the take")
        child.add_argument("--notes", default="", help="kept in the take")
        child.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
        add_device_options(child, kind.parameters)
        child.set_defaults(run=run, imports=("app.session", "app.left_behind.run_file"))


def run(arguments: argparse.Namespace) -> Result:
    """Records one take; the exit status is that of its verdict. What is wrong is said as it is found, and once."""
    from app.left_behind.run_file import RunFile
    from app.notifications import start_log
    from app.session import Session
    from core.labelling.network import network_at
    from core.profile import load_profile
    from core.takes.file_name import check_take_name
    from core.takes.take import EXTENSION

    path: Path = arguments.out
    if path.suffix != EXTENSION:
        path = path.with_name(path.name + EXTENSION)
    if os.path.lexists(path):
        raise TakeError(f"{path} exists already.", "Choose another name: takes are never overwritten.")
    check_take_name(path)
    if arguments.seconds is not None and not arguments.seconds > 0:
        raise TakeError(f"--seconds {arguments.seconds:g} is no duration.", "Give a number above 0.")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise TakeError(
            f"The folder {path.parent} cannot be made ({why(path.parent, error)}).", "Choose another."
        ) from error
    _try_folder(path.parent)
    log = start_log()
    profiles = [load_profile(profile) for profile in arguments.profile or [LAYOUT]]
    for profile in profiles:
        network_at(profile.network)  # what cannot be run is said before anything waits for it
    session = Session(profiles)
    session.set_solve_every(arguments.solve_every)
    taken: list[Future[TakeSummary]] = []
    told = Event()
    session.on_take = lambda summary: told.set()  # once it is said what became of it
    with RunFile("phalanx record") as file, until_stopped(lambda: _left(session, taken)) as stopped:
        file.follow(session)
        patience_s = _SOON_S  # nothing is lost yet by what ends later: a compiler, a server that does not answer
        try:
            streams = [session.add_device(device_class(kind), settings) for kind, settings in _devices(arguments)]
            say("Preparing the solver…")
            session.start()
            _prepare(session, stopped, log)
            _connect(session, streams, arguments.wait, stopped)
            session.notifications.subscribe(_tell)
            for stream in streams:
                warn(stream.address, stream.device.warnings)
            info = session.take_info(path.stem, notes=arguments.notes, shot=arguments.shot)
            stopped.check()
            stopped.watched, patience_s = True, CLOSE_S
            finished = session.start_recording(path, info)
            taken.append(finished)
            try:
                for stream in streams:
                    stream.begin()
                say(f"Recording {path.name} from {_titles(streams)}. Ctrl+C ends it.")
                _record(session, streams, arguments.seconds, stopped)
                _never_began(session, streams)
            except BaseException:
                with suppress(TakeError):
                    session.discard_recording()
                raise
            summary = _finish(session, finished, stopped.again)
            told.wait(_AT_ONCE_S)
            return _report(summary, streams)
        finally:
            session.close(patience_s)


def _devices(arguments: argparse.Namespace) -> Iterator[tuple[str, dict[str, Value]]]:
    """Kinds and settings of all that are recorded, unchecked. Raises PhalanxError for what is no setting."""
    yield arguments.device, device_settings(arguments)
    for kind, *words in arguments.beside:
        settings: dict[str, Value] = {}
        for word in words:
            name, is_set, value = word.partition("=")
            if not is_set:
                raise PhalanxError(
                    f"--beside {kind}: {word!r} sets nothing.",
                    f"Write NAME=VALUE; `phalanx record {kind} --help` has the names.",
                )
            settings[name.removeprefix("--").replace("-", "_")] = value
        yield kind, settings


def _titles(streams: Sequence[Receiver]) -> str:
    return " and ".join(stream.title for stream in streams)


def _left(session: Session, taken: Sequence[Future[TakeSummary]]) -> str:
    """What becomes of the take if this process ends now."""
    paths = list(session.unsealed)
    for finished in taken:
        if finished.done() and finished.exception() is None:
            summary = finished.result()
            if summary.sealed:
                return f"Take {summary.path} is finished."
            paths.append(summary.path)
    return " ".join(
        f"Take {path} is not sealed; what was received can be read: `phalanx recover {path}` makes it whole."
        for path in paths
    )


def _tell(note: Notification) -> None:
    if note.severity.value != "info":
        say(f"phalanx: {note.line}")


def _try_folder(folder: Path) -> None:
    """Raises TakeError where no file can be made: before anything waits for the solver."""
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise TakeError(
            f"No take can be written to the folder {folder} ({why(folder, error)}).", remedy(error)
        ) from error


def _prepare(session: Session, stopped: Stopped, log: Path | None) -> None:
    """Returns when the solver is ready, however long it is compiled. Raises PhalanxError if it cannot start."""
    from app.solver_thread import NO_START

    progress, begun_s, said_s = Progress("Preparing the solver"), time.monotonic(), COMPILING_S - 60.0
    while not session.ready:
        stopped.check()
        if session.numbers().status == NO_START:
            raise PhalanxError(NO_START, f"The reason is in {log}." if log else "No log could be written.")
        elapsed_s = time.monotonic() - begun_s
        progress.show(f"{elapsed_s:.0f} s")
        if elapsed_s >= said_s + 60.0:
            said_s = elapsed_s
            progress.done()
            say(
                f"Preparing the solver for {elapsed_s:.0f} s: the first start compiles it for this computer, which "
                "takes minutes on a busy one. Ctrl+C ends it; the next start goes on where it was."
            )
        time.sleep(_LOOK_S)
    progress.done()


def _connect(session: Session, streams: Sequence[Receiver], wait_s: float, stopped: Stopped) -> None:
    """Returns when frames come in of every device. Raises DeviceError with a device's own reason if none do within
    wait_s, whether or not anybody answers until then.

    A file waits until it is recorded: its first frames are not missed.
    """
    begun_s = time.monotonic()
    for stream in streams:
        session.connect(stream, held=stream.device_class.has_end)
    for stream in streams:
        _wait_open(session, stream, begun_s, wait_s, stopped)
    optical = [one.key for stream in streams for one in stream.streams if one.what == "markers"]
    if optical:
        session.solve(optical[0])
    for stream in streams:
        if not stream.device_class.has_end:
            _wait_frame(stream, begun_s if stream.address else time.monotonic(), wait_s, stopped)


def _wait_open(session: Session, stream: Receiver, begun_s: float, wait_s: float, stopped: Stopped) -> None:
    has_end = stream.device_class.has_end
    opened_by = math.inf if has_end else begun_s + (wait_s if stream.address else max(wait_s, CONNECT_S))
    silent: NoAnswerError | None = None
    while True:
        while stream.opening:  # a long file takes a while to be read
            stopped.check()
            if time.monotonic() > opened_by:
                title = f"{stream.title} ({stream.key})" if len(session.receivers) > 1 else stream.title
                busy = "It may still be starting, on a busy computer: wait longer (--wait S)."
                raise silent or DeviceError(
                    f"{title} did not answer within {wait_s:g} s.",
                    "Check that it is running." if stream.address else busy,
                )
            time.sleep(_LOOK_S)
        try:
            stream.wait_connected(CONNECT_S)
            return
        except NoAnswerError as error:
            silent = error
            if time.monotonic() > opened_by:
                raise
        session.connect(stream)


def _wait_frame(stream: Receiver, begun_s: float, wait_s: float, stopped: Stopped) -> None:
    while stream.health().received == 0 and not stream.finished:
        stopped.check()
        if time.monotonic() > begun_s + wait_s:
            health = stream.health()
            heard = f" Heard: {health.heard}" if health.heard else ""
            raise DeviceError(f"No frame came from {stream.title} within {wait_s:g} s. {health.reason}{heard}")
        time.sleep(_LOOK_S)


class _Silences:
    """Says once when a recorded stream falls silent, and once when it is back. A file's silences are its own."""

    def __init__(self, streams: Sequence[Receiver]) -> None:
        self._live = [stream for stream in streams if not stream.device_class.has_end]
        self._silent: set[str] = set()
        self._said: set[str] = set()

    def look(self, take: RecordingNumbers) -> None:
        """At each stream of a live device."""
        before = self._silent
        self._silent = {key for key, of in take.streams.items() if of.silent_s >= LONG_SILENCE_S}
        for stream in self._live:
            for key in (key for key in take.streams if key.startswith(f"{stream.key}/")):
                if key in self._said and key not in self._silent:
                    self._said.discard(key)
                    say(f"phalanx: {key} ({stream.title}): is back.")
                # Twice in a row: where this process stood still, what came meanwhile is read first. What has failed
                # for good says so itself.
                elif key in self._silent & before - self._said and stream.active:
                    self._said.add(key)
                    health = stream.stream_health(key)
                    why = f" {health.reason}" if health.level is not Level.GOOD else ""
                    silent_s = take.streams[key].silent_s
                    say(f"phalanx: {key} ({stream.title}): no frame has come for {silent_s:.1f} s.{why}")


def _record(session: Session, streams: Sequence[Receiver], seconds: float | None, stopped: Event) -> None:
    """Returns when the time is over, the files are played, the disk failed, or somebody ends it."""
    progress, silences = Progress("Recording"), _Silences(streams)
    while not stopped.is_set() and _goes_on(streams):
        numbers = session.numbers()
        take = numbers.recording
        if take is None or _nothing_comes(take, streams):
            break
        if seconds is not None and take.elapsed_s >= seconds:
            break
        silences.look(take)
        received = sum(one.received for one in take.streams.values())
        dropped = sum(one.dropped_total for one in take.streams.values())
        trouble = f"{take.trouble}. " if take.trouble else ""
        progress.show(
            f"{trouble}{take.elapsed_s:6.1f} s, {received:,} frames, {take.bytes_written / 1e6:.1f} MB, "
            f"{dropped:,} dropped, solver {numbers.solver.rate_hz:.0f} Hz"
        )
        left = _LOOK_S if seconds is None else min(_LOOK_S, max(seconds - take.elapsed_s, 0.0))
        time.sleep(left)
    progress.done()


def _goes_on(streams: Sequence[Receiver]) -> bool:
    """Whether more may come: of files, if there are any, for what is live has no end."""
    files = [stream for stream in streams if stream.device_class.has_end]
    return any(stream.active for stream in files or streams)


def _nothing_comes(take: RecordingNumbers, streams: Sequence[Receiver]) -> Receiver | None:
    """A device that has failed for good before anything came: a file that cannot be played does not come back."""
    if any(one.received for one in take.streams.values()):
        return None
    return next(
        (
            stream
            for stream in streams
            if stream.health().level is Level.PROBLEM and (stream.device_class.has_end or not stream.active)
        ),
        None,
    )


def _never_began(session: Session, streams: Sequence[Receiver]) -> None:
    """Raises a device's own error if it failed before anything was sent."""
    take = session.numbers().recording
    failed = _nothing_comes(take, streams) if take is not None else None
    if failed is not None:
        raise DeviceError(f"{failed.title} sent no frame.", failed.health().reason)


def _finish(session: Session, finished: Future[TakeSummary], again: Event) -> TakeSummary:
    """Ends the take if nothing else has, and waits until it is sealed; a second Ctrl+C, or a disk that does not answer
    for long, ends that wait, and the summary says what is on the disk."""
    progress, told = Progress("Sealing"), False
    with suppress(TakeError):
        session.stop_recording()
    while not finished.done() and not again.is_set():
        for take in session.numbers().sealing:
            progress(take.part)
            if take.stalled_s and not told:
                told = True
                say(f"phalanx: The disk has not answered for {take.stalled_s:.0f} s. Ctrl+C ends without it.")
            if take.stalled_s > SEAL_S:
                session.give_up_finishing()
        wait([finished], _LOOK_S)
    wait([finished], _AT_ONCE_S)  # a disk that answers needs no longer
    session.give_up_finishing()
    progress.done()
    return finished.result()


def _report(summary: TakeSummary, streams: Sequence[Receiver]) -> Result:
    tell(f"{printable(summary.path)}: {summary.duration_s:.1f} s, {summary.line}")
    figures = {
        "take": summary.path,
        "duration_s": summary.duration_s,
        **_figures(summary),
        "verdict": verdict_figures(summary.verdict),
        "solved": summary.solved,
        "unsolved": summary.unsolved,
        "bytes": summary.bytes,
        "sealed": summary.sealed,
        "device": _titles(streams),
        "warnings": [text for stream in streams for text in stream.device.warnings],
        "solving": summary.solving,
        "streams": {key: _figures(one) for key, one in summary.streams.items()},
    }
    return Result(status_of(summary.verdict), figures, stands=True)


def _figures(of: TakeSummary | StreamFigures) -> dict[str, Any]:
    """Of the stream that is solved, or of any."""
    return {
        "received": of.received,
        "written": of.written,
        "dropped": of.dropped,
        "lost": of.lost,
        "late": of.late,
        "repeated": of.repeated,
        "rejected": of.rejected,
        "untimed": of.untimed,
        "standstills": of.standstills,
        "holes": of.holes,
    }
