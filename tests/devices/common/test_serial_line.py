"""A serial line, on pairs of pseudo terminals: what a cable does to it."""

from __future__ import annotations

import os
import sys
import threading
import time
import tty
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from core.errors import DeviceError
from devices.common import serial_line
from devices.common.clock import host_clock
from devices.common.serial_line import MOST_BYTES, SerialLine, serial_ports

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="this system has no pseudo terminals")

PATIENCE_S = 30.0


class Plug:
    """The far end of a cable, and the name by which the port is found while it is plugged in."""

    def __init__(self, port: Path) -> None:
        self.port = port
        self.far = -1

    def put_in(self) -> None:
        self.far, near = os.openpty()
        tty.setraw(near)
        name = os.ttyname(near)
        self.port.symlink_to(name)
        self._near = near

    def handed_over(self) -> None:
        """Only the line holds it: until then it must be held here, or the terminal is gone."""
        os.close(self._near)

    def pull_out(self) -> None:
        self.port.unlink()
        os.close(self.far)


@pytest.fixture
def plug(tmp_path: Path) -> Iterator[Plug]:
    made = Plug(tmp_path / "port")
    made.put_in()
    yield made
    if made.port.is_symlink():
        made.pull_out()


@pytest.fixture
def line(plug: Plug) -> Iterator[SerialLine]:
    made = SerialLine(str(plug.port), 115_200)
    made.open()
    plug.handed_over()
    yield made
    made.close()


def until(done: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE_S
    while not done():
        assert time.monotonic() < end, "it never happened"


def taken(line: SerialLine, n: int) -> bytes:
    got = bytearray()

    def enough() -> bool:
        came = line.read(0.1)
        got.extend(came.data if came is not None else b"")
        return len(got) >= n

    until(enough)
    return bytes(got)


def test_bytes_come_through_both_ways(plug: Plug, line: SerialLine) -> None:
    before_s = host_clock()
    os.write(plug.far, bytes(range(256)))
    came = line.read(PATIENCE_S)
    assert came is not None
    assert before_s <= came.arrival_s <= host_clock() and came.slack_s == 0.0
    assert came.data + taken(line, 256 - len(came.data)) == bytes(range(256))
    assert line.write(b"\x00\xff\r\n")
    assert os.read(plug.far, 100) == b"\x00\xff\r\n"


def test_nothing_is_waited_for_beyond_its_time(line: SerialLine) -> None:
    assert line.read(0.0) is None
    before_s = host_clock()
    assert line.read(0.05) is None
    assert host_clock() - before_s >= 0.05
    assert (line.lost_since_s, line.reconnects, line.last_error) == (None, 0, "")


def test_what_waited_says_that_it_did(plug: Plug, line: SerialLine) -> None:
    """Nobody read for a while: when it came is known to that while only."""
    assert line.read(0.0) is None
    empty_s = host_clock()
    os.write(plug.far, b"early")
    time.sleep(0.4)
    came = line.read(1.0)
    assert came is not None and came.data == b"early"
    assert came.arrival_s - came.slack_s <= empty_s < came.arrival_s - 0.4


def test_it_is_held_alone(plug: Plug, line: SerialLine) -> None:
    with pytest.raises(DeviceError, match="port is held by another program"):
        SerialLine(str(plug.port), 9600).open()
    line.close()
    second = SerialLine(str(plug.port), 9600)
    second.open()
    os.write(plug.far, b"mine")
    assert taken(second, 4) == b"mine"
    second.close()


def test_unplugged_while_it_is_read_and_back_again(plug: Plug, line: SerialLine, monkeypatch) -> None:
    monkeypatch.setattr(serial_line, "REOPEN_S", 0.05)
    os.write(plug.far, b"before")
    assert taken(line, 6) == b"before"
    pulling = threading.Timer(0.1, plug.pull_out)
    pulling.start()
    until(lambda: line.read(0.2) is None and line.lost_since_s is not None)  # it waits as the plug is pulled
    pulling.join()
    assert "went away" in line.last_error and not line.write(b"?")
    lost_s = line.lost_since_s
    until(lambda: line.read(0.02) is None and "There is no serial port" in line.last_error)
    assert (line.lost_since_s, line.reconnects) == (lost_s, 0)
    plug.put_in()
    until(lambda: line.read(0.02) is None and line.lost_since_s is None)
    plug.handed_over()
    os.write(plug.far, b"after")
    assert taken(line, 5) == b"after"
    assert line.reconnects == 1


def test_a_reader_that_is_late_gets_all_in_parts_of_bounded_size(plug: Plug, line: SerialLine, monkeypatch) -> None:
    """The port's own buffer is full meanwhile, and the sender waits: nothing grows here."""
    monkeypatch.setattr(serial_line, "MOST_BYTES", 512)
    sent = bytes(i * i % 251 for i in range(200_000))

    def send() -> None:
        left = memoryview(sent)
        while left:
            left = left[os.write(plug.far, left) :]

    sender = threading.Thread(target=send)
    sender.start()
    time.sleep(0.2)
    got, sizes = bytearray(), []
    while len(got) < len(sent):
        came = line.read(PATIENCE_S)
        assert came is not None
        got += came.data
        sizes.append(len(came.data))
    sender.join()
    assert bytes(got) == sent
    assert max(sizes) == 512


def test_a_far_end_that_reads_nothing_holds_nobody_up(plug: Plug, line: SerialLine, monkeypatch) -> None:
    monkeypatch.setattr(serial_line, "WRITE_S", 0.1)
    line.open()
    assert not line.write(bytes(1 << 20))
    assert "takes no more bytes" in line.last_error and line.lost_since_s is None


def test_what_waited_before_the_start_can_be_thrown_away(plug: Plug, line: SerialLine) -> None:
    os.write(plug.far, bytes(1000))
    until(lambda: line.drain() is None and line.read(0.0) is None)
    os.write(plug.far, b"new")
    assert taken(line, 3) == b"new"


def test_a_port_that_is_not_there_is_said_with_those_that_are() -> None:
    with pytest.raises(DeviceError, match=r"There is no serial port /dev/nowhere\. Plug it in, or choose another\. "):
        SerialLine("/dev/nowhere", 9600).open()
    with pytest.raises(DeviceError, match="cannot be opened at 9600 baud"):
        SerialLine("nonsense://x", 9600).open()
    with pytest.raises(DeviceError, match="cannot be opened"):
        SerialLine("socket://127.0.0.1:1", 9600).open()
    assert all(isinstance(port, str) for port in serial_ports())


def test_one_that_is_closed_gives_nothing_and_may_be_closed_again(line: SerialLine) -> None:
    line.close()
    line.close()
    assert line.read(0.0) is None and not line.write(b"?")


def test_a_line_that_the_system_cannot_wait_for() -> None:
    """As on Windows: one byte is waited for, then what else is there comes with it."""
    line = SerialLine("loop://", 115_200)
    line.open()
    try:
        assert line.read(0.0) is None
        line.write(bytes(3000))
        came = line.read(PATIENCE_S)
        assert came is not None and 0 < len(came.data) <= MOST_BYTES
        assert len(came.data) + len(taken(line, 3000 - len(came.data))) == 3000
    finally:
        line.close()
