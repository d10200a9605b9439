"""The device contract: settings are checked once, in one way, for every device."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pytest

from core.errors import DeviceError
from core.streams import Sample, StreamInfo
from devices.device import Description, Device, Health, Parameter, RemoteCommand, Value
from devices.natnet.client import NatNetDevice
from devices.offers import Offers

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


def test_what_is_chosen_and_not_there_now_stays_valid() -> None:
    """A glove that is not plugged in keeps its port."""
    there = ["/dev/a", "/dev/b"]
    port = Parameter("port", "Port", "", choices=lambda: there)
    assert port.offered == ("/dev/a", "/dev/b") and port.fixed_choices == ()
    assert port.check("/dev/c") == "/dev/c"
    there.clear()
    assert port.offered == () and port.check("/dev/a") == "/dev/a"
    assert MODE.offered == MODE.fixed_choices == ("a", "b")


class Recorder(Device):
    """A system that records when it is asked to."""

    kind, title, parameters = "recorder", "Recorder", (PORT,)
    can = (
        RemoteCommand("record", "Start recording", (Parameter("take", "Name of the take", "take1"),)),
        RemoteCommand("stop", "Stop recording"),
    )

    def __init__(self, **settings: object) -> None:
        super().__init__(**settings)
        self.asked: list[tuple[str, Mapping[str, Value]]] = []

    def open(self) -> None: ...

    def start(self) -> None: ...

    def stop(self) -> None: ...

    def close(self) -> None: ...

    def streams(self) -> tuple[StreamInfo, ...]:
        return ()

    def read(self, timeout_s: float) -> Sample | None:
        return None

    def describe(self) -> Description:
        return Description(self.title)

    def health(self) -> Health:
        return Health(received=3)

    def _command(self, name: str, settings: Mapping[str, Value]) -> None:
        self.asked.append((name, settings))


def test_a_command_is_sent_with_all_its_settings() -> None:
    device = Recorder()
    device.command("record", take="walk")
    device.command("record")
    device.command("stop")
    assert device.asked == [("record", {"take": "walk"}), ("record", {"take": "take1"}), ("stop", {})]


def test_a_command_that_a_system_cannot_take_is_refused_with_those_that_it_can() -> None:
    device = Recorder()
    with pytest.raises(DeviceError, match=r"Recorder cannot be asked to 'play' from here. It can record, stop"):
        device.command("play")
    with pytest.raises(DeviceError, match=r"Start recording has no setting 'name'. It has take."):
        device.command("record", name="walk")
    assert device.asked == []
    with pytest.raises(DeviceError, match=r"OptiTrack \(NatNet\) cannot be asked to 'record' from here. Do it at"):
        NatNetDevice().command("record")
    assert NatNetDevice.can == ()


def test_a_device_of_one_stream_that_offers_nothing_says_so_by_default() -> None:
    device = Recorder()
    assert device.stream_health("markers") == device.health()
    assert device.offers() == Offers() and (device.offers().props, device.offers().leds) == ((), ())


def test_every_setting_has_its_default_and_help() -> None:
    device = NatNetDevice()
    assert device.settings == {parameter.name: parameter.default for parameter in NatNetDevice.parameters}
    assert all(parameter.help for parameter in NatNetDevice.parameters)
