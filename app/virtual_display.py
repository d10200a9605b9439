"""A display for machines that have none: Xvfb, as long as a `with` block lasts, and never longer than its process."""

from __future__ import annotations

import ctypes
import os
import select
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from core.errors import PhalanxError

SCREEN = "1920x1200x24"
_START_TIMEOUT_S = 30.0
_PR_SET_PDEATHSIG = 1  # linux/prctl.h


def has_display() -> bool:
    """Whether windows can be shown here. A DISPLAY that nobody serves counts as none."""
    if not sys.platform.startswith("linux") or os.environ.get("WAYLAND_DISPLAY"):
        return True
    display = os.environ.get("DISPLAY", "")
    return bool(display) and _is_served(display)


def _is_served(display: str) -> bool:
    host, _, rest = display.rpartition(":")
    number = rest.partition(".")[0]
    if not number.isdigit():
        return False
    if host in ("", "unix"):
        # The abstract socket first: it is what X clients try, and it outlives a cleaned /tmp.
        for name in (f"\0/tmp/.X11-unix/X{number}", f"/tmp/.X11-unix/X{number}"):
            with socket.socket(socket.AF_UNIX) as probe:
                if probe.connect_ex(name) == 0:
                    return True
        return False
    try:
        with socket.create_connection((host, 6000 + int(number)), timeout=2.0):
            return True
    except OSError:
        return False


@contextmanager
def virtual_display(screen: str = SCREEN) -> Iterator[str]:
    """Starts Xvfb on a free display number and makes it this process's DISPLAY; ends it after the block.

    screen: width, height and depth. Yields the display's name. Raises PhalanxError if Xvfb is not installed or does
    not start.
    """
    program = shutil.which("Xvfb")
    if program is None:
        raise PhalanxError(
            "This machine has no display, and no Xvfb to stand in for one.",
            "Install it: sudo apt-get install xvfb xauth.",
        )
    read_end, write_end = os.pipe()
    server = subprocess.Popen(
        [program, "-displayfd", str(write_end), "-screen", "0", screen, "-nolisten", "tcp"],
        pass_fds=(write_end,),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # Ctrl+C ends the application first, then its display
        preexec_fn=_ends_with_its_parent,
    )
    os.close(write_end)
    before = {name: os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "XAUTHORITY")}
    try:
        name = f":{_read_number(read_end)}"
        for variable in before:
            os.environ.pop(variable, None)
        os.environ["DISPLAY"] = name
        yield name
    finally:
        for variable, value in before.items():
            if value is None:
                os.environ.pop(variable, None)
            else:
                os.environ[variable] = value
        server.terminate()
        try:
            server.wait(5.0)
        except subprocess.TimeoutExpired:
            server.kill()
            server.wait()


def _ends_with_its_parent() -> None:
    """In the new process: whoever kills the application with no time to tidy up leaves no display behind."""
    with suppress(OSError, AttributeError):  # another system than Linux, or another C library
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)


def _read_number(read_end: int) -> int:
    """The display number that Xvfb writes once it serves."""
    text = b""
    with os.fdopen(read_end, "rb", buffering=0) as stream:
        while not text.endswith(b"\n"):
            ready, _, _ = select.select([stream], [], [], _START_TIMEOUT_S)
            part = stream.read(16) if ready else b""
            if not part:
                raise PhalanxError("Xvfb did not start.", "Run Xvfb -displayfd 1 in a terminal to see why.")
            text += part
    return int(text)
