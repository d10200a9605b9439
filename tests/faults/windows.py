"""The real window in a process of its own, on a display of its own, that connects and records by itself.

Run as a program: python -m tests.faults.windows TAKE COMMAND_PORT
"""

from __future__ import annotations

import itertools
import os
import select
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from devices.natnet.simulator import NatNetSimulator
from tests.faults.fault import NotHere
from tests.faults.stage import Running, started

_NUMBERS = itertools.count(1000 + 10 * (os.getpid() % 5000))
"""Displays of our own: two servers that look for a free number at the same time may both take one."""


class Display:
    """An X server of its own."""

    def __init__(self) -> None:
        program = shutil.which("Xvfb")
        if program is None:
            raise NotHere("there is no Xvfb")
        read, write = os.pipe()
        self._server = subprocess.Popen(
            [
                program,
                f":{next(_NUMBERS)}",
                "-displayfd",
                str(write),
                "-screen",
                "0",
                "1600x1000x24",
                "-nolisten",
                "tcp",
            ],
            pass_fds=(write,),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        started(self._server)
        os.close(write)
        number = ""
        with os.fdopen(read, "rb", buffering=0) as told:
            while not number.endswith("\n") and select.select([told], [], [], 60.0)[0]:
                part = told.read(16).decode()
                if not part:
                    break
                number += part
        number = number.strip()
        if not number:
            self.kill()
            raise NotHere("Xvfb did not start")
        self.name = f":{number}"

    def kill(self) -> None:
        """At once."""
        self._server.kill()
        self._server.wait()


@contextmanager
def display() -> Iterator[Display]:
    """A display while the block lasts. Raises NotHere."""
    made = Display()
    try:
        yield made
    finally:
        made.kill()


def window(folder: Path, server: NatNetSimulator, shown: Display) -> Running:
    """The window, just started: it connects, and records a take once it can."""
    take = folder / "take_1.mcap"
    words = ["-m", "tests.faults.windows", str(take), str(server.command_port)]
    return Running(words, take, QT_QPA_PLATFORM="xcb", DISPLAY=shown.name, WAYLAND_DISPLAY="", XAUTHORITY="")


def main(take: Path, command_port: int) -> int:
    """The application as it is started by `phalanx`; only its first clicks are made here."""
    from PySide6.QtCore import QTimer

    from app import application
    from app import settings as names
    from core.profile import load_profile
    from devices.natnet.client import NatNetDevice

    start = application.start

    def begin(settings: Any, *_: Any) -> Any:
        settings.set(names.TAKE_FOLDER, str(take.parent))
        running = start(settings, profile=load_profile("han19"))
        window, session = running.window, running.session
        stream = window.worker.add_device(NatNetDevice, {"command_port": command_port})
        window.worker.connect_device(stream)
        clicks = QTimer(window)

        def click() -> None:
            if session.recording:
                numbers = session.numbers().recording
                if numbers is not None and numbers.path != take:
                    take.symlink_to(numbers.path)
                print("Recording", numbers.path if numbers else "", file=sys.stderr, flush=True)
                clicks.stop()
            elif session.ready and window.record_action.isEnabled():
                window.record_action.trigger()

        clicks.timeout.connect(click)
        clicks.start(300)
        return running

    application.start = begin
    return application.run()


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), int(sys.argv[2])))
