"""Starts the application: session, window, and the end of both."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from PySide6.QtWidgets import QApplication

from app import settings as names
from app import theme
from app.demo import LAYOUT, DemoDevice
from app.hand_size import FROM_MOTION, SIZE_NAMES, sized
from app.left_behind.run_file import RunFile
from app.main_window import MainWindow
from app.notifications import LOG, NotificationCentre, start_log
from app.props.offered import props_of
from app.props.picking import with_props
from app.receiver import Receiver
from app.rescued import tell_of_rescued
from app.session import Session
from app.settings import Settings, default_path
from app.viewport.gl_support import gl_support
from app.window_ending import WindowEnding
from app.worker import SessionWorker
from core.profile import Profile, load_profile
from core.takes.take import MOST_PERFORMERS

FRAMES_HZ, FRAMES_HZ_SOFTWARE = 60, 30


@dataclass
class Running:
    """An application that was started."""

    application: QApplication
    window: MainWindow
    session: Session


def start(settings: Settings, demo: bool = False, profile: Profile | None = None) -> Running:
    """Open the window on a session. demo: with the built-in performer, connected."""
    application = QApplication.instance() or QApplication(sys.argv[:1])
    assert isinstance(application, QApplication)
    application.setApplicationName("phalanx")
    application.setApplicationDisplayName("Phalanx")
    theme.apply(application)
    notifications = NotificationCentre()
    settings.tell_with(lambda what, action: notifications.warning(what, action, "Settings"))
    others = () if demo or profile is not None else remembered_others(settings, notifications)
    first = profile or remembered_profile(settings, demo, notifications)
    cast = (first, *others)
    # With the network of Phalanx, until those of the last time are loaded.
    session = Session([replace(profile, network=None) for profile in cast], notifications=notifications)
    worker = SessionWorker(session, FRAMES_HZ_SOFTWARE if gl_support().software else FRAMES_HZ)
    window = MainWindow(worker, settings)
    sys.excepthook = lambda kind, error, trace: notifications.error(error.with_traceback(trace), "", "Something")
    threading.excepthook = lambda failed: notifications.error(
        failed.exc_value or RuntimeError("no reason given"), "", failed.thread.name if failed.thread else "A thread"
    )
    session.start()
    window.show()
    use_networks(worker, cast)
    if demo:
        _connect_demo(window)
    return Running(application, window, session)


def run(demo: bool = False) -> int:
    """Open the window and stay until it is closed."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    log = start_log()
    settings = Settings(default_path())
    with RunFile("the window") as file:
        return _run(settings, demo, file, log is not None)


def _run(settings: Settings, demo: bool, file: RunFile, logged: bool) -> int:
    running = start(settings, demo)
    file.follow(running.session)
    if not logged:
        running.session.notifications.warning(
            "The log file cannot be written.", "Messages are kept in this window only."
        )
    tell_of_rescued(running.session.notifications)
    running.window.left_behind.look()
    try:
        with WindowEnding(running.window, file.display_gone):
            return running.application.exec()
    finally:
        LOG.info("Closed")


def remembered_profile(settings: Settings, demo: bool, notifications: NotificationCentre) -> Profile:
    """The profile of the last time; for the demo, the performer's own."""
    name = LAYOUT if demo else settings.get(names.PROFILE, LAYOUT)
    whole: dict[str, object] = {} if demo else settings.get(names.PROFILE_WHOLE, {})
    try:
        if whole:
            return Profile.from_dict(whole, "The profile of the last time")
        size = FROM_MOTION if demo else settings.get(names.HAND_SIZE, FROM_MOTION)
        return sized(load_profile(name), size if size in SIZE_NAMES else FROM_MOTION)
    except Exception as error:
        notifications.error(error, "Tracking", "Opening the last profile")
        return load_profile(LAYOUT)


def remembered_others(settings: Settings, notifications: NotificationCentre) -> tuple[Profile, ...]:
    """The profiles of the other performers of the last time. What cannot be read any more is told and left out."""
    others: list[Profile] = []
    for number, whole in enumerate(settings.get(names.OTHER_PROFILES, [])[: MOST_PERFORMERS - 1], start=2):
        try:
            others.append(Profile.from_dict(whole, f"The profile of performer {number} of the last time"))
        except Exception as error:
            notifications.error(error, "Tracking", "Opening the last profiles")
    return tuple(others)


def use_networks(worker: SessionWorker, cast: Sequence[Profile]) -> None:
    """Give each performer the network of the last time. One that cannot be run any more is told, and not used."""

    def use(performer: int, network: str) -> None:
        now = worker.session.profiles
        if performer < len(now) and now[performer].network is None and now[performer].same_hands(cast[performer]):
            worker.set_profile(replace(now[performer], network=network), performer)

    for performer, profile in enumerate(cast):
        if profile.network is not None:
            worker.with_networks((profile,), partial(use, performer, profile.network))


def _connect_demo(window: MainWindow) -> None:
    streams = [s for s in window.worker.session.receivers if s.device_class is DemoDevice]
    stream = streams[0] if streams else window.worker.add_device(DemoDevice, {})
    if stream.settings["layout"] != LAYOUT:
        stream.configure({"layout": LAYOUT})
    window.worker.connect_device(stream)
    _track_things(window, stream)


def _track_things(window: MainWindow, stream: Receiver) -> None:
    """Follow what the performer handles as soon as the device tells of it. Lent: not remembered with the profile."""
    worker = window.worker

    def look() -> None:
        if stream.streaming:
            worker.devices_changed.disconnect(look)
            window.lent_props = props_of(stream.device.offers())
            worker.session.set_profile(with_props(worker.session.profile, window.lent_props))

    worker.devices_changed.connect(look)


def take_screenshot(window: MainWindow, path: Path) -> bool:
    """What the window shows, as a picture file; False if it could not be written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    return window.grab().save(str(path))
