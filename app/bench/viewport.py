"""The 3D view: two hands and their markers drawn as fast as this machine can, then with every marker named; frames per
second, cost per frame."""

from __future__ import annotations

import argparse
import itertools
import time
from contextlib import nullcontext
from typing import Any

import numpy as np

from core.frames import MarkerFrame, TrackedFrame
from core.profile import Profile, load_profile

FRAMES = 120


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument("--seconds", metavar="S", type=float, default=5.0, help="how long each; default %(default)s")
    parser.add_argument("--width", metavar="PX", type=int, default=800, help="default %(default)s")
    parser.add_argument("--height", metavar="PX", type=int, default=600, help="default %(default)s")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """A window of its own, on a virtual display where there is none."""
    from app.virtual_display import has_display, virtual_display

    with nullcontext() if has_display() else virtual_display():
        figures = _measure(arguments)
    if figures["reason"]:
        print(f"No 3D view: {figures['reason']}")
    else:
        print(
            f"{figures['renderer']}, {arguments.width} x {arguments.height}: {figures['fps']:.1f} frames per second; "
            f"window's thread {figures['paint_median_ms']:.1f} ms per frame (p99 {figures['paint_p99_ms']:.1f}), "
            f"all threads {figures['processor_ms']:.1f} ms"
        )
        print(
            f"The window's thread, overlays and all, is busy for {figures['window_ms']:.1f} ms per frame; with "
            f"{figures['names']} markers named for {figures['named_window_ms']:.1f} ms "
            f"({figures['named_fps']:.1f} frames per second)"
        )
    return figures


def _measure(arguments: argparse.Namespace) -> dict[str, Any]:
    from PySide6.QtWidgets import QApplication

    application = QApplication([])
    try:
        return _draw(arguments, application)
    finally:
        application.shutdown()  # before the virtual display, which it would miss


def _draw(arguments: argparse.Namespace, application: Any) -> dict[str, Any]:
    from PySide6.QtCore import QTimer

    from app.viewport.gl_support import gl_support
    from app.viewport.name_tags import NameTags
    from app.viewport.viewport import Viewport

    support = gl_support()
    if support.reason:
        return {"reason": support.reason}
    profile = load_profile("han19")
    frames = _performance(profile)
    view = Viewport()
    view.period_s = 0.0
    view.resize(arguments.width, arguments.height)
    costs_s: list[float] = []
    turn = itertools.cycle(frames)

    def drawn() -> None:
        costs_s.append(view.frame_cost_s)
        QTimer.singleShot(0, lambda: view.show_frame(*next(turn), profile))

    view.drawn.connect(drawn)
    view.show()
    view.show_frame(*next(turn), profile)
    until_s = time.perf_counter() + arguments.seconds
    while len(costs_s) < 10 and time.perf_counter() < until_s:  # shaders are linked, buffers sent
        application.processEvents()
    plain = _timed(costs_s, arguments.seconds, application)
    view.set_names_shown(True)
    named = _timed(costs_s, arguments.seconds, application)
    names = len(view.findChild(NameTags).names) if not view.failure else 0
    view.close()
    return {
        "reason": view.failure,
        "renderer": support.renderer,
        "software": support.software,
        **plain,
        "names": names,
        **{f"named_{name}": value for name, value in named.items()},
    }


def _timed(costs_s: list[float], seconds: float, application: Any) -> dict[str, float]:
    """What drawing costs. costs_s: filled by whoever draws, one per frame [s]."""
    costs_s.clear()
    began_s, window_s, processor_s = time.perf_counter(), time.thread_time(), time.process_time()
    while time.perf_counter() < began_s + seconds:
        application.processEvents()
    elapsed_s, n = time.perf_counter() - began_s, max(len(costs_s), 1)
    return {
        "fps": len(costs_s) / elapsed_s,
        "paint_median_ms": 1000 * float(np.median(costs_s or [np.nan])),
        "paint_p99_ms": 1000 * float(np.percentile(costs_s or [np.nan], 99)),
        "window_ms": 1000 * (time.thread_time() - window_s) / n,
        "processor_ms": 1000 * (time.process_time() - processor_s) / n,
        "frames": len(costs_s),
    }


def _performance(profile: Profile) -> list[tuple[MarkerFrame, TrackedFrame]]:
    from core.engine import Engine
    from core.motion.performer import Performer
    from core.motion.stream import MarkerStream

    engine = Engine(profile)
    stream = MarkerStream(Performer(profile, 1), 120.0, 1, hidden=0.05, ghosts=0.5)
    return [(frame, engine.step(frame)) for frame in itertools.islice(stream.frames(), FRAMES)]
