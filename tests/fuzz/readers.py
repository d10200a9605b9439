"""The one list of everything that reads a file or a packet from outside. `test_every_reader.py` holds it complete."""

from __future__ import annotations

import argparse
import contextlib
import os
import shutil
import socket
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from app import run_record
from app.commands import file_list, info, verify
from app.left_behind import run_file
from app.left_behind.cut_takes import cut_takes
from app.played_file import open_played
from app.settings import Settings
from core.calibration.goniometer import read_angles
from core.errors import PhalanxError
from core.hand.imports.load import load_hand
from core.labelling.network import network_at
from core.markers.layout import load_layout
from core.motion.subspace import load_subspace
from core.profile import load_profile, save_profile
from core.props.prop import load_prop
from core.takes.export import record as export_record
from core.takes.reader import open_take
from core.takes.recover import recover
from core.training.labelled import read_labelled
from devices.natnet import models, protocol
from devices.natnet.client import NatNetDevice
from devices.natnet.frames import LAYOUTS, decode_frame, detect_version
from devices.natnet.protocol import Message
from tests.fuzz import samples
from tests.fuzz.containers import datagrams_of, datagrams_spoilt, glb_spoilt, npz_spoilt
from tests.fuzz.json_mutations import content_spoilt
from tests.fuzz.mutations import BYTES, TEXT, Mutation
from tests.fuzz.take_mutations import crafted

JSON: tuple[Mutation, ...] = (content_spoilt, content_spoilt, content_spoilt, *TEXT)


@dataclass(frozen=True)
class Reader:
    """Something that reads.

    read: a file of this suffix; raises PhalanxError where it is not what it should be, and nothing else. samples: sound
    files. mutations: how they are spoilt. covers: the functions, module and name, through which bytes come in.
    """

    name: str
    suffix: str
    read: Callable[[Path], object]
    samples: Callable[[], Sequence[bytes]]
    mutations: Sequence[Mutation]
    covers: tuple[str, ...]


def _told(path: Path) -> None:
    """What `info` and `verify` say of a file: both read all of it."""
    arguments = argparse.Namespace(file=path, json=False)
    refused = None
    for command in (info, verify):
        try:
            command.run(arguments)
        except PhalanxError as error:
            refused = error
    if refused is not None:
        raise refused


def _take(path: Path) -> None:
    """Opened and read to the end, told of, and recovered."""
    for read in (_told, _read_take, _recovered):
        with contextlib.suppress(PhalanxError):
            read(path)
    _read_take(path)


def _read_take(path: Path) -> None:
    with open_take(path) as take:
        for key, stream in take.streams.items():
            assert stream.info.key == key and take.holes_in(key) is not None
        for frames in take.topics.values():
            for i in range(len(frames)):
                with contextlib.suppress(PhalanxError):
                    frames[i]
        assert take.verdict is not None and take.span_s and take.account
        len(take.profiles)


def _recovered(path: Path) -> None:
    folder = path.parent / "recovered"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    try:
        recover(Path(shutil.copy(path, folder / path.name)))
    finally:
        shutil.rmtree(folder)


def _played(path: Path) -> None:
    """Opened as a device would play it, and all of it read."""
    played = open_played(path)
    try:
        for track in played.tracks:
            assert callable(track.records)
            for _ in track.records():
                pass
    finally:
        played.close()


def _profile(path: Path) -> None:
    save_profile(load_profile(path), path.with_suffix(".again"))


def _settings(path: Path) -> None:
    """Never a reason not to start: it raises nothing at all, and what it gives is of the kind asked for."""
    copy = Path(shutil.copy(path, path.with_name("settings.json")))
    settings = Settings(copy)
    for default in (True, 1, 0.5, "", [], {}):
        for name in ("take_folder", "view/names", "devices"):
            assert isinstance(settings.get(name, default), type(default))
    settings.set("take_folder", "elsewhere")


def _labelled(path: Path) -> None:
    read_labelled(path, load_layout("han19"))


def _run_record(path: Path) -> None:
    folder = path.parent / "result"
    folder.mkdir(exist_ok=True)
    shutil.copy(path, folder / run_record.NAME)
    record = run_record.read_record(folder)
    if record is not None:
        run_record.is_whole(record, folder, ("csv",), "", {})


