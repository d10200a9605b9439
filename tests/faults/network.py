"""What comes over the network: noise, strangers, and a process that was asleep while frames came."""

from __future__ import annotations

import random
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from core.errors import PhalanxError
from core.takes.reader import open_take
from devices.natnet import protocol
from devices.natnet.frames import encode_frame
from devices.natnet.protocol import Message, Sender, ServerInfo
from devices.natnet.records import LABELLED, FrameOfData
from devices.natnet.simulator import NatNetSimulator
from tests.data import ROOT
from tests.faults.fault import Fault, Outcome
from tests.faults.stage import Running, frames_in, recordings, served, until, wrong_in, wrong_sealed

NOISE_HZ, NOISE_S = 20_000, 8.0
ASLEEP_S = 14.0
SPOOF_S = 4.0


def _folders(tries: int, folder: Path) -> list[Path]:
    made = [folder / f"try{i + 1}" for i in range(tries)]
    for place in made:
        place.mkdir()
    return made


def _only_client(server: NatNetSimulator) -> tuple[str, int]:
    until(lambda: server.clients, "a client")
    (client,) = server.clients
    return client


def noise(tries: int, folder: Path) -> Outcome:
    """Packets of chance at the client's own port, by a process of its own."""
    outcome, sent, lost = Outcome(), 0, 0
    for place in _folders(tries, folder):
        with served() as server, recordings(place, server, 1) as (running,):
            port = _only_client(server)[1]
            command = [sys.executable, "-m", "tests.faults.network", str(port), str(NOISE_HZ), str(NOISE_S)]
            done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=True)
            sent += int(done.stdout)
            running.end()
            outcome.count(wrong_sealed(running.take, gaps=True) or _wrong_count(running))
            lost += running.figures.get("lost", 0)
            outcome.said = running.said("not understood") or running.out.partition("; ")[2].partition("\n")[0]
    rate = sent / (NOISE_S * tries)
    outcome.lost = (
        f"{lost} frames, counted ({rate:,.0f} packets a second)" if lost else f"nothing ({rate:,.0f} a second)"
    )
    return outcome


def _wrong_count(running: Running) -> str:
    """Frames that are missing between the first and the last must be those that are said to be lost."""
    with open_take(running.take) as take:
        numbers = np.array([frame.sequence for frame in take.raw])
        said = take.counts.lost if take.counts else 0
    missing = int((np.diff(numbers) - 1).sum())
    return "" if missing <= said else f"{missing} frames are missing, {said} are said to be"


def asleep(tries: int, folder: Path) -> Outcome:
    """The process stands still, as a laptop does whose lid is closed or a machine that swaps, and goes on."""
    outcome, lost, untimed = Outcome(), 0, 0
    for place in _folders(tries, folder):
        with served() as server, recordings(place, server, 1) as (running,):
            running.process.send_signal(signal.SIGSTOP)
            before = frames_in(running.take)
            time.sleep(ASLEEP_S)
            woke = server.sent
            running.process.send_signal(signal.SIGCONT)
            until(lambda one=running, n=woke: _last_in(one.take) > n + 60, "frames of after the sleep")
            running.end()
            outcome.count(wrong_sealed(running.take, before + 60, gaps=True, untimed=True))
            lost += running.figures.get("lost", 0)
            untimed += running.figures.get("untimed", 0)
            outcome.said = running.said("stood still") or running.said("lost")
    outcome.lost = f"{lost:,} frames that the system did not keep, counted" if lost else "nothing"
    if untimed:
        outcome.lost += f"; the times of {untimed:,}, marked as unknown"
    return outcome


def _last_in(path: Path) -> int:
    """The number of the last frame of a take; -1 if there is none."""
    try:
        with open_take(path) as take:
            return take.raw[-1].sequence if len(take.raw) else -1
    except PhalanxError:
        return -1


