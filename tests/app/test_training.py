"""Training from the window: a process of its own, followed, ended early, and its network put to use."""

from __future__ import annotations

import multiprocessing
import time
from dataclasses import replace
from pathlib import Path

import pytest

from app.session import Session
from app.settings import Settings
from app.training import dialog as dialogs
from app.training.desk import TrainingDesk
from app.undo import UndoStack
from app.worker import SessionWorker
from core.labelling.network import LabelNetwork
from core.markers.layout import load_layout
from tests.app.hand_frames import profile


@pytest.fixture
def desk(qtbot, tmp_path: Path):
    own = replace(load_layout("alexanderson13"), name="my_glove")
    worker = SessionWorker(Session(replace(profile(), layout=own)))
    made = TrainingDesk(worker, UndoStack(worker.notifications), Settings(None), lambda: tmp_path, None)
    made.worker, made.undo = worker, made._undo
    yield made
    made.stop()
    worker.close()
    assert not multiprocessing.active_children()


def wait(qtbot, condition, what: str) -> None:
    """Loading PyTorch at low priority takes its time on a busy machine."""
    deadline = time.monotonic() + 300.0
    while not condition():
        assert time.monotonic() < deadline, what
        qtbot.wait(50)


def test_a_network_is_trained_ended_early_and_used(desk, qtbot, tmp_path: Path) -> None:
    for package in ("torch", "onnx"):
        pytest.importorskip(package, reason="needs the extra train")
    desk.open()
    dialog = desk.dialog
    assert dialog.layout_name.text() == "my_glove" and dialog.out.text() == str(tmp_path / "networks" / "my_glove.onnx")
    dialog.minutes.setValue(0.5)
    dialog.threads.setValue(1)
    dialog.start.click()
    assert desk.training and not dialog.minutes.isEnabled()
    wait(qtbot, lambda: "named right" in dialog.figures.text(), "progress")
    assert " clouds · " in dialog.figures.text() and dialog.figures.text().endswith(" left")
    dialog.close()
    assert desk.training  # in the background
    desk.open()
    dialog.stop.click()
    wait(qtbot, lambda: not desk.training, "the best so far to be written")
    assert "named right" in dialog.said.text() and dialog.said.property("level") == "good"
    written = tmp_path / "networks" / "my_glove.onnx"
    network = LabelNetwork(written)
    assert network.about["layouts"] == "my_glove" and written.with_suffix(".json").exists()
    assert network.name(load_layout("alexanderson13").positions_m, load_layout("alexanderson13")).point.shape == (13,)
    dialog.use.click()
    wait(qtbot, lambda: desk.worker.session.profile.network is not None, "the network to be loaded")
    assert desk.worker.session.profile.network == str(written) and "in use" in dialog.said.text()
    assert dialog.in_use.text() == "my_glove.onnx" and dialog.shipped.isVisible()
    desk.undo.undo()
    assert desk.worker.session.profile.network is None and dialog.in_use.text() == "The network of Phalanx"
    desk.undo.redo()
    assert desk.worker.session.profile.network == str(written)
    dialog.shipped.click()
    wait(qtbot, lambda: desk.worker.session.profile.network is None, "the network of Phalanx")
    assert desk.worker.session.profile.network is None and not dialog.shipped.isVisible()


def test_what_cannot_be_trained_is_told_in_the_dialog(desk, qtbot, tmp_path: Path) -> None:
    for package in ("torch", "onnx"):
        pytest.importorskip(package, reason="needs the extra train")
    desk.open()
    desk.dialog.data.setText(str(tmp_path / "nowhere"))
    desk.dialog.start.click()
    wait(qtbot, lambda: not desk.training, "the refusal")
    assert "nowhere is not there" in desk.dialog.said.text() and desk.dialog.said.property("level") == "problem"
    assert desk.dialog.start.isEnabled() and not desk.dialog.use.isVisible()


def test_without_pytorch_it_says_how_to_install_it(desk, monkeypatch) -> None:
    monkeypatch.setattr(dialogs, "missing_packages", lambda: ["torch", "onnx"])
    desk.open()
    assert "torch and onnx, not installed" in desk.dialog.said.text()
    assert "python -m pip install 'phalanx[train]'" in desk.dialog.said.text()
    assert not desk.dialog.start.isEnabled() and not desk.dialog.minutes.isEnabled()


def test_what_is_no_network_is_told_and_not_used(desk, qtbot, tmp_path: Path) -> None:
    (tmp_path / "notes.onnx").write_text("no network")
    for name, said in (("notes.onnx", "no network that can be run"), ("gone.onnx", "No such file")):
        told = len(desk.worker.notifications.history)
        desk.use(tmp_path / name)
        wait(qtbot, lambda told=told: len(desk.worker.notifications.history) > told, "the refusal")
        note = desk.worker.notifications.history[-1].line
        assert name in note and said in note and "phalanx train labeller" in note
    assert desk.worker.session.profile.network is None