def _left_run(path: Path) -> None:
    """What a process left that ended before it could say so, and the takes that it was recording."""
    folder = path.parent / "log"
    folder.mkdir(exist_ok=True)
    left = Path(shutil.copy(path, folder / f"{run_file.RUNNING}20260101-000000-1.txt"))
    os.utime(left, (0, 0))  # long ago
    (run,) = run_file.ended_runs(folder)
    cut_takes(folder, run.takes)


def _packet(path: Path) -> None:
    """By every decoder that could be asked to read it: which one is, the packet itself says."""
    message, payload = protocol.unpack(path.read_bytes())
    decoders: dict[int, tuple[Callable[[bytes], object], ...]] = {
        Message.FRAMEOFDATA: (detect_version, *(_with(decode_frame, version) for version in (*LAYOUTS, (4, 4)))),
        Message.MODELDEF: tuple(_with(models.decode_models, version) for version in (*LAYOUTS, (4, 4))),
        Message.SERVERINFO: (protocol.decode_server_info,),
        Message.CONNECT: (protocol.decode_connect,),
        Message.REQUEST: (protocol.decode_request,),
        Message.RESPONSE: (protocol.decode_float, protocol.decode_int, protocol.decode_bitstream),
        Message.ECHOREQUEST: (protocol.decode_echo_request,),
        Message.ECHORESPONSE: (protocol.decode_echo_response,),
    }
    refused, read = None, 0
    for decode in decoders.get(message, ()):
        try:
            decode(payload)
            read += 1
        except PhalanxError as error:
            refused = error
    if refused is not None and not read:
        raise refused


def _with(decode: Callable[..., object], version: tuple[int, int]) -> Callable[[bytes], object]:
    return lambda payload: decode(payload, version)


SERVER_INFO = protocol.pack(
    Message.SERVERINFO,
    protocol.ServerInfo(protocol.Sender("Motive", (3, 1, 0, 0), (4, 1, 0, 0)), 10**7, 1511, False).encode(),
)


def _conversation(path: Path) -> None:
    """Sent by the server of a device that is open and wants frames; then the device is asked how it is."""
    packets = datagrams_of(path.read_bytes())[:64]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
        server.bind(("127.0.0.1", 0))
        device = NatNetDevice(server="127.0.0.1", command_port=server.getsockname()[1], data_port=_free_port())
        done = threading.Event()
        client = _greeted(server, done)
        try:
            device.open()
            device.start()
            done.set()
            for packet in packets:
                server.sendto(packet[:65_000], client[0])
                device.read(0.001)
            end = time.monotonic() + 1.0
            while device.read(0.002) is not None and time.monotonic() < end:
                pass
            health, description = device.health(), device.describe()
            assert isinstance(health.heard + health.reason + health.last_error + description.title, str)
        finally:
            done.set()
            device.close()


def _greeted(server: socket.socket, done: threading.Event) -> list[tuple[str, int]]:
    """Answers what a client asks until `done`; where it asked from, once it has."""
    client: list[tuple[str, int]] = []
    answers = {
        Message.CONNECT: SERVER_INFO,
        Message.REQUEST: protocol.pack(Message.UNRECOGNIZED_REQUEST),
        Message.REQUEST_MODELDEF: protocol.pack(Message.MODELDEF, bytes(4)),
    }
    server.settimeout(0.01)

    def answer() -> None:
        while not done.is_set():
            with contextlib.suppress(TimeoutError, PhalanxError, ValueError):
                packet, address = server.recvfrom(65_535)
                client[:] = [address]
                message, payload = protocol.unpack(packet)
                if message == Message.ECHOREQUEST:
                    echo = protocol.encode_echo_response(
                        protocol.decode_echo_request(payload), time.monotonic_ns() // 100
                    )
                    server.sendto(protocol.pack(Message.ECHORESPONSE, echo), address)
                elif message in answers:
                    server.sendto(answers[Message(message)], address)

    threading.Thread(target=answer, daemon=True).start()
    return client


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _listed(path: Path) -> None:
    os.chdir(path.parent)
    file_list.files_of([f"@{path}"])


_FORMATS = "core.takes.formats."
_TEXT = "core.takes.formats.text.TextLines.__iter__"

