"""`phalanx record` as an operator runs it, when its disk fills or hangs, its file is taken away, its device fails."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from core.takes.reader import open_take
from tests.app.command import Ran, phalanx
from tests.app.stage import server, until
from tests.data import ROOT

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="sends signals, and takes open files away")


class Recording:
    """The command while it runs, and what it has said so far."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.said = ""
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.said += line

    def says(self, words: str) -> None:
        until(lambda: words in self.said or self.process.poll() is not None, words)
        assert words in self.said, self.said

    def interrupt(self) -> None:
        self.process.send_signal(signal.SIGINT)

    def ended(self, within_s: float = 60.0) -> Ran:
        out = self.process.stdout.read() if self.process.stdout is not None else ""
        self.process.wait(within_s)
        self._reader.join(10)
        assert "Traceback" not in self.said, self.said
        return Ran(self.process.returncode, out, self.said)


@contextmanager
def recording(out: Path, *words: object, on: tuple[object, ...] = ("app",), home: Path) -> Iterator[Recording]:
    """`phalanx record` of the performer on a real server. on: the module to run. home: where its data folder lies."""
    with server() as simulator:
        command = [
            sys.executable, "-m", *on, "record", "natnet", "--server", "127.0.0.1", "--local", "127.0.0.1",
            "--command-port", simulator.command_port, "--data-port", simulator.data_port, "--out", out, "--json",
            *words,
        ]  # fmt: skip
        environment = {**os.environ, "XDG_DATA_HOME": str(home)}
        process = subprocess.Popen(
            [*map(str, command)], cwd=ROOT, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, env=environment,
        )  # fmt: skip
        try:
            yield Recording(process)
        finally:
            process.kill()
            process.wait()


@contextmanager
def hanging(path: Path, folder: Path) -> Iterator[Recording]:
    """A recording into `path` that has said that its disk hangs. folder: for what belongs to it."""
    trigger = folder / "hang"
    with recording(path, on=("tests.hanging_disk", trigger), home=folder) as command:
        command.says("Recording a.mcap")
        until(lambda: path.stat().st_size > 100_000, "frames")
        trigger.touch()
        command.says("has not answered for")
        yield command


def figures_balance(ran: Ran) -> dict:
    figures = ran.figures
    assert figures["received"] == figures["written"] + sum(figures["dropped"].values())
    return figures


def test_a_deleted_take_is_told_and_rescued(tmp_path: Path) -> None:
    path = tmp_path / "takes" / "a.mcap"
    with recording(path, home=tmp_path) as command:
        command.says("Recording a.mcap")
        until(lambda: path.stat().st_size > 100_000, "frames")
        path.unlink()
        command.says("was deleted")
        rescued = path.with_name("a_rescued.mcap")
        command.says(f"recorded on in {rescued}")
        command.interrupt()
        ran = command.ended()
    assert ran.code == 3 and str(rescued) in ran.err
    said_once(ran)
    figures = figures_balance(ran)
    assert figures["take"] == str(rescued) and figures["sealed"] and not figures["dropped"]
    with open_take(rescued) as take:
        assert take.sealed and take.complete and len(take.raw) == figures["written"] == figures["received"]


def said_once(ran: Ran) -> None:
    """No sentence comes twice."""
    sentences = [part.strip() for line in ran.err.splitlines() for part in re.split(r"(?<=[a-z][.:]) ", line)]
    told = [text for text in sentences if len(text) > 20]
    assert len(told) == len(set(told)), ran.err


def test_a_take_that_is_cut_short_where_it_lies_is_told_at_once_and_recorded_on(tmp_path: Path) -> None:
    """What another program cut off its end is gone: the operator records again, now and not after the take. What comes
    after it is not lost."""
    path = tmp_path / "takes" / "a.mcap"
    with recording(path, home=tmp_path) as command:
        command.says("Recording a.mcap")
        until(lambda: path.stat().st_size > 100_000, "frames")
        os.truncate(path, 4096)
        command.says("was cut short or written into")
        command.says("record it again")
        rescued = path.with_name("a_rescued.mcap")
        command.says(f"recorded on in {rescued}")
        until(lambda: rescued.stat().st_size > 100_000, "frames that come after it")
        command.interrupt()
        ran = command.ended()
    figures = figures_balance(ran)
    assert ran.code == 3 and figures["sealed"] and figures["dropped"]["damaged file"] > 0
    assert figures["take"] == str(rescued) and str(rescued) in ran.err
    assert "once there is room" not in ran.err and "Check in Devices" not in ran.err
    said_once(ran)
    with open_take(rescued) as take:
        assert take.sealed and take.complete and len(take.raw) == figures["written"] > 0
    for command in ("info", "verify"):
        told = phalanx(command, rescued, "--json")
        assert told.code == 3 and told.figures["verdict"]["level"] == "problem"


