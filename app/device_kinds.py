"""The kinds of device there are, and who simulates them. A new one is a folder in devices, and a line here."""

from __future__ import annotations

import importlib
from typing import Any, NamedTuple, TypeVar

from core.errors import DeviceError
from devices.device import Device
from devices.simulator import Simulator

T = TypeVar("T")


class _Kind(NamedTuple):
    """Modules: of the device, and of the server that speaks as such a system does, "" if there is none."""

    device: str
    simulator: str = ""


_KINDS = {
    "natnet": _Kind("devices.natnet.client", "devices.natnet.simulator"),
    "playback": _Kind("app.file_device"),
    "demo": _Kind("app.demo"),
}
KINDS = tuple(_KINDS)
SIMULATED = tuple(kind for kind, modules in _KINDS.items() if modules.simulator)


def device_class(kind: str) -> type[Device]:
    """The device of that kind. Raises DeviceError for an unknown kind."""
    if kind not in KINDS:
        raise DeviceError(f"Device {kind!r} is not known.", "Choose " + ", ".join(KINDS) + ".")
    return _defined(_KINDS[kind].device, Device)  # type: ignore[type-abstract]


def device_classes() -> list[type[Device]]:
    """Every kind of device, in the order of menus and help."""
    return [device_class(kind) for kind in KINDS]


def simulator_class(kind: str) -> type[Simulator[Any]]:
    """What simulates that kind. Raises DeviceError for one that nothing does."""
    if kind not in SIMULATED:
        raise DeviceError(f"Device {kind!r} cannot be simulated.", "Choose " + ", ".join(SIMULATED) + ".")
    return _defined(_KINDS[kind].simulator, Simulator)  # type: ignore[type-abstract]


def _defined(name: str, base: type[T]) -> type[T]:
    """The class of that base which a module defines."""
    module = importlib.import_module(name)
    for value in vars(module).values():
        if isinstance(value, type) and issubclass(value, base) and value.__module__ == module.__name__:
            return value
    raise AssertionError(f"{module.__name__} defines no {base.__name__}")
