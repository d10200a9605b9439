"""What killed and broken processes leave: told at the next start, recovered and cleared, never of one that lives."""

from __future__ import annotations

import errno
import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from PySide6.QtWidgets import QLabel

from app import settings as names
from app.left_behind.cut_takes import cut_takes, restore
from app.left_behind.found import look
from app.left_behind.leftovers import Leftover, clear, leftovers
from app.left_behind.run_file import REPORT, RunFile, ended_runs, recorded_now, report_of, settle
from core.profile import load_profile
from core.takes.drafts import EXPORT, IMPORT, SOLVED, Draft
from core.takes.reader import open_take
from core.takes.take import TakeInfo
from core.takes.writer import TakeWriter
from tests.app.command import phalanx
from tests.app.takes import write_take
from tests.data import ROOT

OLD = (0, 0)


@pytest.fixture(autouse=True)
def own_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Log, settings and temporary files of this test alone, for the processes that it begins, too."""
    for variable in ("XDG_STATE_HOME", "XDG_CONFIG_HOME", "TMPDIR"):
        (tmp_path / variable).mkdir()
        monkeypatch.setenv(variable, str(tmp_path / variable))
    monkeypatch.setattr(tempfile, "tempdir", None)


@pytest.fixture
def takes(tmp_path: Path) -> Path:
    folder = tmp_path / "takes"
    folder.mkdir()
    config = tmp_path / "XDG_CONFIG_HOME" / "phalanx"
    config.mkdir()
    (config / "settings.json").write_text(json.dumps({names.TAKE_FOLDER: str(folder)}))
    return folder


def run(code: str) -> subprocess.Popen[str]:
    """Python in a process of its own, that has said that it is under way."""
    process = subprocess.Popen(
        [sys.executable, "-c", code], cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    assert process.stdout.readline() == "begun\n", process.stderr.read()
    return process


def killed(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.communicate()


RECORDING = """
import ctypes, sys
from pathlib import Path
from app.left_behind.run_file import RunFile
from core.takes.take import TakeInfo
from core.takes.writer import TakeWriter
from core.profile import load_profile
from tests.core.takes.frames import plain_frame
with RunFile("phalanx record") as file:
    take = Path({take!r})
    file.recording(take)
    writer = TakeWriter(take, TakeInfo(take.stem), load_profile("han19"))
    writer.raw("", plain_frame(0))
    print("begun", flush=True)
    if sys.stdin.readline() == "crash\\n":
        ctypes.string_at(0)