def test_a_take_whose_folder_is_gone_goes_to_the_data_folder(tmp_path: Path) -> None:
    path = tmp_path / "takes" / "a.mcap"
    with recording(path, "--seconds", 6, home=tmp_path / "home") as command:
        command.says("Recording a.mcap")
        until(lambda: path.stat().st_size > 100_000, "frames")
        path.unlink()
        path.parent.rmdir()
        ran = command.ended()
    figures = figures_balance(ran)
    assert ran.code == 3 and figures["sealed"] and not figures["dropped"]
    take_path = Path(figures["take"])
    assert tmp_path / "home" in take_path.parents and str(take_path) in ran.err
    with open_take(take_path) as take:
        assert take.complete and len(take.raw) == figures["written"]


def test_a_disk_that_hangs_is_told_and_the_command_ends_without_it(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with hanging(path, tmp_path) as command:
        command.interrupt()
        command.says("Ctrl+C ends without it")
        assert command.process.poll() is None
        time.sleep(0.5)  # no hand presses twice at once; what comes so is one Ctrl+C told twice
        command.interrupt()
        begun = time.monotonic()
        ran = command.ended()
    assert time.monotonic() - begun < 40.0
    figures = figures_balance(ran)
    assert ran.code == 3 and not figures["sealed"] and figures["dropped"]["disk did not answer"] > 0
    with open_take(path) as take:
        assert len(take.raw) == figures["written"] > 0
    assert f"{figures['written']:,} frames are in {path}" in ran.err


def test_a_third_ctrl_c_ends_where_a_disk_hangs_and_says_how_to_recover_the_take(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with hanging(path, tmp_path) as command:
        for _ in range(3):
            command.interrupt()
            time.sleep(0.3)
        ran = command.ended()
    assert ran.code == 130 and "Ended at once by a third Ctrl+C." in ran.err
    assert f"`phalanx recover {path}`" in ran.err
    assert phalanx("recover", path).code in (0, 3)


@contextmanager
def small_disk(folder: Path, size: str) -> Iterator[Path]:
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    if sys.platform != "linux" or subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("needs the right to mount a small disk")
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def test_a_full_disk_is_not_called_saved_and_the_status_is_that_of_what_happened(tmp_path: Path) -> None:
    """The disk fills from elsewhere, so that there is no room to seal either."""
    with small_disk(tmp_path / "disk", "3m") as folder:
        path = folder / "a.mcap"
        with recording(path, on=("tests.small_reserve", 0), home=tmp_path) as command:
            command.says("Recording a.mcap")
            until(lambda: path.stat().st_size > 100_000, "frames")
            with (folder / "other").open("wb", buffering=0) as other, pytest.raises(OSError, match="No space"):
                while True:
                    other.write(bytes(4096))
            ran = command.ended()
        figures = figures_balance(ran)
        assert ran.code == 3 and not figures["sealed"]
        said_once(ran)
        for command in ("info", "verify"):  # by the same rule as of its recording
            assert phalanx(command, path).code == 3
        with open_take(path) as take:
            assert len(take.raw) == figures["written"] > 0
        assert "saved" not in ran.err and "can be read" in ran.err
        assert sorted(os.listdir(folder)) == ["a.mcap", "other"]  # noqa: PTH208


def test_a_disk_that_is_nearly_full_ends_a_whole_take(tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk", "3m") as folder:
        path = folder / "a.mcap"
        with recording(path, on=("tests.small_reserve", 1_500_000), home=tmp_path) as command:
            command.says("is nearly full")
            ran = command.ended()
        figures = figures_balance(ran)
        assert ran.code == 3 and figures["sealed"] and not figures["dropped"]
        ended, saved = ran.err.index("is nearly full"), ran.err.index("is saved")
        assert ended < saved and "saved" not in ran.err[:saved]
        with open_take(path) as take:
            assert take.sealed and take.complete and len(take.raw) == figures["written"] > 0
        assert json.loads(ran.out.splitlines()[-1])["verdict"]["level"] == "warning"


FAILS_AT_ONCE = """
import sys
from core.errors import DeviceError
from app.file_device import FileDevice

def start(device):
    raise DeviceError("The cameras went to sleep.", "Wake them.")

FileDevice.start = start
from app.cli import main
sys.exit(main(sys.argv[1:]))
"""


def test_a_device_that_fails_at_the_start_leaves_no_take_that_blocks_its_name(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    source = tmp_path / "points.csv"
    rows = [f"{i},{i / 120:.4f},{j},0.{j},1.0,0.5" for i in range(240) for j in range(3)]
    source.write_text("frame,time_s,id,x_m,y_m,z_m\n" + "\n".join(rows) + "\n")
    words = ["record", "playback", "--file", str(source), "--out", str(path)]
    done = subprocess.run(
        [sys.executable, "-c", FAILS_AT_ONCE, *words],
        cwd=ROOT, capture_output=True, text=True, timeout=240, check=False,
    )  # fmt: skip
    assert done.returncode == 1 and "The cameras went to sleep." in done.stderr and "Traceback" not in done.stderr
    assert not path.exists()
    again = subprocess.run(
        [sys.executable, "-m", "app", *words], cwd=ROOT, capture_output=True, text=True, timeout=240, check=False
    )
    assert again.returncode in (0, 3), again.stderr
    with open_take(path) as take:
        assert take.sealed and len(take.raw) == 240
