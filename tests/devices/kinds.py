"""The kinds of device that there are, as the conformance suite sees them."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import cycle
from multiprocessing import resource_tracker
from pathlib import Path

import numpy as np

from app.demo import DemoDevice
from app.file_device import FileDevice
from core.profile import load_profile
from core.streams import ClockSample
from core.takes.take import StreamCounts, TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from devices.device import Device
from devices.natnet.client import NatNetDevice
from tests.core.takes import frames
from tests.devices.conformance import CHECKS, FILED, SERVED, Kind
from tests.devices.natnet.served import client, simulator
from tests.devices.natnet.streams import make_frames
from tests.devices.natnet.test_client_trouble import hostile_packets
from tests.fuzz.mutations import BYTES, TEXT, Mutation

RATE_HZ = 400.0


class NatNet(Kind):
    """A simulated Motive on free ports. Opening it takes a tenth of a second, for clocks to be compared."""

    beside = 5

    def __init__(self, folder: Path) -> None:
        self._ports = {"command_port": 0, "data_port": 0}
        self._before = 0

    def bring_back(self) -> None:
        self._server = simulator(make_frames(200, points=5), RATE_HZ, loop=True, **self._ports)
        self._server.start()
        self._ports = {"command_port": self._server.command_port, "data_port": self._server.data_port}

    def take_away(self) -> None:
        self._server.close()

    def device(self, ends: bool = False) -> NatNetDevice:
        return client(self._server)

    def broken(self) -> NatNetDevice:
        return client(self._server, local="192.0.2.1")  # of a network that nobody is on

    def pause(self) -> None:
        self._server.stop()

    def resume(self) -> None:
        self._before = self._server.sent
        self._server.start()

    @property
    def sent(self) -> int:
        return self._server.sent - self._before

    def spoil(self) -> int:
        packets = hostile_packets()
        assert self._server._data is not None
        for packet in packets:
            self._server._data.sendto(packet, self._server.clients[0])
        return len(packets)


class Played(Kind):
    """A file. write: makes it, with n frames in it. mutations: how a copy is spoilt."""

    def __init__(
        self, folder: Path, name: str, write: Callable[[Path], object], n: int, mutations: tuple[Mutation, ...]
    ) -> None:
        self._path, self._write, self._n, self._mutations = folder / name, write, n, mutations

    def bring_back(self) -> None:
        self._write(self._path)

    def take_away(self) -> None:
        self._path.unlink()

    def device(self, ends: bool = False) -> FileDevice:
        return FileDevice(file=str(self._path), speed=20.0, loop=not ends)

    def broken(self) -> FileDevice:
        return FileDevice(file=str(self._path.with_stem("none")))

    @property
    def sent(self) -> int:
        return self._n

    def spoilt(self) -> Iterator[Device]:
        chance, sound = random.Random(5), self._path.read_bytes()
        copy = self._path.with_stem("spoilt")
        for mutation, _ in zip(cycle(self._mutations), range(40), strict=False):
            copy.write_bytes(mutation(sound, chance))
            yield FileDevice(file=str(copy), speed=20.0)
        copy.write_bytes(sound[:20])
        yield FileDevice(file=str(copy))


def points_file(folder: Path) -> Played:
    def write(path: Path) -> None:
        rows = (f"{i},{i / 100},{k},0.{k + 1},0.2,0.3" for i in range(200) for k in range(3))
        path.write_text("\n".join(["frame,time_s,id,x_m,y_m,z_m", *rows]) + "\n", encoding="utf-8")

    return Played(folder, "walk.csv", write, 200, tuple(TEXT))


GLOVE = replace(frames.GLOVE, bone_names=("RightHand", "RightHandThumb1"))


def take_of_several(folder: Path) -> Played:
    """An optical system, a glove at half its rate, and the clock of the one compared now and then."""

    def write(path: Path) -> None:
        writer = TakeWriter(
            path, TakeInfo("take", rate_hz=120.0), load_profile("schroeder6"), (frames.OPTICAL, GLOVE),
            frames.OPTICAL.key,
        )  # fmt: skip
        rotations = np.tile([0.6, 0.8, 0.0, 0.0], (2, 1))
        for i in range(60):
            writer.raw(frames.OPTICAL.key, frames.plain_frame(i))
            if i % 2:
                bones = frames.plain_bones(i // 2, 2)
                writer.raw(GLOVE.key, replace(bones, bone_names=GLOVE.bone_names, rotations_wxyz=rotations))
            if i % 6 == 3:
                writer.raw(frames.OPTICAL.key, ClockSample(i / 120, 1000.001 + i / 120, 1e-4))
        writer.seal(TakeCounts(60, 60, others={GLOVE.key: StreamCounts(30, 30)}))

    return Played(folder, "take.mcap", write, 90, tuple(BYTES))


ARM = """HIERARCHY
ROOT RightHand
{
OFFSET 0 0 0
CHANNELS 6 Xposition Yposition Zposition Yrotation Xrotation Zrotation
JOINT RightHandThumb1
{
OFFSET 0 10 0
CHANNELS 3 Yrotation Xrotation Zrotation
End Site
{
OFFSET 0 2 0
}
}
}
MOTION
Frames: 200
Frame Time: 0.01
"""


def inertial_recording(folder: Path) -> Played:
    def write(path: Path) -> None:
        rows = (f"{i} 90 0 {i} {-i} 5 {0.5 * i} 10 {i}\n" for i in range(200))
        path.write_text(ARM + "".join(rows), encoding="utf-8")

    return Played(folder, "glove.bvh", write, 200, tuple(TEXT))


class Demo(Kind):
    """The built-in performer. It brings its own server, in a process, so that few rounds take long."""

    rounds = 1

    def __init__(self, folder: Path) -> None:
        pass

    def bring_back(self) -> None:
        resource_tracker.ensure_running()  # begins with the first process, and stays

    def take_away(self) -> None:
        pass

    def device(self, ends: bool = False) -> DemoDevice:
        return DemoDevice(bodies=0, ghosts=0.0)

    def broken(self) -> DemoDevice:
        device = self.device()
        device.settings["layout"] = "none"
        return device


Checks = tuple[Callable[[Kind], None], ...]

KINDS: dict[str, tuple[Callable[[Path], Kind], Checks]] = {
    "natnet": (NatNet, CHECKS + SERVED),
    "playback of points": (points_file, CHECKS + FILED),
    "playback of a take of several streams": (take_of_several, CHECKS + FILED),
    "playback of a glove": (inertial_recording, CHECKS + FILED),
    "demo": (Demo, CHECKS),
}
"""By what a test is called. A new kind of device comes here."""
