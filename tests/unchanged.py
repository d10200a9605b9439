"""What belongs to the whole process, and so to all tests of it: none may leave it otherwise than it was."""

from __future__ import annotations

import locale
import os
import signal
import socket
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

_PYTEST = "PYTEST_CURRENT_TEST"
_PLOT_OPTIONS = {"background": "k", "foreground": "d", "antialias": False}  # as pyqtgraph has them at first
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def _environment() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name != _PYTEST}


def _to_environment(before: dict[str, str]) -> None:
    for name in _environment().keys() - before.keys():
        del os.environ[name]
    os.environ.update(before)


def _handlers() -> dict[int, Any]:
    return {number: signal.getsignal(number) for number in _SIGNALS}


def _to_handlers(before: dict[int, Any]) -> None:
    for number, handler in before.items():
        signal.signal(number, handler)


def _plot_options() -> dict[str, Any]:
    module = sys.modules.get("pyqtgraph")
    return {name: module.getConfigOption(name) if module else usual for name, usual in _PLOT_OPTIONS.items()}


def _to_plot_options(before: dict[str, Any]) -> None:
    sys.modules["pyqtgraph"].setConfigOptions(**before)


KEPT: dict[str, tuple[Callable[[], Any], Callable[[Any], object]]] = {
    "environment": (_environment, _to_environment),
    "working folder": (os.getcwd, os.chdir),
    "handlers of signals": (_handlers, _to_handlers),
    "what numpy does on errors": (np.geterr, lambda before: np.seterr(**before)),
    "locale": (lambda: locale.setlocale(locale.LC_ALL), lambda before: locale.setlocale(locale.LC_ALL, before)),
    "timeout of sockets": (socket.getdefaulttimeout, socket.setdefaulttimeout),
    "depth of calls": (sys.getrecursionlimit, sys.setrecursionlimit),
    "options of plots": (_plot_options, _to_plot_options),
}
"""What is compared: how it is now, and how it is put back."""


def now() -> dict[str, Any]:
    """All of it."""
    return {name: read() for name, (read, _) in KEPT.items()}


def put_back(before: dict[str, Any]) -> list[str]:
    """Makes all as it was; what was not, in words."""
    found = []
    for name, (read, restore) in KEPT.items():
        there = read()
        if there == before[name]:
            continue
        restore(before[name])
        found.append(f"{name}: {_difference(before[name], there)}")
    return found


def _difference(before: Any, after: Any) -> str:
    if isinstance(before, dict) and isinstance(after, dict):
        changed = [key for key in before.keys() | after.keys() if before.get(key) != after.get(key)]
        return ", ".join(f"{key} was {before.get(key)!r}, is {after.get(key)!r}" for key in sorted(changed, key=str))
    return f"was {before!r}, is {after!r}"
