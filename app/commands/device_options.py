"""Options of a device on the command line, made from the parameters that it declares."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from typing import Any

from devices.device import Device, Parameter, Value

_PREFIX = "device_"


class _Take(argparse.Action):
    """Keeps what was given. parameter: `%(offered)s` in the help says what it offers when the help is shown."""

    def __init__(self, option_strings: Sequence[str], dest: str, parameter: Parameter, **further: Any) -> None:
        super().__init__(option_strings, dest, **further)
        self.offered = _Offered(parameter)

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, option_string: Any = None
    ) -> None:
        setattr(namespace, self.dest, values)


class _Offered:
    """Asks for what can be chosen when it is written out, and not before: to list the ports takes a while."""

    def __init__(self, parameter: Parameter) -> None:
        self._parameter = parameter

    def __str__(self) -> str:
        return "now: " + (", ".join(self._parameter.offered) or "none")


def add_device_options(parser: argparse.ArgumentParser, parameters: tuple[Parameter, ...]) -> None:
    """One option per parameter: `--server ADDRESS` for `server`, `--no-x` beside `--x` for a switch."""
    group = parser.add_argument_group("device options")
    for parameter in parameters:
        option = "--" + parameter.name.replace("_", "-")
        destination = _PREFIX + parameter.name
        text = _help(parameter).replace("%", "%%") + (" %(offered)s" if callable(parameter.choices) else "")
        if isinstance(parameter.default, bool):
            group.add_argument(
                option, dest=destination, action=argparse.BooleanOptionalAction, default=argparse.SUPPRESS, help=text
            )
        else:
            group.add_argument(
                option,
                action=_Take,
                parameter=parameter,
                dest=destination,
                default=argparse.SUPPRESS,
                choices=parameter.fixed_choices or None,
                metavar=None if parameter.fixed_choices else _metavar(parameter),
                help=text,
            )


def device_settings(arguments: argparse.Namespace) -> dict[str, Value]:
    """The settings that were given, unchecked: the device checks them."""
    return {name.removeprefix(_PREFIX): value for name, value in vars(arguments).items() if name.startswith(_PREFIX)}


def add_device_parsers(
    parser: argparse.ArgumentParser, classes: list[type[Device]]
) -> list[tuple[type[Device], argparse.ArgumentParser]]:
    """One sub-command per kind of device, so that `--help` shows that device's own options."""
    devices = parser.add_subparsers(title="devices", metavar="DEVICE", dest="device", required=True)
    made = []
    for kind in classes:
        child = devices.add_parser(
            kind.kind, help=kind.title, description=f"{parser.description} Device: {kind.title}."
        )
        made.append((kind, child))
    return made


def _metavar(parameter: Parameter) -> str:
    return (parameter.unit or parameter.name).upper().replace(" ", "_")


def _help(parameter: Parameter) -> str:
    parts = [parameter.help or parameter.label]
    if parameter.unit:
        parts.append(f"[{parameter.unit}]")
    low, high = parameter.minimum, parameter.maximum
    if math.isfinite(low) and math.isfinite(high):
        parts.append(f"{low:g} to {high:g};")
    if parameter.default != "":
        parts.append(f"default {parameter.default}")
    return " ".join(parts)
