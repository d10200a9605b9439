"""Reads the golden captures: UDP datagrams of a pcapng file, and what the vendor's client printed of them."""

from __future__ import annotations

import gzip
import re
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

GOLDEN = Path(__file__).parents[2] / "golden" / "natnet"


class Captured(NamedTuple):
    time_s: float
    source: tuple[str, int]
    destination: tuple[str, int]
    data: bytes


def read_pcapng(path: Path) -> list[Captured]:
    """UDP over IPv4 over Ethernet, unfragmented, little-endian sections, microseconds: what the capture holds."""
    raw = path.read_bytes()
    found = []
    at = 0
    while at < len(raw):
        kind, length = struct.unpack_from("<II", raw, at)
        if kind == 6:
            _, high, low, captured, original = struct.unpack_from("<IIIII", raw, at + 8)
            assert captured == original
            packet = raw[at + 28 : at + 28 + captured]
            assert packet[12:14] == b"\x08\x00"
            ip = packet[14:]
            header = (ip[0] & 15) * 4
            flags_and_fragment = struct.unpack_from(">H", ip, 6)[0]
            assert not flags_and_fragment & 0x3FFF
            assert ip[9] == 17
            source_port, destination_port, udp_length = struct.unpack_from(">HHH", ip, header)
            found.append(
                Captured(
                    ((high << 32) + low) * 1e-6,
                    (".".join(map(str, ip[12:16])), source_port),
                    (".".join(map(str, ip[16:20])), destination_port),
                    ip[header + 8 : header + udp_length],
                )
            )
        at += length
    return found


def traffic() -> list[Captured]:
    return read_pcapng(GOLDEN / "traffic.pcapng")


@dataclass
class Printed:
    """One frame as the vendor's SampleClient printed it: text, by its two decimals."""

    number: int
    timestamp: str = ""
    software_ms: str = ""
    system_ms: str = ""
    timecode: str = ""
    others: list[tuple[str, ...]] = field(default_factory=list)
    bodies: list[tuple[str, ...]] = field(default_factory=list)
    labelled: list[tuple[str, ...]] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)


_BODY = re.compile(r"Rigid Body \[ID=(\d+)  Error=(\S+)  Valid=(\d)\]")
_POSE = re.compile(r"\t" + r"\t".join([r"(-?\d+\.\d\d)"] * 7) + "$")
_OTHER = re.compile(r"Other Marker (\d+) : (\S+)\t(\S+)\t(\S+)")
_LABELLED = re.compile(
    r"Labeled Marker \[ModelID=(\d+), MarkerID=(\d+), Occluded=(\d), PCSolved=(\d), ModelSolved=(\d)\] "
    r"\[size=(\S+)\] \[pos=([^,]+),([^,]+),([^\]]+)\]"
)
_COUNT = re.compile(r"(Other Markers|Rigid Bodies|Skeletons|Labeled Markers|Force Plate|Device) \[Count=(\d+)\]")


def printout() -> list[Printed]:
    """Every frame of the printout. Lines of the console that fell between them are none of a frame."""
    text = gzip.decompress((GOLDEN / "SampleClient_output.txt.gz").read_bytes()).decode()
    frames: list[Printed] = []
    for line in text.splitlines():
        if line.startswith("FrameID : "):
            frames.append(Printed(int(line[10:])))
            continue
        if not frames:
            continue
        frame = frames[-1]
        name, _, value = line.partition(" : ")
        if name == "Timestamp":
            frame.timestamp = value
        elif name == "Software latency":
            frame.software_ms = value.split()[0]
        elif name == "System latency":
            frame.system_ms = value.split()[0]
        elif name == "Timecode":
            frame.timecode = value
        elif match := _OTHER.match(line):
            assert int(match[1]) == len(frame.others)
            frame.others.append(match.groups()[1:])
        elif match := _BODY.match(line):
            frame.bodies.append(match.groups())
        elif match := _POSE.match(line):
            frame.bodies[-1] += match.groups()
        elif match := _LABELLED.match(line):
            frame.labelled.append(match.groups())
        elif match := _COUNT.match(line):
            frame.counts[match[1]] = int(match[2])
    return frames
