"""Two Phalanx beside each other: on one port, in one folder, on one take, with one file of settings."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication

from app import settings as names
from app import theme
from app.main_window import MainWindow
from app.session import Session
from app.settings import Settings
from app.take_plan import TakePlan
from app.worker import SessionWorker
from core.errors import DeviceError, ExportError, TakeError
from core.profile import load_profile
from core.takes.export import export
from core.takes.new_file import put_new
from core.takes.reader import open_take
from core.takes.solution import Solution
from core.takes.take_names import TakeNames
from devices.natnet.client import NatNetDevice
from devices.natnet.simulator import NatNetSimulator
from tests.app.command import phalanx, serving
from tests.app.stage import performance, server, settings_for, until
from tests.app.takes import write_take
from tests.core.export.recordings import solution
from tests.data import ROOT
from tests.devices.natnet.streams import read_while


@pytest.fixture
def window(qtbot, tmp_path: Path) -> Iterator[MainWindow]:
    settings = Settings(None)
    settings.set(names.TAKE_FOLDER, str(tmp_path))
    theme.apply(QApplication.instance())
    session = Session(load_profile("han19"))
    made = MainWindow(SessionWorker(session, 30), settings)
    qtbot.addWidget(made)
    session.start()
    made.show()
    made.wait = lambda condition, what="": until(condition, what, lambda s: qtbot.wait(max(1, int(1000 * s))))
    yield made
    made.stop_and_close()


def test_two_servers_on_one_port() -> None:
    with serving("--seconds", "60") as (command_port, _):
        second = phalanx("simulate", "natnet", "--command-port", command_port, "--data-port", 0, "--seconds", 1)
    assert second.code == 1
    assert f"Port {command_port} of 127.0.0.1 cannot be taken" in second.err
    assert "choose another port" in second.err


def test_two_clients_of_one_server_both_hear_all() -> None:
    """Unicast to two ports of one machine, and multicast to one port that both share."""
    for multicast in (False, True):
        frames = performance()[:200]
        with NatNetSimulator(frames, 400.0, command_port=0, data_port=0, multicast=multicast) as simulator:
            simulator.open()
            devices = [NatNetDevice(**settings_for(simulator)) for _ in range(2)]
            for device in devices:
                device.open()
                device.start()
            simulator.start()
            heard: list[list[int]] = [[], []]

            def listen(k: int, devices=devices, heard=heard, simulator=simulator) -> None:
                heard[k] = [frame.sequence for frame in read_while(devices[k], lambda: not simulator.finished)]

            threads = [threading.Thread(target=listen, args=(k,)) for k in range(2)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join(60.0)
            for device in devices:
                device.close()
        assert heard[0] == heard[1] == [frame.sequence for frame in frames], f"{multicast=}"


def test_a_port_that_another_program_holds_alone() -> None:
    import socket

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("", 0))
        port = other.getsockname()[1]
        with NatNetSimulator(performance()[:10], 100.0, command_port=0, data_port=0) as simulator:
            simulator.open()
            wanted = settings_for(simulator) | {"data_port": port, "transmission": "multicast"}
            with pytest.raises(DeviceError, match=f"data port {port} is in use by another program"):
                NatNetDevice(**wanted).open()


def test_a_window_takes_the_next_name_when_another_was_faster(window: MainWindow, qtbot, tmp_path: Path) -> None:
    """The other makes its file between the choice of the name and that of the file, twice."""
    with server() as simulator:
        stream = window.worker.add_device(NatNetDevice, settings_for(simulator))
        window.worker.connect_device(stream)
        window.wait(lambda: stream.health().received > 0 and window.record_action.isEnabled(), "frames")
        finished = []
        window.worker.take_finished.connect(finished.append)
        name, path = window.plan.next()
        choose, others = window.plan.next, []

        def too_late() -> tuple[str, Path]:
            chosen = choose()
            if len(others) < 2:
                chosen[1].write_bytes(b"of another")
                others.append(chosen[1])
            return chosen

        window.plan.next = too_late
        window.record_action.trigger()
        window.wait(lambda: window.worker.session.recording, "a take")
        third = window.worker.session.recording_name
        window.wait(lambda: (r := window.worker.session.numbers().recording) and r.received > 10, "frames")
        window.record_action.trigger()
        window.wait(lambda: finished, "the end")
    assert [other.read_bytes() for other in others] == [b"of another"] * 2
    assert others[0] == path and third not in (name, others[1].stem)
    with open_take(tmp_path / f"{third}.mcap") as take:
        assert take.info.name == third and len(take.raw) == finished[0].written > 10


def test_two_recorders_into_one_file(tmp_path: Path) -> None:
    """One has it, the other says so; what is there stays."""
    path = write_take(tmp_path, "take")
    before = path.read_bytes()
    ran = phalanx("record", "natnet", "--server", "127.0.0.1", "--out", path)
    assert ran.code == 1 and "exists already" in ran.err
    assert path.read_bytes() == before


def test_names_chosen_at_once_never_name_one_file(tmp_path: Path) -> None:
    """Processes that take the next free name at the same moment: each makes a file of its own."""
    script = (
        "import sys\nfrom datetime import datetime\nfrom pathlib import Path\n"
        "from core.errors import TakeError\nfrom core.profile import load_profile\n"
        "from core.takes.take import TakeInfo\nfrom core.takes.take_names import TakeNames\n"
        "from core.takes.writer import TakeWriter\n"
        "profile, made = load_profile('han19'), 0\nsys.stdin.readline()\n"
        "while made < 20:\n    path = TakeNames('{take}').next_path(sys.argv[1], datetime.now())\n"
        "    try:\n        TakeWriter(path, TakeInfo(sys.argv[2]), profile).close(); made += 1\n"
        "    except TakeError as error:\n        assert 'exists already' in str(error), error\n"
    )
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", script, str(tmp_path), str(k)], cwd=ROOT, stdin=subprocess.PIPE, text=True
        )
        for k in range(3)
    ]
    for process in processes:
        process.communicate("\n", timeout=120)
        assert process.returncode == 0
    owners = []
    for path in sorted(tmp_path.iterdir()):
        with open_take(path) as take:
            owners.append(take.info.name)
    assert sorted(owners) == ["0"] * 20 + ["1"] * 20 + ["2"] * 20
    assert TakeNames("{take}").next_take(tmp_path, datetime.now()) == 61


def test_a_take_that_is_recorded_is_read_by_the_other_and_sealed_by_none(tmp_path: Path) -> None:
    with serving("--seconds", "120") as (command_port, data_port):
        recorder = subprocess.Popen(
            [sys.executable, "-m", "app", "record", "natnet", "--server", "127.0.0.1", "--command-port",
             str(command_port), "--data-port", str(data_port), "--out", str(tmp_path / "take"), "--json"],
            cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        try:
            path = tmp_path / "take.mcap"
            until(lambda: path.exists() and path.stat().st_size > 300_000, "frames in the take")
            info, recover = phalanx("info", path), phalanx("recover", path)
            assert "its recording is still running" in info.out
            assert recover.code == 1 and "is being recorded or sealed" in recover.err
            assert "Wait until that is done." in recover.err
        finally:
            recorder.terminate()
            out, err = recorder.communicate(timeout=120)
    figures = json.loads(out.splitlines()[-1])
    assert figures["sealed"], err
    with open_take(path) as take:
        assert take.complete and len(take.raw) == figures["written"]
    assert [one.name for one in tmp_path.iterdir()] == ["take.mcap"]


def test_two_exports_into_one_folder_at_once(tmp_path: Path) -> None:
    """Each file is whole and of one of them; the other says what is there already."""
    one, two = solution(n_frames=40, name="take"), replace(solution(n_frames=30, name="take"))
    errors: list[ExportError] = []
    barrier = threading.Barrier(2)

    def write(each: Solution) -> None:
        barrier.wait()
        try:
            export(each, ["csv", "trc"], tmp_path)
        except ExportError as error:
            errors.append(error)

    threads = [threading.Thread(target=write, args=(each,)) for each in (one, two)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors and all("exists already" in str(error) for error in errors), errors  # each may be first at one
    assert "--overwrite" in str(errors[0])
    assert not [path for path in tmp_path.iterdir() if path.is_dir()]
    (table,) = tmp_path.glob("*.trc")
    rows = table.read_text().splitlines()
    assert len(rows) - 6 in (30, 40) and rows[2].split("\t")[2] == str(len(rows) - 6)


def test_an_export_replaces_nothing_that_came_while_it_was_written(tmp_path: Path) -> None:
    def other(share: float, text: str) -> None:
        if text.startswith("Reading back"):
            (tmp_path / "joints.csv").write_text("of another")

    with pytest.raises(ExportError, match=r"joints\.csv exists already"):
        export(solution(n_frames=10), ["csv"], tmp_path, other)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"joints.csv": "of another"}, "all or none"


def test_a_new_file_never_takes_the_place_of_another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for links in (True, False):  # and on a file system that has none
        if not links:
            monkeypatch.setattr("os.link", _no_links)
        (tmp_path / "draft").write_text("new")
        (tmp_path / "target").write_text("of another")
        with pytest.raises(FileExistsError):
            put_new(tmp_path / "draft", tmp_path / "target")
        assert (tmp_path / "target").read_text() == "of another"
        (tmp_path / "target").unlink()
        put_new(tmp_path / "draft", tmp_path / "target")
        assert (tmp_path / "target").read_text() == "new"
        assert [path.name for path in tmp_path.iterdir()] == ["target"]


def _no_links(*_: object) -> None:
    raise OSError(95, "Operation not supported")


def test_settings_of_two_windows(tmp_path: Path) -> None:
    """What one remembers stays when the other does; of the same thing the last word counts. Never half a file."""
    path = tmp_path / "settings.json"
    Settings(path).set("common", "before")
    one, two = Settings(path), Settings(path)
    one.set(names.TAKE_FOLDER, "/takes/one")
    two.set(names.TAKE_TEMPLATE, "{take}")
    two.set("common", "two")
    one.set(names.SHOT, "wave")
    again = Settings(path)
    assert again.get(names.TAKE_FOLDER, "") == "/takes/one"
    assert again.get(names.TAKE_TEMPLATE, "") == "{take}"
    assert again.get(names.SHOT, "") == "wave"
    assert again.get("common", "") == "two"
    one.forget(names.SHOT)
    two.set("other", 1)
    assert Settings(path).get(names.SHOT, "gone") == "gone"
    assert [each.name for each in tmp_path.iterdir()] == ["settings.json"]


def test_a_folder_that_goes_and_comes_back(window: MainWindow, qtbot, tmp_path: Path) -> None:
    """A network folder in mid-session: the list, the plan, Record and an export say so, and go on when it is back."""
    folder, away = tmp_path / "share" / "takes", tmp_path / "away"
    folder.mkdir(parents=True)
    take = write_take(folder, "first")
    window.plan.set_folder(folder)
    window.show_review(True)
    browser = window._review.browser
    window.wait(lambda: browser.table.rowCount() == 1, "the list")
    (folder.parent).rename(away)
    browser.refresh()
    assert "is not there. Connect its disk, or choose another one." in browser._empty.text()
    assert browser.table.rowCount() == 0
    with pytest.raises(TakeError, match=r"is not there\. Connect its disk or network folder"):
        window.plan.next()
    assert "is not there" in window.plan.preview()[1]
    with pytest.raises(ExportError, match=r"Check its free space|failed"):
        (tmp_path / "share").write_text("no folder")
        export(solution(n_frames=10), ["csv"], folder)
    (tmp_path / "share").unlink()
    said = phalanx("info", take)
    assert said.code == 1 and "There is no take" in said.err
    away.rename(folder.parent)
    browser.refresh()
    window.wait(lambda: browser.table.rowCount() == 1, "the list again")
    assert not browser._empty.text()
    _, path = window.plan.next()
    assert path.parent == folder and not path.exists()
    shutil.rmtree(folder.parent)


def test_takes_do_not_go_under_a_disk_that_was_unmounted(tmp_path: Path) -> None:
    """`umount -l` in mid-session leaves its empty folder behind: nothing is recorded there, until it is back or the
    folder is chosen again."""
    share = tmp_path / "share"
    share.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=4m", "none", str(share)]
    for folder in (share, share / "takes"):
        if subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=4m", "none", str(share)], capture_output=True
        ).returncode:
            pytest.skip("a disk can be mounted by root only")
        try:
            folder.mkdir(exist_ok=True)
            (folder / "shot_001.mcap").write_bytes(b"a take")
            settings = Settings(None)
            settings.set(names.TAKE_FOLDER, str(folder))
            plan = TakePlan(settings)
            plan.set_template("{shot}_{take:03}")
            assert plan.next()[0] == "shot_002"
        finally:
            subprocess.run(["umount", "-l", str(share)], check=True)
        with pytest.raises(TakeError, match=r"is not there\. Connect its disk"):
            plan.next()
        subprocess.run(mount, check=True)
        try:
            folder.mkdir(exist_ok=True)
            (folder / "shot_001.mcap").write_bytes(b"a take")
            assert plan.next()[0] == "shot_002", "it is back, on whatever disk it is now"
        finally:
            subprocess.run(["umount", "-l", str(share)], check=True)
        plan.set_folder(folder)
        assert plan.next()[0] == "shot_001", "chosen by hand it is meant"
    assert not list(share.iterdir())