"""


def test_a_fault_leaves_a_report_and_names_the_take_that_was_cut(takes: Path) -> None:
    take = takes / "take.mcap"
    process = run(RECORDING.format(take=str(take)))
    assert recorded_now() == {take} and ended_runs() == []
    assert look(takes).takes == ()  # it is being recorded: a process that lives was not cut off
    process.communicate("crash\n")
    assert process.returncode == -signal.SIGSEGV
    _age()
    (fault,) = look(takes).faults
    assert fault.fault == "Segmentation fault" and fault.what == "phalanx record" and fault.takes == (take,)
    assert "string_at" in fault.path.read_text()
    assert [cut.path for cut in look(takes).takes] == [take]
    settle(fault)
    found = look(takes)
    assert found.faults == () and [cut.path for cut in found.takes] == [take]
    assert len(list(fault.path.parent.glob(f"{REPORT}*.txt"))) == 1


def test_a_take_that_a_fault_cut_elsewhere_is_known_until_it_is_whole_or_kept(tmp_path: Path, takes: Path) -> None:
    """Also once its report has been seen; clearing up tells of the report before it counts as told."""
    take = tmp_path / "elsewhere.mcap"
    process = run(RECORDING.format(take=str(take)))
    process.communicate("crash\n")
    _age()
    assert [cut.path for cut in look(takes).takes] == [take]
    ran = phalanx("doctor", "--clear-leftovers")
    assert ran.code == 0 and "phalanx record, begun" in ran.out and "Segmentation fault" in ran.out
    found = look(takes)
    assert found.faults == () and [cut.path for cut in found.takes] == [take]
    (report,) = (tmp_path / "XDG_STATE_HOME").rglob(f"{REPORT}*.txt")
    assert "string_at" in report.read_text()
    assert look(takes, kept=[str(take)]).takes == ()
    assert ended_runs() == [] and report.exists()


def test_a_kill_leaves_no_report_and_the_take_is_found_all_the_same_wherever_it_is(tmp_path: Path, takes: Path) -> None:
    take = tmp_path / "elsewhere.mcap"
    killed(run(RECORDING.format(take=str(take))))
    _age()
    found = look(takes)
    assert found.faults == () and [cut.path for cut in found.takes] == [take]
    assert found.words == "A take was cut off."
    assert look(takes, kept=[str(take)]).takes == ()  # which settles it
    assert ended_runs() == []


def test_a_clean_end_leaves_nothing(tmp_path: Path, takes: Path) -> None:
    process = run(RECORDING.format(take=str(tmp_path / "elsewhere.mcap")))
    process.communicate("\n")
    assert process.returncode == 0
    _age()
    assert not look(takes) and list(_log().iterdir()) == []


def test_a_folder_without_room_for_the_file_is_no_reason_not_to_run(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with RunFile("a test", tmp_path / "file") as file:
        file.recording(tmp_path / "take.mcap")
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [tmp_path / "file"]
    assert not (tmp_path / "file").stat().st_size


def _log() -> Path:
    return Path(os.environ["XDG_STATE_HOME"]) / "phalanx" / "log"


def _age() -> None:
    """Time goes by until the next start."""
    for path in _log().glob("*.txt"):
        os.utime(path, OLD)


def test_only_takes_that_were_cut_off_are_found(takes: Path) -> None:
    write_take(takes, "whole")
    cut = write_take(takes, "cut", seal=False)
    write_take(takes, "mended", seal=False)
    write_take(takes, "mended_recovered")
    (takes / "no take.mcap").write_bytes(b"something else")
    (takes / "empty.mcap").touch()
    assert [one.path.name for one in cut_takes(takes)] in (["cut.mcap"], ["no take.mcap", "cut.mcap"])
    assert cut_takes(takes)[-1].bytes == cut.stat().st_size
    assert all(one.path != cut for one in cut_takes(takes, in_use={cut}))


def test_copies_beside_their_take_are_cleared_and_the_last_one_is_offered(takes: Path) -> None:
    take = write_take(takes, "take", seal=False)
    copy = takes / "take.mcap.sealing"
    copy.write_bytes(take.read_bytes()[:-100])
    (file,) = leftovers(takes)
    assert file.path == copy and file.bytes == copy.stat().st_size and "of take.mcap that was being made" in file.what
    take.unlink()
    os.utime(copy, OLD)
    assert leftovers(takes) == []
    (only,) = cut_takes(takes)
    assert only.only_copy and only.path == copy
    assert restore(only.path) == take
    with open_take(take) as opened:
        assert len(opened.raw) > 0 and not opened.sealed


@pytest.mark.parametrize("content", [b"", b"half", bytes(5000)], ids=["empty", "no take", "zeros"])
def test_a_copy_that_holds_nothing_is_cleared_and_not_offered(takes: Path, content: bytes) -> None:
    copy = takes / "take.mcap.sealing"
    copy.write_bytes(content)
    assert leftovers(takes) == [] and cut_takes(takes) == []  # somebody may be writing it
    os.utime(copy, OLD)
    assert cut_takes(takes) == []
    (file,) = leftovers(takes)
    assert file.path == copy and "holds no frame" in file.what
    assert clear(takes, [file]) == ([file], {}) and not copy.exists()


def test_a_take_that_was_cut_off_before_its_first_frame_is_cleared_and_not_offered(takes: Path) -> None:
    take = takes / "take.mcap"
    TakeWriter(take, TakeInfo("take"), load_profile("han19")).close()
    assert leftovers(takes) == [] and cut_takes(takes) == []  # it may have begun this moment
    os.utime(take, OLD)
    assert cut_takes(takes) == []
    (file,) = leftovers(takes)
    assert file.path == take and "before its first frame" in file.what
    assert clear(takes, [file]) == ([file], {}) and not take.exists()


def test_a_copy_that_was_cut_off_before_its_first_frame_is_cleared(takes: Path) -> None:
    take = write_take(takes, "take", seal=False)
    begin = take.read_bytes()
    take.unlink()
    copy = takes / "take.mcap.sealing"
    copy.write_bytes(begin[:300])
    os.utime(copy, OLD)
    assert cut_takes(takes) == [] and [file.path for file in leftovers(takes)] == [copy]
    copy.write_bytes(begin[:-100])
    os.utime(copy, OLD)
    assert [cut.path for cut in cut_takes(takes)] == [copy] and leftovers(takes) == []


def test_a_copy_of_a_take_that_is_being_sealed_is_in_use(takes: Path) -> None:
    take = write_take(takes, "take", seal=False)
    (takes / "take.mcap.sealing").write_bytes(b"half")
    (takes / "take_recovered.mcap.sealing").write_bytes(b"half")
    holds = "import sys; from pathlib import Path; from core.takes.lock import lock; p = Path({!r}); f = p.open('rb'); "
    holds += "lock(f.fileno(), p); print('begun', flush=True); sys.stdin.read()"
    process = run(holds.format(str(take)))
    assert leftovers(takes) == [] and cut_takes(takes) == []
    killed(process)
    assert [file.path.name for file in leftovers(takes)] == ["take.mcap.sealing"]  # the other is too new to know
    os.utime(takes / "take_recovered.mcap.sealing", OLD)
    assert len(leftovers(takes)) == 2


DRAFTING = """
import sys
from core.takes.drafts import Draft
draft = Draft({prefix!r}, {folder})
(draft.path / "half.csv").write_bytes(b"x" * 1000)
print("begun", flush=True)
sys.stdin.read()
"""


@pytest.mark.parametrize("prefix", [EXPORT + "1-", IMPORT, SOLVED])
def test_drafts_are_left_when_their_process_is_gone(takes: Path, prefix: str) -> None:
    """The number in the name may be that of another process by now: 1 always lives."""
    (takes / "take_exports").mkdir()
    folder = {EXPORT + "1-": takes / "take_exports", IMPORT: takes}.get(prefix)
    process = run(DRAFTING.format(prefix=prefix, folder=repr(str(folder)) if folder else None))
    mine = Draft(prefix, folder)
    assert leftovers(takes) == []
    killed(process)
    (file,) = leftovers(takes)
    assert file.bytes == 1000 and file.path != mine.path
    assert clear(takes, [file, Leftover(mine.path, "", 0)]) == ([file], {})
    assert leftovers(takes) == [] and mine.path.is_dir()  # found or not: it is in use
    mine.close()
    assert not mine.path.exists()


@pytest.fixture
def without_locks(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a network share whose server keeps no locks."""
    fcntl = pytest.importorskip("fcntl", reason="Windows has no such locks")

    def refused(fd: int, how: int) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", refused)


