"""Disks: full, and files that somebody deletes, moves or replaces under a recording."""

from __future__ import annotations

import importlib.util
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from core.takes.take import EXTENSION
from tests.faults.fault import Fault, NotHere, Outcome
from tests.faults.stage import Running, frames_in, plural, served, wrong_sealed

SMALL_DISK_MB = 1200
"""Recording leaves 1 GB to the system, and does not begin without it."""

FEWEST = 120
"""Frames that a take holds before harm is done."""


@contextmanager
def small_disk(folder: Path) -> Iterator[Path]:
    """A disk in memory that can be filled. Raises NotHere."""
    place = folder / "disk"
    place.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={SMALL_DISK_MB}m", "tmpfs", str(place)]
    if shutil.which("mount") is None or subprocess.run(command, capture_output=True, check=False).returncode:
        raise NotHere("only root can make a small disk")
    try:
        yield place
    finally:
        subprocess.run(["umount", "-l", str(place)], capture_output=True, check=False)


def _fill(place: Path) -> None:
    """Another program takes all that is left."""
    block = bytes(1 << 22)
    with (place / "other").open("wb", buffering=0) as file:
        while True:
            try:
                if not file.write(block):
                    return
            except OSError:
                if len(block) == 1:
                    return
                block = bytes(max(len(block) // 8, 1))


def full(tries: int, folder: Path) -> Outcome:
    """Another program fills the disk to its last byte within a moment."""
    outcome, dropped = Outcome(), 0
    for i in range(tries):
        place = folder / f"try{i}"
        place.mkdir()
        with small_disk(place) as disk, served() as server:
            running = record_into(disk, place / "run.mcap", server.command_port)
            try:
                running.recording(FEWEST)
                _fill(disk)
                time.sleep(2.5)
                status = running.end()
            finally:
                running.kill()
            (disk / "other").unlink()
            written = running.figures.get("written", -1)
            dropped += sum(running.figures.get("dropped", {}).values())
            held = frames_in(running.take)
            if status is None:
                outcome.count("it did not end")
            elif status == 0:
                outcome.count("exit status 0")
            else:
                wrong = "" if held == written >= FEWEST else f"{held} frames are in the take, {written} are said to be"
                outcome.count(wrong)
            outcome.said = running.said("disk") or running.said()
    outcome.lost = f"{plural(dropped, 'frame')} that came before the take was ended, counted" if dropped else "nothing"
    return outcome


def _deleted(take: Path) -> None:
    take.unlink()


def _moved(take: Path) -> None:
    target = take.parent / "elsewhere"
    target.mkdir()
    take.rename(target / take.name)


def _replaced(take: Path) -> None:
    other = take.with_suffix(".other")
    other.write_bytes(STRANGER)
    other.replace(take)


def _folder_gone(take: Path) -> None:
    shutil.rmtree(take.parent)


STRANGER = b"not a take, but somebody's file"


def _under(harm: Callable[[Path], None], tries: int, folder: Path) -> Outcome:
    """Records, does harm to the file, goes on, ends; every frame received must be in some take afterwards."""
    outcome, gone = Outcome(), 0
    for i in range(tries):
        place = folder / f"try{i}"
        (place / "takes").mkdir(parents=True)
        with served() as server:
            running = record_into(place / "takes", place / "run.mcap", server.command_port)
            try:
                running.recording(FEWEST)
                harm(running.take)
                time.sleep(2.5)
                running.end()
            finally:
                running.kill()
        lost, wrong = _rescued(running, place)
        gone += lost
        if not wrong and harm is _replaced and running.take.read_bytes() != STRANGER:
            wrong = "the file that took its place was changed"
        outcome.count(wrong)
        outcome.said = outcome.said or _told(running)
    outcome.lost = f"{plural(gone, 'frame')}" if gone else "nothing"
    return outcome


def record_into(folder: Path, words_at: Path, port: int, program: tuple[str, ...] = ("-m", "app", "record")) -> Running:
    """`phalanx record`, whose words do not lie in the folder that is harmed."""
    take = folder / "take.mcap"
    words = [*program, "natnet", "--command-port", str(port), "--out", str(take), "--json"]
    running = Running(words, words_at)
    running.take = take
    return running


def _told(running: Running) -> str:
    lines = [line.removeprefix("phalanx: ") for line in running.err.splitlines() if line.startswith("phalanx: ")]
    return next((line for line in lines if "take" in line.lower()), "")


def _rescued(running: Running, place: Path) -> tuple[int, str]:
    """Frames received that are in no take anywhere, and what is wrong."""
    received = running.figures.get("received", 0)
    found = [path for path in place.rglob(f"*{EXTENSION}") if path.is_file()]
    best = max(found, key=frames_in, default=None)
    held = frames_in(best) if best is not None else 0
    lost = max(received - held, 0)
    if not received:
        return 0, f"it ended with status {running.process.returncode}, without figures: {running.said()[:200]}"
    if lost:
        return lost, f"{lost} of {received} frames are gone; said: {running.said()[:200]}"
    assert best is not None
    return 0, wrong_sealed(best)


def deleted(tries: int, folder: Path) -> Outcome:
    """The file is deleted."""
    return _under(_deleted, tries, folder)


def moved(tries: int, folder: Path) -> Outcome:
    """The file is moved to another folder."""
    return _under(_moved, tries, folder)


def replaced(tries: int, folder: Path) -> Outcome:
    """Another file takes its name."""
    return _under(_replaced, tries, folder)


def folder_gone(tries: int, folder: Path) -> Outcome:
    """The folder is deleted with all in it."""
    return _under(_folder_gone, tries, folder)


def hangs(tries: int, folder: Path) -> Outcome:
    """Writes to the disk do not come back; then the recording is ended, and given up by pressing Ctrl+C again."""
    if importlib.util.find_spec("tests.hanging_disk") is None:
        raise NotHere("there is no disk to hang")
    outcome, dropped = Outcome(), 0
    for i in range(tries):
        place = folder / f"try{i}"
        place.mkdir()
        trigger = place / "hang"
        with served() as server:
            on_it = ("-m", "tests.hanging_disk", str(trigger), "record")
            running = record_into(place, place / "run.mcap", server.command_port, on_it)
            try:
                running.recording(FEWEST)
                trigger.touch()
                time.sleep(5.0)
                before_end = running.err
                held = frames_in(running.take)
                for _ in range(2):
                    with suppress(ProcessLookupError):
                        running.process.send_signal(signal.SIGINT)
                    time.sleep(3.0)
                status = running.end()
            finally:
                running.kill()
        left = max((frames_in(path) for path in place.rglob(f"*{EXTENSION}")), default=0)
        wrong = "it went on for ever" if status is None else ""
        if not wrong and left < held:
            wrong = f"{left} of {held} frames that were on the disk are left"
        outcome.said = outcome.said or next((x for x in before_end.splitlines() if "disk" in x.lower()), "")
        dropped += sum(running.figures.get("dropped", {}).values())
        outcome.count(wrong or ("" if outcome.said else "nothing was said within 5 s"))
    outcome.said = outcome.said.removeprefix("phalanx: ")
    outcome.lost = f"{plural(dropped, 'frame')} that came after it hung, counted" if dropped else "nothing"
    return outcome


FAULTS = (
    Fault("disk-full", "another program fills the disk while a take is recorded", 1, full),
    Fault("disk-hangs", "the disk does not answer any more", 1, hangs),
    Fault("take-deleted", "the file of a take is deleted while it is recorded", 1, deleted),
    Fault("take-moved", "the file of a take is moved while it is recorded", 1, moved),
    Fault("take-replaced", "another file takes its place while it is recorded", 1, replaced),
    Fault("folder-deleted", "the folder of takes is deleted while one is recorded", 1, folder_gone),
)
