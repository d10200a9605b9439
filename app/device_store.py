"""Devices between starts: which were in the session, with which settings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from app import settings as names
from app.settings import Settings
from app.worker import SessionWorker
from devices.device import Device

MOST_DEVICES = 32
"""That are remembered."""


def save_devices(worker: SessionWorker, settings: Settings) -> None:
    """Remember the devices of the session."""
    settings.set(
        names.DEVICES,
        [{"kind": stream.device_class.kind, "settings": stream.settings} for stream in worker.session.receivers],
    )


def restore_devices(worker: SessionWorker, settings: Settings, kinds: Sequence[type[Device]]) -> None:
    """Add what was remembered, not connected. What is no longer valid is told and left out."""
    known = {kind.kind: kind for kind in kinds}
    entry: Any
    for entry in settings.get(names.DEVICES, [])[:MOST_DEVICES]:
        if not isinstance(entry, dict) or not isinstance(entry.get("settings"), dict):
            continue
        kind = entry.get("kind")
        if not isinstance(kind, str) or kind not in known:
            continue
        try:
            worker.add_device(known[kind], entry["settings"])
        except Exception as error:
            worker.notifications.error(error, "Devices", "Restoring a device")