def spoofed(tries: int, folder: Path) -> Outcome:
    """Packets of others, well formed: answers nobody asked for, another server's introduction, its frames."""
    outcome = Outcome()
    for place in _folders(tries, folder):
        with served() as server, recordings(place, server, 1) as (running,):
            client = _only_client(server)
            stop = threading.Event()
            strangers = [
                threading.Thread(target=_stranger, args=(address, client, server, stop))
                for address in ("127.0.0.1", "127.0.0.2")
            ]
            for stranger in strangers:
                stranger.start()
            time.sleep(SPOOF_S)
            stop.set()
            for stranger in strangers:
                stranger.join()
            time.sleep(0.5)
            running.end()
            outcome.count(_wrong_spoofed(running))
            outcome.said = outcome.said or running.said("another") or running.said()
    return outcome


def _wrong_spoofed(running: Running) -> str:
    with open_take(running.take) as take:
        wrong = wrong_in(take)  # bit for bit what the true server sent, and no frame more or less
        title = take.info.device.get("title", "")
    if not wrong and "Stranger" in title + running.out:
        wrong = f"the device is called {title}"
    return wrong or wrong_sealed(running.take)


def _stranger(address: str, client: tuple[str, int], server: NatNetSimulator, stop: threading.Event) -> None:
    """All that a well-formed packet can say, over and over."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.bind((address, 0))
        sender = Sender("Stranger", (9, 9, 0, 0), (4, 1, 0, 0))
        info = ServerInfo(sender, 1000, server.data_port + 1, False, server.group)
        packets: list[Callable[[], bytes]] = [
            lambda: protocol.pack(Message.RESPONSE, protocol.encode_float(25.4)),
            lambda: protocol.pack(Message.RESPONSE, protocol.encode_int(2)),
            lambda: protocol.pack(Message.RESPONSE, protocol.encode_float(13.0)),
            lambda: protocol.pack(Message.RESPONSE, b"Bitstream,3.0.0.0\0"),
            lambda: protocol.pack(Message.SERVERINFO, info.encode()),
            lambda: protocol.pack(Message.MODELDEF, struct.pack("<i", 0)),
            lambda: protocol.pack(Message.ECHORESPONSE, protocol.encode_echo_response(1, 1)),
            lambda: _frame(server.sent + 2),
        ]
        while not stop.wait(0.01):
            for packet in packets:
                with suppress(OSError):
                    out.sendto(packet(), client)


def _frame(number: int) -> bytes:
    """A frame of a second server: one point far off, and a clock that runs elsewhere."""
    points = np.zeros(1, LABELLED)
    points["position"] = (9.0, 9.0, 9.0)
    template = FrameOfData(number=number, labelled=points, timestamp_s=1.0, mid_exposure_ticks=5, transmit_ticks=7)
    return protocol.pack(Message.FRAMEOFDATA, encode_frame(replace(template), (4, 1)))


def main(port: int, rate_hz: float, seconds: float) -> None:
    """Sends noise to a port of this machine, and prints how many packets."""
    chance, sent, began = random.Random(3), 0, time.perf_counter()
    some = [chance.randbytes(chance.randint(0, 1400)) for _ in range(200)]
    some += [struct.pack("<HH", chance.randint(0, 20), len(body)) + body for body in some]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        while (elapsed := time.perf_counter() - began) < seconds:
            while sent < elapsed * rate_hz:
                with suppress(OSError):
                    out.sendto(some[sent % len(some)], ("127.0.0.1", port))
                sent += 1
            time.sleep(0.0005)
    print(sent)


FAULTS = (
    Fault("noise", "20,000 packets of noise a second at the port that frames come to", 1, noise, alone=True),
    Fault("spoofed", "packets that pretend to be of the server", 1, spoofed, alone=True),
    Fault("asleep", f"the program stands still for {ASLEEP_S:.0f} s while frames come", 1, asleep, alone=True),
)

if __name__ == "__main__":
    main(int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3]))
