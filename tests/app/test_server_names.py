"""What a server calls itself and its things: wherever the window, the network search, the log and takes show it."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QMenu

from app.main_window import MainWindow
from app.notifications import LOG, start_log
from core.frames import RigidBody
from core.takes.reader import open_take
from devices.device import Level
from devices.natnet import protocol
from devices.natnet.client import NatNetDevice
from devices.natnet.models import AssetMarker, AssetModel, MarkerSetModel, RigidBodyModel, SkeletonModel, encode_models
from devices.natnet.protocol import Message
from devices.natnet.simulator import NatNetSimulator
from tests.app.evil import EVIL, assert_calm, holding
from tests.app.stage import performance, settings_for
from tests.app.test_names_in_window import assert_calm_window
from tests.app.test_window import Desk
from tests.some import some

NAMES = {
    "acts": EVIL,
    "titles a terminal": "\x1b]0;owned\x07\x1b]8;;http://x\x1b\\\\link",
    "long": "W" * 10_000,
    "long and acting": "\x1b[2J\u202e\n" * 3_000,
    "percent": "%s %n %1 %% {0} {name} ${HOME} %(x)s 100%",
    "markup": "<img src='file:///etc/passwd'><a href='x'>y</a><b>x</b>&amp;R&D[*]",
    "turned around": "\u202eevitoM\u2066\u200f\u061c",
    "nothing to be seen": " \u3000\u2800\u00a0 ",
    "none": "",
    "a path": "../../etc/passwd\\:*?|CON",
}
FIRST = ("acts", "long and acting", "none")
CASES = [kind if kind in FIRST else pytest.param(kind, marks=pytest.mark.long) for kind in NAMES]
AGAIN = "R&D\x1b[31m\u2029server<i>" + "W" * 200


class Naming(NatNetSimulator):
    """Every kind of model that there is, all of one name."""

    named = ""

    def _reply(self, message: int, payload: bytes, address: tuple[str, int]) -> bytes | None:
        if message != Message.REQUEST_MODELDEF:
            return super()._reply(message, payload, address)
        n = self.named[:500]  # all must fit into a packet
        body = RigidBodyModel(
            self.named, 7, marker_positions=np.zeros((1, 3), np.float32), marker_labels=np.zeros(1, np.int32),
            marker_names=(n,),
        )  # fmt: skip
        bone = replace(body, name=n, id=1)
        marker = AssetMarker(n, 1, (0.0, 0.0, 0.0), 0.01, 0)
        models = [
            MarkerSetModel(n, (n,)), body, SkeletonModel(n, 3, (bone,)), AssetModel(n, 1, 9, (bone,), (marker,))
        ]  # fmt: skip
        return protocol.pack(Message.MODELDEF, encode_models(models, self.bitstream))


@contextmanager
def naming(name: str, **ports: int) -> Iterator[NatNetSimulator]:
    body = holding(RigidBody(7, "x", np.zeros(3), np.array([1.0, 0, 0, 0]), True), name=name)
    frames = [replace(frame, rigid_bodies=(body,)) for frame in performance()]
    chosen = {"command_port": 0, "data_port": 0, **ports}
    server = Naming(frames, 120.0, loop=True, name=name.encode()[:255].decode(errors="ignore"), **chosen)
    server.named = name
    with server:
        server.start()
        yield server


@pytest.fixture
def window(qtbot, tmp_path: Path) -> Iterator[MainWindow]:
    desk = Desk(qtbot, tmp_path / "takes")
    desk.window.wait = desk.until
    yield desk.window
    desk.close()


@pytest.fixture
def log(tmp_path: Path) -> Iterator[Path]:
    before = list(LOG.handlers)
    path = start_log(tmp_path / "log")
    assert path is not None
    yield path
    for handler in [one for one in LOG.handlers if one not in before]:
        LOG.removeHandler(handler)
        handler.close()


def assert_calm_log(path: Path) -> None:
    logging.shutdown([lambda one=handler: one for handler in LOG.handlers])
    text = path.read_text(encoding="utf-8")
    assert_calm(text)
    assert all(re.match(r"\d{4}-\d\d-\d\d |    ", line) for line in some(text.splitlines())), text


@pytest.mark.parametrize("kind", CASES)
def test_of_a_live_server(window: MainWindow, log: Path, kind: str) -> None:
    name = NAMES[kind]
    with naming(name) as server:
        narrow = window.minimumSizeHint().width()
        ports = {"command_port": server.command_port, "data_port": server.data_port}
        stream = window.worker.add_device(NatNetDevice, settings_for(server))
        card = window.devices._cards[stream]
        card.more.setChecked(True)
        window.worker.connect_device(stream)
        window.wait(lambda: stream.health().received > 50, "frames")
        window.wait(lambda: window.record_action.isEnabled(), "the record button")
        window.wait(lambda: "Rigid bodies: " in card.heard.text(), "what the card hears")
        assert card.name.text().strip() and not card.name.text().startswith((" ", "3.1"))
        window.record_action.trigger()
        window.wait(lambda: window.worker.session.recording, "a take")
        window.wait(lambda: "●" in window.windowTitle(), "the title")
        assert_calm_window(window)
        assert window.minimumSizeHint().width() <= narrow + 40, "a name makes the window wider"
        window.record_action.trigger()
        window.wait(lambda: window.worker.session.numbers().recording is None, "the end")
        window.wait(lambda: list(window.plan.folder.glob("*.mcap")), "its file")
        window.wait(lambda: not window.worker.session.unsealed, "the sealed take")
    window.wait(lambda: stream.health().level is Level.PROBLEM, "the server to be missed")
    window.wait(lambda: any("silent" in note.text for note in window.worker.notifications.history), "the message")
    assert_calm_window(window)
    with naming(AGAIN, **ports):
        window.wait(lambda: "R&D" in stream.title, "the other server")
        window.wait(lambda: any("is back" in note.text for note in window.worker.notifications.history), "its message")
        assert_calm_window(window)
    (path,) = window.plan.folder.glob("*.mcap")
    assert re.fullmatch(r"[\w.-]+", path.name), "a server names no file"
    with open_take(path) as take:
        assert_calm(" ".join([*take.info.device.values(), take.raw[0].rigid_bodies[0].name]))
        assert take.raw[0].rigid_bodies[0].name.strip()
    window.devices.remove(stream)
    undo = next(action for action in window.findChildren(QAction) if action.text().startswith("Undo"))
    assert_calm(undo.text())
    assert "&" not in undo.text().replace("&&", ""), "an ampersand is no key"
    assert len(undo.text()) < 120, "a menu is as wide as its longest entry"
    assert_calm_log(log)


def _texts(menu: QMenu) -> str:
    return " ".join(action.text() for action in menu.actions())


@pytest.mark.parametrize("kind", CASES)
def test_of_a_server_that_is_found(window: MainWindow, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    with naming(NAMES[kind]) as server:
        monkeypatch.setattr(protocol, "COMMAND_PORT", server.command_port)  # on a port that is free
        window.devices.find()
        window.wait(lambda: window.devices.find_button.isEnabled(), "the search")
        (menu,) = (one for one in window.devices.findChildren(QMenu) if "127.0.0.1" in _texts(one))
        (action,) = (action for action in menu.actions() if "127.0.0.1" in action.text())
        print(action.text())
        assert_calm_window(menu)
        assert "&" not in action.text().replace("&&", "")
        assert re.fullmatch(r"Add \S.* 3\.1 at 127\.0\.0\.1", action.text())
        assert menu.sizeHint().width() <= window.screen().geometry().width()
        menu.close()
