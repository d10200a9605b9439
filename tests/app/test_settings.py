"""The settings file in every state that a disk, an editor or another program leaves it in."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication

from app import settings as names
from app import theme
from app.application import remembered_others, remembered_profile
from app.main_window import MainWindow
from app.notifications import NotificationCentre
from app.session import Session
from app.settings import Settings
from app.worker import SessionWorker
from core.profile import load_profile
from tests.data import ROOT

PROFILE = load_profile("han19").to_dict()


def spoilt(path: Path, how: str) -> None:
    if how == "folder":
        path.mkdir()
        (path / "inside").write_text("kept")
    elif how == "pipe":
        os.mkfifo(path)
    else:
        path.write_bytes(SPOILT[how])


SPOILT = {
    "brackets": b"[" * 200_000,
    "not text": b"\xff\xfe\x00\x01" * 100,
    "cut": json.dumps({"profile": "han19"}).encode()[:-3],
    "a list": b"[1, 2]",
    "NaN": b'{"window/geometry": NaN}',
    "digits": b'{"takes/number": ' + b"9" * 5000 + b"}",
    "large": b" " * (5 << 20),
    "empty": b"",
    "zeros": bytes(4096),
}


ON_DISK = ["folder", "pipe"] if hasattr(os, "mkfifo") else ["folder"]


@pytest.mark.parametrize("how", [*SPOILT, *ON_DISK])
def test_a_file_that_cannot_be_read_is_set_aside_and_said(tmp_path: Path, how: str) -> None:
    path = tmp_path / "settings.json"
    aside = tmp_path / "settings.unreadable.json"
    aside.write_text("an earlier one")
    spoilt(path, how)
    told: list[tuple[str, str]] = []
    settings = Settings(path)
    settings.tell_with(lambda *words: told.append(words))
    ((what, action),) = told
    assert str(path) in what and "started with its defaults" in what and len(what) < 500
    assert action == "It is kept as settings.unreadable-2.json beside it."
    assert aside.read_text() == "an earlier one" and not path.exists()
    assert settings.get(names.PROFILE, "han19") == "han19"
    settings.set(names.PROFILE, "qualisys13")
    assert Settings(path).get(names.PROFILE, "") == "qualisys13"


def test_a_file_that_cannot_be_set_aside_is_not_written_over(tmp_path: Path) -> None:
    path = tmp_path / "settings.json"
    path.write_text("{")
    for number in range(1, 100):
        (tmp_path / f"settings.unreadable{f'-{number}' if number > 1 else ''}.json").touch()
    told: list[tuple[str, str]] = []
    settings = Settings(path)
    settings.tell_with(lambda *words: told.append(words))
    assert "It stays where it is, and nothing will be remembered" in told[0][1]
    settings.set(names.PROFILE, "qualisys13")
    assert settings.get(names.PROFILE, "") == "qualisys13"
    assert path.read_text() == "{"


def test_without_a_file_there_is_nothing_to_say(tmp_path: Path) -> None:
    told: list[object] = []
    Settings(tmp_path / "none" / "settings.json").tell_with(lambda *words: told.append(words))
    assert not told


def test_what_cannot_be_written_is_said_once(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    told: list[tuple[str, str]] = []
    settings = Settings(tmp_path / "file" / "settings.json")
    settings.tell_with(lambda *words: told.append(words))
    settings.set("a", 1)
    settings.set("b", 2)
    assert any("cannot be written" in what for what, _ in told)
    assert sum("cannot be written" in what for what, _ in told) == 1
    assert settings.get("b", 0) == 2


def test_single_values_of_another_kind_are_the_default(tmp_path: Path) -> None:
    path = tmp_path / "settings.json"
    path.write_text(
        json.dumps({"text": "a\0b", "long": "x" * 200_000, "whole": 2**40, "switch": 1, "number": True, "real": 3})
    )
    settings = Settings(path)
    assert settings.get("text", "d") == "d" and settings.get("long", "d") == "d"
    assert settings.get("whole", 5) == 5 and settings.get("number", 5) == 5
    assert settings.get("switch", False) is False
    assert settings.get("real", 1.5) == 3.0


def test_what_no_file_can_hold_is_not_remembered_and_spoils_nothing(tmp_path: Path) -> None:
    path = tmp_path / "settings.json"
    settings = Settings(path)
    settings.set("before", 1)
    for value in ("/takes/\udcff", float("nan"), Path("/takes")):
        settings.set(names.TAKE_FOLDER, value)
    settings.set("after", 2)
    again = Settings(path)
    assert (again.get("before", 0), again.get("after", 0), again.get(names.TAKE_FOLDER, "")) == (1, 2, "")


KEYS = {
    value for name, value in vars(names).items() if name.isupper() and isinstance(value, str) and name != "VIEW"
} | {"view/skeleton", "view/marker_names", "export/formats", "export/rate", "training/minutes", "training/threads"}
ODD: list[object] = [
    None, True, 2**62, "\0", "x" * 5000, "/dev/zero", "{take}" * 100, [None, 1, {}], PROFILE | {"scale": 1e308},
    [PROFILE] * 50,
    [
        {"kind": [], "settings": {}},
        {"kind": "natnet", "settings": {"command_port": "no", "what": []}},
        {"kind": "playback", "settings": {"file": "/dev/zero", "speed": -1}},
    ] * 20,
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(ODD)))
def test_the_window_opens_whatever_a_value_is(qtbot, tmp_path: Path, number: int) -> None:
    path = tmp_path / "settings.json"
    path.write_text(json.dumps(dict.fromkeys(sorted(KEYS), ODD[number])))
    settings, notifications = Settings(path), NotificationCentre()
    cast = (remembered_profile(settings, False, notifications), *remembered_others(settings, notifications))
    theme.apply(QApplication.instance())
    window = MainWindow(SessionWorker(Session(cast, notifications=notifications), 30), settings)
    qtbot.addWidget(window)
    try:
        window.show()
        qtbot.waitExposed(window)
        assert window.isVisible() and window.width() > 400
    finally:
        window.stop_and_close()


@pytest.mark.parametrize("how", ["brackets", "folder"])
def test_the_application_starts_and_says_what_became_of_its_settings(tmp_path: Path, how: str) -> None:
    """All of it, in a process of its own with a configuration folder of its own."""
    folder = tmp_path / "phalanx"
    folder.mkdir()
    spoilt(folder / "settings.json", how)
    code = (
        "import sys, app.application as a\n"
        "from app.settings import Settings, default_path\n"
        "running = a.start(Settings(default_path()))\n"
        "running.application.processEvents()\n"
        "assert running.window.isVisible()\n"
        "print([note.line for note in running.session.notifications.history])\n"
        "running.window.stop_and_close()\n"
    )
    own = dict.fromkeys(("XDG_CONFIG_HOME", "XDG_STATE_HOME"), str(tmp_path))
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env=os.environ | own | {"QT_QPA_PLATFORM": "offscreen"},
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "has started with its defaults. It is kept as settings.unreadable.json beside it." in done.stdout
