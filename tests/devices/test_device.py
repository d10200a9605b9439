"""The device contract: settings are checked once, in one way, for every device."""

from __future__ import annotations

import math

import pytest

from core.errors import DeviceError
from devices.device import Parameter
from devices.natnet.client import NatNetDevice

PORT = Parameter("port", "Port", 1510, minimum=1, maximum=65535, help="As in the server.")
SPEED = Parameter("speed", "Speed", 1.0, "x", 0.05, 20.0)
LOOP = Parameter("loop", "Loop", False)
MODE = Parameter("mode", "Mode", "a", choices=("a", "b"))


@pytest.mark.parametrize(
    ("parameter", "given", "expected"),
    [
        (PORT, "1511", 1511),
        (PORT, 1512.0, 1512),
        (SPEED, "2", 2.0),
        (LOOP, "on", True),
        (LOOP, "No", False),
        (LOOP, True, True),
        (MODE, "b", "b"),
    ],
)
def test_values_become_the_type_of_the_default(parameter: Parameter, given: object, expected: object) -> None:
    value = parameter.check(given)
    assert value == expected
    assert type(value) is type(parameter.default)


@pytest.mark.parametrize(
    ("parameter", "given", "said"),
    [
        (PORT, "ten", "Port: 'ten' is not valid"),
        (PORT, 15.5, "Port: 15.5 is not valid .a whole number is needed"),
        (PORT, math.inf, "Port: inf is not valid"),
        (PORT, None, "Port: None is not valid"),
        (PORT, 0, "Port: 0 is out of range. Choose 1 to 65535"),
        (SPEED, 21, "Speed: 21.0 x is out of range. Choose 0.05 to 20 x."),
        (SPEED, math.nan, "Speed: nan x is out of range"),
        (LOOP, "maybe", "'maybe' is neither true nor false"),
        (MODE, "c", "Mode: 'c' is not known. Choose a, b."),
    ],
)
def test_what_is_wrong_is_said_with_the_value_and_the_range(parameter: Parameter, given: object, said: str) -> None:
    with pytest.raises(DeviceError, match=said):
        parameter.check(given)


def test_unknown_settings_are_refused_by_name() -> None:
    with pytest.raises(DeviceError, match=r"OptiTrack \(NatNet\) has no setting 'adress'\. It has server, local"):
        NatNetDevice(adress="127.0.0.1")


def test_every_setting_has_its_default_and_help() -> None:
    device = NatNetDevice()
    assert device.settings == {parameter.name: parameter.default for parameter in NatNetDevice.parameters}
    assert all(parameter.help for parameter in NatNetDevice.parameters)
