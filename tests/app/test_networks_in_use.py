"""Networks that profiles name: loaded once, off the window's thread, and refused in words."""

from __future__ import annotations

import shutil
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import QTimer

from app.application import use_networks
from app.panels.profile_chooser import ProfileChooser
from app.session import Session
from app.undo import UndoStack
from app.worker import SessionWorker
from core.labelling import network as networks
from core.profile import load_profile, save_profile
from tests.app.stage import until
from tests.data import ROOT

HAN19 = load_profile("han19")


class Loads:
    """Every network that is loaded: when it began, on which thread. Each takes half a second longer than it would."""

    def __init__(self) -> None:
        self.threads: list[threading.Thread] = []
        self._session = networks._session

    def __call__(self, content: bytes, source: str, on_trial: bool) -> object:
        if on_trial:
            return self._session(content, source, on_trial)
        self.threads.append(threading.current_thread())
        time.sleep(0.25)  # twice for one network: the encoder of layouts is one itself
        return self._session(content, source, on_trial)


@pytest.fixture
def loads(monkeypatch: pytest.MonkeyPatch) -> Loads:
    networks.shipped_network()
    monkeypatch.setattr(networks, "_loaded", {})
    made = Loads()
    monkeypatch.setattr(networks, "_session", made)
    return made


@pytest.fixture
def worker(qtbot):
    made = SessionWorker(Session(HAN19))
    yield made
    made.pause()
    made.close()


@pytest.fixture
def chooser(qtbot, worker: SessionWorker) -> ProfileChooser:
    made = ProfileChooser(worker, UndoStack(worker.notifications))
    qtbot.addWidget(made)
    return made


def own(folder: Path, name: str = "own") -> str:
    path = folder / f"{name}.onnx"
    shutil.copy(ROOT / "resources" / "networks" / "labeller.onnx", path)
    return str(path)


def with_network(folder: Path, network: str, name: str = "mine") -> str:
    path = folder / f"{name}.json"
    save_profile(replace(HAN19, performer=name, network=network), path)
    return str(path)


def wait(qtbot, condition, what: str = "") -> None:
    until(condition, what, lambda seconds: qtbot.wait(round(seconds * 1000)))


def test_the_window_goes_on_while_a_network_is_loaded_once(qtbot, worker, chooser, loads, tmp_path: Path) -> None:
    network = own(tmp_path)
    profile = with_network(tmp_path, network)
    ticks: list[int] = []
    timer = QTimer(interval=10)
    timer.timeout.connect(lambda: ticks.append(len(loads.threads)))
    timer.start()
    chooser.choose(profile)
    assert worker.session.profile is HAN19 and not chooser._undo.canUndo()
    wait(qtbot, lambda: worker.session.profile.network == network, "the network")
    assert loads.threads and threading.main_thread() not in loads.threads
    assert sum(1 for n in ticks if n) > 5  # the window was alive meanwhile
    n = len(loads.threads)
    chooser._undo.undo()
    assert worker.session.profile is HAN19
    chooser._undo.redo()
    assert worker.session.profile.network == network
    worker.set_profile(replace(worker.session.profile, performer="Anna"))
    assert worker.session.profile.performer == "Anna"
    same = with_network(tmp_path, own(tmp_path, "copy"), "other")
    chooser.choose(same)
    wait(qtbot, lambda: worker.session.profile.performer == "other", "another file of the same network")
    assert len(loads.threads) == n


def test_what_is_no_network_is_told_and_the_old_profile_stays(qtbot, worker, chooser, tmp_path: Path) -> None:
    (tmp_path / "notes.onnx").write_text("no network")
    for name in ("notes.onnx", "gone.onnx"):
        told = len(worker.notifications.history)
        chooser.choose(with_network(tmp_path, str(tmp_path / name)))
        wait(qtbot, lambda told=told: len(worker.notifications.history) > told, "the refusal")
        note = worker.notifications.history[-1]
        assert name in note.text and "--network" in note.action
        assert worker.session.profile is HAN19 and not chooser._undo.canUndo()
        assert chooser.currentText() == "han19"


def test_what_is_asked_for_later_is_what_is_used(qtbot, worker, loads, tmp_path: Path) -> None:
    worker.set_profile(replace(HAN19, performer="slow", network=own(tmp_path)))
    worker.set_profile(replace(HAN19, performer="quick"))
    assert worker.session.profile.performer == "quick"
    wait(qtbot, lambda: len(loads.threads) == 2, "the network")
    qtbot.wait(800)
    assert worker.session.profile.performer == "quick"


def test_networks_of_the_last_time_are_used_as_soon_as_they_are_loaded(qtbot, worker, loads, tmp_path: Path) -> None:
    network = own(tmp_path)
    worker.session.set_profiles((HAN19, HAN19))
    use_networks(worker, [replace(HAN19, network=str(tmp_path / "gone.onnx")), replace(HAN19, network=network)])
    wait(qtbot, lambda: worker.session.profiles[1].network == network, "the network of the second")
    assert worker.session.profiles[0].network is None
    assert any("gone.onnx" in note.text for note in worker.notifications.history)
    assert threading.main_thread() not in loads.threads
