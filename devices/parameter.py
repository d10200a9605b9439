"""Settings, declared once: panels, the command line and whoever uses them take names, ranges and help from here."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from core.errors import DeviceError

Value = bool | int | float | str


@dataclass(frozen=True)
class Parameter:
    """One setting of a device, as panels and the command line show it.

    default: its type is the type of the setting. minimum, maximum, step: for numbers, in `unit`.
    choices: for text, all that may be chosen; or a function that says what can be chosen now, as the ports that are
    plugged in: it is asked whenever they are shown, and a choice that is not among them now stays valid.
    locked_while_recording: may not change while a take is written.
    """

    name: str
    label: str
    default: Value
    unit: str = ""
    minimum: float = -math.inf
    maximum: float = math.inf
    step: float = 0.0
    choices: tuple[str, ...] | Callable[[], Sequence[str]] = ()
    locked_while_recording: bool = True
    help: str = ""

    @property
    def fixed_choices(self) -> tuple[str, ...]:
        """All that may be chosen, ever; () where anything may."""
        return () if callable(self.choices) else self.choices

    @property
    def offered(self) -> tuple[str, ...]:
        """What can be chosen now; () where anything may, or nothing can."""
        return tuple(self.choices()) if callable(self.choices) else self.choices

    def check(self, value: object) -> Value:
        """`value` as this parameter's type. Raises DeviceError with the value and the range allowed."""
        kind = type(self.default)
        try:
            if kind is bool:
                if isinstance(value, bool):
                    return value
                text = str(value).lower()
                if text not in ("true", "false", "1", "0", "yes", "no", "on", "off"):
                    raise ValueError(f"{value!r} is neither true nor false")
                return text in ("true", "1", "yes", "on")
            if kind is int and isinstance(value, float) and not value.is_integer():
                raise ValueError("a whole number is needed")
            converted: Value = kind(value)  # type: ignore[arg-type, call-overload]
        except (TypeError, ValueError) as error:
            raise DeviceError(f"{self.label}: {value!r} is not valid ({error}).", self.help) from error
        if isinstance(converted, int | float) and not self.minimum <= converted <= self.maximum:
            raise DeviceError(
                f"{self.label}: {converted} {self.unit}".rstrip() + " is out of range.",
                f"Choose {self.minimum:g} to {self.maximum:g} {self.unit}".rstrip() + ".",
            )
        if self.fixed_choices and converted not in self.fixed_choices:
            known = ", ".join(self.fixed_choices)
            raise DeviceError(f"{self.label}: {converted!r} is not known.", f"Choose {known}.")
        return converted


def checked(parameters: Sequence[Parameter], settings: Mapping[str, object], whose: str) -> dict[str, Value]:
    """Every parameter's value: the one given, or its default. whose: title, for people.

    Raises DeviceError for an unknown setting or a value out of range.
    """
    known = {parameter.name: parameter for parameter in parameters}
    for name in settings:
        if name not in known:
            has = "It has " + ", ".join(known) + "." if known else "It has none."
            raise DeviceError(f"{whose} has no setting {name!r}.", has)
    return {name: parameter.check(settings.get(name, parameter.default)) for name, parameter in known.items()}