READERS: tuple[Reader, ...] = (
    Reader("trc", ".trc", _told, samples.trc, TEXT, (_FORMATS + "trc.read", _TEXT)),
    Reader("c3d", ".c3d", _told, samples.c3d, BYTES, (_FORMATS + "c3d.read", _FORMATS + "c3d._read")),
    Reader("qualisys tsv", ".tsv", _told, samples.qualisys_tsv, TEXT, (_FORMATS + "qualisys_tsv.read", _TEXT)),
    Reader("motive csv", ".csv", _told, samples.motive_csv, TEXT, (_FORMATS + "motive_csv.read", _TEXT)),
    Reader("wide csv", ".csv", _told, samples.wide_csv, TEXT, (_FORMATS + "wide_csv.read", _TEXT)),
    Reader("points csv", ".csv", _told, samples.points_csv, TEXT, (_FORMATS + "points_csv.read", _TEXT)),
    Reader(
        "bvh", ".bvh", _played, samples.bvh, TEXT,
        (_FORMATS + "bvh.is_bvh", _FORMATS + "bvh.read_bvh", _TEXT),
    ),
    Reader("any recording", ".dat", _told, samples.recordings, TEXT, (_FORMATS + "detect.read_recording",)),
    Reader(
        "take", ".mcap", _take, samples.takes, BYTES,
        (_FORMATS + "take.read", _FORMATS + "take.is_take", "core.takes.records.TakeFile.__init__"),
    ),
    Reader("take, crafted", ".mcap", _take, samples.takes, (crafted,), ("core.takes.records.TakeFile.__init__",)),
    Reader("layout", ".json", load_layout, samples.layouts, JSON, ("core.markers.layout.load_layout",)),
    Reader(
        "profile", ".json", _profile, samples.profiles, JSON,
        ("core.profile.load_profile", "core.profile.Profile.from_json"),
    ),
    Reader("prop", ".json", load_prop, samples.props, JSON, ("core.props.prop.load_prop",)),
    Reader("subspace", ".json", load_subspace, samples.subspaces, JSON, ("core.motion.subspace.load_subspace",)),
    Reader("settings", ".json", _settings, samples.settings, JSON, ("app.settings._read",)),
    Reader("angles", ".csv", read_angles, samples.angles, TEXT, ("core.calibration.goniometer._text",)),
    Reader("list of files", ".txt", _listed, samples.file_lists, TEXT, ("app.commands.file_list._lines",)),
    Reader("run record", ".json", _run_record, samples.run_records, JSON, ("app.run_record.read_record",)),
    Reader("left run", ".txt", _left_run, samples.left_runs, TEXT, ("app.left_behind.run_file._text",)),
    Reader(
        "export record", ".json", export_record._known, samples.export_records, JSON,
        ("core.takes.export.record._known",),
    ),
    Reader(
        "labelled npz", ".npz", _labelled, samples.labelled, (npz_spoilt, npz_spoilt, *BYTES),
        ("core.training.labelled.read_labelled",),
    ),
    Reader(
        "mano", ".npz", load_hand, samples.mano, (npz_spoilt, npz_spoilt, *BYTES), ("core.hand.imports.mano.read_rig",),
    ),
    Reader(
        "gltf hand", ".glb", load_hand, samples.gltf_hands, (glb_spoilt, glb_spoilt, *BYTES),
        ("core.gltf.read_glb", "core.gltf.read_gltf"),
    ),
    Reader(
        "network", ".onnx", lambda path: network_at(str(path)), samples.networks, BYTES,
        ("core.labelling.network.network_bytes",),
    ),
    Reader(
        "natnet packet", ".bin", _packet, samples.packets, BYTES,
        (
            "devices.natnet.frames.decode_frame", "devices.natnet.models.decode_models",
            *(f"devices.natnet.protocol.decode_{what}" for what in (
                "connect", "server_info", "request", "float", "int", "bitstream", "echo_request", "echo_response",
            )),
        ),
    ),
    Reader("natnet server", ".bin", _conversation, samples.conversations, (datagrams_spoilt,), ()),
)  # fmt: skip

BY_NAME = {reader.name: reader for reader in READERS}