def aged(path: Path) -> None:
    """As if nothing of it had been written for long."""
    for one in (*path.rglob("*"), path):
        os.utime(one, OLD)


@pytest.mark.parametrize("prefix", [EXPORT + "1-", IMPORT, SOLVED])
def test_a_draft_that_cannot_be_locked_is_left_alone_for_a_day(takes: Path, prefix: str, without_locks: None) -> None:
    folder = {EXPORT + "1-": takes, IMPORT: takes}.get(prefix)
    draft = Draft(prefix, folder)
    (draft.path / "half.csv").write_bytes(b"x" * 1000)
    assert leftovers(takes) == [] and clear(takes, [Leftover(draft.path, "", 0)]) == ([], {})
    aged(draft.path)
    (draft.path / "half.csv").write_bytes(b"x" * 2000)  # it is old, and still written
    assert leftovers(takes) == [] and draft.path.is_dir()
    aged(draft.path)
    assert [file.path for file in leftovers(takes)] == [draft.path]
    draft.close()


def test_of_takes_that_cannot_be_locked_none_that_may_be_recorded_is_offered(takes: Path, without_locks: None) -> None:
    """Its run says so on this computer, its age on another."""
    here, elsewhere = takes / "here.mcap", write_take(takes, "elsewhere", seal=False)
    copy = takes / "elsewhere.mcap.sealing"
    copy.write_bytes(b"half")
    process = run(RECORDING.format(take=str(here)))
    found = look(takes)
    assert not found.takes and not found.files and not found.faults
    assert recorded_now() == {here}
    aged(here)  # nothing has come from its device since
    assert not look(takes).takes
    killed(process)
    assert [take.path for take in look(takes).takes] == [here]
    aged(elsewhere)
    aged(copy)
    found = look(takes)
    assert {take.path for take in found.takes} == {here, elsewhere} and [file.path for file in found.files] == [copy]


def test_a_run_of_another_computer_that_cannot_be_locked_lives_for_a_day(takes: Path, without_locks: None) -> None:
    process = run(RECORDING.format(take=str(takes / "take.mcap")))
    process.communicate("crash\n")
    (ended,) = ended_runs()
    assert ended.fault
    ended.path.write_text(ended.path.read_text().replace(f" on {platform.node()}", " on another"))
    assert ended_runs() == [] and recorded_now() == set(ended.takes)
    aged(ended.path)
    assert [run.path for run in ended_runs()] == [ended.path]
    settle(ended)
    assert [run.fault for run in ended_runs()] == [""] and recorded_now() == set()  # told, and the take still known


