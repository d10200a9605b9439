"""The display goes away under the window: its server ends, or the network to it.

Qt and Xlib then leave this process at once by C's exit(), which ends libraries under the threads that still use them:
the process hangs or faults, and the take is cut off. So the take is finished first, and the process ended outright.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from PySide6.QtCore import QMessageLogContext, QtMsgType, qInstallMessageHandler

_BROKE = "connection broke"
"""In what Qt says before it leaves, of X11 and of Wayland."""


@contextmanager
def display_watched(lost: Callable[[], None]) -> Iterator[None]:
    """While the block lasts, the loss of the display calls `lost` on the window's thread, which can draw no more, and
    then ends this process with status 1."""

    def end() -> None:
        try:
            lost()
        finally:
            os._exit(1)

    def heard(kind: QtMsgType, context: QMessageLogContext, text: str) -> None:
        with suppress(OSError, ValueError):  # the terminal may go with the display
            print(text, file=sys.stderr, flush=True)
        if _BROKE in text:
            end()

    before = qInstallMessageHandler(heard)
    forget = _watch_xlib(end)
    try:
        yield
    finally:
        forget()
        qInstallMessageHandler(before)


def _watch_xlib(end: Callable[[], None]) -> Callable[[], None]:
    """Has `end` called where Xlib, which OpenGL draws through, is the first to notice. How to undo it."""
    if not sys.platform.startswith("linux"):
        return lambda: None
    try:
        xlib = ctypes.CDLL("libX11.so.6")
    except OSError:  # Wayland alone
        return lambda: None
    kind = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)
    handler = kind(lambda display: end() or 0)
    xlib.XSetIOErrorHandler.restype = ctypes.c_void_p
    xlib.XSetIOErrorHandler.argtypes = [ctypes.c_void_p]
    before = xlib.XSetIOErrorHandler(ctypes.cast(handler, ctypes.c_void_p))

    def forget() -> None:
        xlib.XSetIOErrorHandler(before)
        del handler_kept[:]

    handler_kept = [handler]  # as long as Xlib may call it
    return forget
