"""The contract of simulators, as the command and the demo use it: they know no kind."""

from __future__ import annotations

import pytest

from app.device_kinds import KINDS, SIMULATED, device_class, simulator_class
from core.errors import DeviceError
from tests.devices.natnet.streams import make_frames, next_frame

FRAMES = {"markers": make_frames(50)}


@pytest.mark.parametrize("kind", SIMULATED)
def test_a_device_is_opened_by_the_settings_that_its_simulator_tells(kind: str) -> None:
    simulated = simulator_class(kind)
    frames = FRAMES[simulated.what]
    with simulated.of(frames, 200.0, simulated.anywhere, name="Somebody") as simulator:
        assert simulator.place and simulator.audience
        device = device_class(kind)(**simulator.settings)
        device.open()
        try:
            assert [info.what for info in device.streams()] == [simulated.what]
            assert "Somebody" in device.describe().title
            device.start()
            simulator.start()
            got = []
            while len(got) < len(frames) and (frame := next_frame(device, 20.0)) is not None:
                got.append(frame.sequence)
            assert got == [frame.sequence for frame in frames]
            assert simulator.wait(20)
            assert (simulator.sent, simulator.unsent, simulator.finished, simulator.error) == (50, 0, True, None)
        finally:
            device.close()


@pytest.mark.parametrize("kind", SIMULATED)
def test_settings_are_checked_as_those_of_a_device(kind: str) -> None:
    simulated = simulator_class(kind)
    with pytest.raises(DeviceError, match="has no setting 'colour'"):
        simulated.of([], 100.0, {"colour": "blue"})
    assert set(simulated.anywhere) <= {parameter.name for parameter in simulated.parameters}
    assert all(parameter.help for parameter in simulated.parameters)
    with pytest.raises(DeviceError, match="rate of 0"):
        simulated.of([], 0.0, simulated.anywhere)


def test_what_is_simulated_is_a_kind_of_device() -> None:
    assert set(SIMULATED) < set(KINDS)
    with pytest.raises(DeviceError, match=r"Device 'playback' cannot be simulated. Choose natnet"):
        simulator_class("playback")
