"""The kinds of device there are. A new one is a folder in devices, and a line here."""

from __future__ import annotations

import importlib

from core.errors import DeviceError
from devices.device import Device

_MODULES = {"natnet": "devices.natnet.client", "playback": "app.file_device", "demo": "app.demo"}
KINDS = tuple(_MODULES)


def device_class(kind: str) -> type[Device]:
    """The device of that kind. Raises DeviceError for an unknown kind."""
    if kind not in KINDS:
        raise DeviceError(f"Device {kind!r} is not known.", "Choose " + ", ".join(KINDS) + ".")
    module = importlib.import_module(_MODULES[kind])
    for value in vars(module).values():
        if isinstance(value, type) and issubclass(value, Device) and value.__module__ == module.__name__:
            return value
    raise AssertionError(f"{module.__name__} holds no Device of kind {kind!r}")


def device_classes() -> list[type[Device]]:
    """Every kind of device, in the order of menus and help."""
    return [device_class(kind) for kind in KINDS]