def test_what_a_helper_process_broke_down_of_is_named(takes: Path) -> None:
    process = run(RECORDING.format(take=str(takes / "take.mcap")))
    process.communicate("crash\n")
    report = report_of(process.pid)
    assert report is not None and "Segmentation fault" in report.read_text()
    os.utime(report, (0, 0))  # not just now
    process = run(RECORDING.format(take=str(takes / "other.mcap")))
    killed(process)
    assert report_of(process.pid) is None
    assert [run.path for run in ended_runs()] == [report]


def test_the_doctor_lists_and_clears(takes: Path) -> None:
    take = write_take(takes, "cut", seal=False)
    copy = takes / "cut.mcap.sealing"
    copy.write_bytes(b"x" * 2000)
    ran = phalanx("doctor", "--json")
    said = {finding["topic"]: finding for finding in ran.figures["findings"]}
    assert str(take) in said["Take cut off"]["text"] and f"phalanx recover '{take}'" in said["Take cut off"]["action"]
    assert f"{copy} (2.0 kB)" in said["Left behind"]["text"] and "--clear-leftovers" in said["Left behind"]["action"]
    ran = phalanx("doctor", "--clear-leftovers", "--json")
    assert ran.code == 0 and ran.figures == {"cleared": [str(copy)], "bytes": 2000, "failed": {}}
    assert take.exists() and not copy.exists()
    assert phalanx("recover", take).code == 0
    findings = phalanx("doctor", "--json").figures["findings"]
    assert [one["level"] for one in findings if one["topic"] in ("Left behind", "Take cut off")] == ["good"]
    shutil.rmtree(takes)
    assert phalanx("doctor", "--clear-leftovers").out == "Nothing to clear.\n"


def desk_at(window, qtbot, takes: Path):
    """The window's desk, once it has looked."""
    window.plan.set_folder(takes)
    window.show()
    desk = window.left_behind
    desk.look()
    qtbot.waitUntil(lambda: desk.dialog is not None and desk.dialog.isVisible(), timeout=30_000)
    return desk


def test_the_window_tells_recovers_and_clears(window, qtbot, takes: Path) -> None:
    take = takes / "take.mcap"
    process = run(RECORDING.format(take=str(takes / "other.mcap")))
    process.communicate("crash\n")
    (takes / "other.mcap").unlink()
    write_take(takes, "take", seal=False)
    (takes / "take.mcap.sealing").write_bytes(b"x" * 2000)
    _age()
    desk = desk_at(window, qtbot, takes)
    assert not desk.dialog.isModal()
    said = [note.line for note in window.worker.notifications.history]
    assert any(
        "A fault ended Phalanx; a take was cut off; 1 file that nobody needs is left (2.0 kB)" in line for line in said
    )
    assert desk.dialog.clear_files.text() == "Clear 2.0 kB"
    desk.dialog.clear_files.click()
    qtbot.waitUntil(lambda: not desk.found.files, timeout=30_000)
    assert [path.name for path in takes.iterdir()] == ["take.mcap"]
    desk.dialog.recover[take].click()
    qtbot.waitUntil(lambda: not desk.found.takes, timeout=30_000)
    with open_take(take) as opened:
        assert opened.sealed and len(opened.raw) == 60
    (fault,) = desk.found.faults
    qtbot.waitUntil(
        lambda: window.strip.message.text().startswith("Still left by earlier runs: A fault ended"), timeout=30_000
    )
    assert window.strip.message.property("level") == ""
    desk.dialog.settled.emit(fault)
    qtbot.waitUntil(lambda: not desk.found, timeout=30_000)
    qtbot.waitUntil(lambda: window.strip.message.text() == "Nothing is left by earlier runs.", timeout=30_000)
    assert window.strip.message.property("level") == ""
    assert len(list(fault.path.parent.glob(f"{REPORT}*.txt"))) == 1


def test_what_is_kept_is_not_told_again(window, qtbot, takes: Path) -> None:
    take = write_take(takes, "take", seal=False)
    desk = desk_at(window, qtbot, takes)
    told = " ".join(label.text() for label in desk.dialog.findChildren(QLabel))
    assert "by a second Ctrl+C" in told and "fault" in told and "power cut" in told  # nobody knows which it was
    desk.dialog.keep_asked.emit([take])
    qtbot.waitUntil(lambda: not desk.found, timeout=30_000)
    assert window.settings.get(names.LEFT_KEPT, []) == [str(take)]
    with open_take(take) as opened:
        assert not opened.sealed
