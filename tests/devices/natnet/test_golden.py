"""Real packets: decoded to the last byte, equal to the vendor's own decoding, encoded back bit for bit."""

from __future__ import annotations

import random
from collections import Counter
from decimal import ROUND_HALF_UP, Decimal

import numpy as np
import pytest

from core.errors import FormatError
from devices.natnet import protocol
from devices.natnet.frames import decode_frame, detect_version, encode_frame
from devices.natnet.models import MarkerSetModel, RigidBodyModel, decode_models, encode_models
from devices.natnet.protocol import Message
from devices.natnet.records import FrameOfData, MarkerFlag
from tests.devices.natnet.capture import GOLDEN, printout, traffic
from tests.some import some

V3 = (3, 0)
CLOCK_HZ = 3312787


def decode(packet: bytes) -> object:
    """Any message of a 3.0 conversation."""
    message, payload = protocol.unpack(packet)
    match message:
        case Message.CONNECT | Message.DISCOVERY:
            return protocol.decode_connect(payload)
        case Message.SERVERINFO:
            return protocol.decode_server_info(payload)
        case Message.REQUEST:
            return protocol.decode_request(payload)
        case Message.RESPONSE | Message.UNRECOGNIZED_REQUEST | Message.REQUEST_MODELDEF:
            return payload
        case Message.MODELDEF:
            return decode_models(payload, V3)
        case Message.FRAMEOFDATA:
            return decode_frame(payload, V3)
        case Message.ECHOREQUEST:
            return protocol.decode_echo_request(payload)
        case Message.ECHORESPONSE:
            return protocol.decode_echo_response(payload)
    raise AssertionError(f"message {message} is not in the captures")


PACKETS = {path.name: path.read_bytes() for path in sorted(GOLDEN.glob("*.bin"))}


@pytest.fixture(scope="module")
def frames() -> dict[int, bytes]:
    """Payloads of all captured frames by number."""
    packets = [protocol.unpack(captured.data) for captured in traffic()]
    found = {decode_frame(p, V3).number: p for message, p in packets if message == Message.FRAMEOFDATA}
    assert len(found) == 518
    return found


def test_every_captured_packet_decodes_with_no_byte_left_over() -> None:
    counted = Counter(protocol.unpack(captured.data)[0] for captured in traffic())
    assert counted == {
        Message.DISCOVERY: 1,
        Message.CONNECT: 1,
        Message.SERVERINFO: 2,
        Message.REQUEST: 4,
        Message.RESPONSE: 3,
        Message.UNRECOGNIZED_REQUEST: 1,
        Message.REQUEST_MODELDEF: 1,
        Message.MODELDEF: 1,
        Message.ECHOREQUEST: 9,
        Message.ECHORESPONSE: 9,
        Message.FRAMEOFDATA: 518,
    }
    for captured in traffic():
        decode(captured.data)


def test_frames_equal_the_vendors_printout(frames: dict[int, bytes], capsys: pytest.CaptureFixture[str]) -> None:
    """Every figure the vendor's SampleClient printed, by its own formatting, frame by frame."""
    printed = printout()
    assert [p.number for p in printed] == list(range(162734, 162734 + 251))
    for expected in printed:
        frame = decode_frame(frames[expected.number], V3)
        assert two_decimals(frame.timestamp_s) == expected.timestamp
        assert two_decimals(1000 * frame.software_delay_s(CLOCK_HZ)) == expected.software_ms
        assert two_decimals(1000 * frame.system_latency_s(CLOCK_HZ)) == expected.system_ms
        assert timecode(frame) == expected.timecode
        assert [texts(point) for point in frame.unlabelled] == expected.others
        assert [body_texts(pose) for pose in frame.rigid_bodies.poses] == expected.bodies
        assert [labelled_texts(marker) for marker in frame.labelled] == expected.labelled
        assert expected.counts == {
            "Other Markers": len(frame.unlabelled),
            "Rigid Bodies": len(frame.rigid_bodies.poses),
            "Skeletons": len(frame.skeletons),
            "Labeled Markers": len(frame.labelled),
            "Force Plate": len(frame.force_plates),
            "Device": len(frame.devices),
        }
    with capsys.disabled():
        print(
            f"\n{len(frames)} frames decoded, the {len(printed)} that the vendor's client printed compared: all equal"
        )


def two_decimals(value: float) -> str:
    """As the vendor's C library prints: from 17 digits, ties away from zero."""
    return str(Decimal(f"{value:.17g}").quantize(Decimal("0.01"), ROUND_HALF_UP))


def texts(values: np.ndarray) -> tuple[str, ...]:
    return tuple(two_decimals(value) for value in values.tolist())


def body_texts(pose: np.void) -> tuple[str, ...]:
    head = (str(pose["id"]), two_decimals(float(pose["error"])), str(pose["params"] & 1))
    return head + texts(pose["position"]) + texts(pose["orientation_xyzw"])


def labelled_texts(marker: np.void) -> tuple[str, ...]:
    flags = MarkerFlag(int(marker["params"]))
    bits = (MarkerFlag.OCCLUDED, MarkerFlag.POINT_CLOUD_SOLVED, MarkerFlag.MODEL_SOLVED)
    identity = int(marker["id"])
    return (
        str(identity >> 16),
        str(identity & 0xFFFF),
        *(str(int(bit in flags)) for bit in bits),
        two_decimals(float(marker["size"])),
        *texts(marker["position"]),
    )


def timecode(frame: FrameOfData) -> str:
    hours, minutes, seconds, images = frame.timecode.to_bytes(4, "big")
    return f"{hours:02d}:{minutes:02d}:{seconds:02d}:{images:02d}.{frame.timecode_subframe}"


def test_anchors(frames: dict[int, bytes]) -> None:
    frame = decode_frame(frames[162734], V3)
    assert frame.timestamp_s == 1356.1166666666666
    assert f"{1000 * frame.system_latency_s(CLOCK_HZ):.2f}" == "5.50"
    assert f"{1000 * frame.software_delay_s(CLOCK_HZ):.2f}" == "0.88"
    pose = frame.rigid_bodies.poses[0]
    assert pose["id"] == 2
    assert np.array_equal(pose["position"], np.float32([0.17444664, 1.44713140, -0.73430401]))
    assert sorted(frames) == list(range(162734, 162734 + 518))


def test_frames_encode_back_bit_for_bit(frames: dict[int, bytes]) -> None:
    for payload in some(frames.values()):
        assert encode_frame(decode_frame(payload, V3), V3) == payload


def test_only_one_layout_fits_each_frame(frames: dict[int, bytes]) -> None:
    assert {detect_version(payload) for payload in frames.values()} == {V3}


def test_conversation_encodes_back() -> None:
    """Bit for bit, but for the memory of the server that follows a name."""
    for captured in some(traffic()):
        message, payload = protocol.unpack(captured.data)
        match message:
            case Message.CONNECT | Message.DISCOVERY:
                assert protocol.decode_connect(payload).encode() == payload
            case Message.SERVERINFO:
                encoded = protocol.decode_server_info(payload).encode()
                assert len(encoded) == len(payload)
                assert encoded[:7] == payload[:7] == b"Motive\0"
                assert encoded[256:] == payload[256:]
            case Message.REQUEST:
                # The vendor's client sends an internal command with bytes behind its end.
                assert payload.startswith(protocol.encode_request(protocol.decode_request(payload)))
            case Message.MODELDEF:
                assert encode_models(decode_models(payload, V3), V3) == payload
            case Message.ECHOREQUEST:
                assert protocol.encode_echo_request(protocol.decode_echo_request(payload)) == payload
            case Message.ECHORESPONSE:
                assert protocol.encode_echo_response(*protocol.decode_echo_response(payload)) == payload
        assert protocol.pack(message, payload) == captured.data


def test_single_packets() -> None:
    info = protocol.decode_server_info(protocol.unpack(PACKETS["serverinfo_packet_v3.bin"])[1])
    assert (info.sender.name, info.sender.app_version, info.sender.version) == ("Motive", (2, 1, 0, 0), V3)
    assert (info.clock_hz, info.data_port, info.multicast, info.group) == (CLOCK_HZ, 1511, True, "239.255.42.99")

    models = decode_models(protocol.unpack(PACKETS["modeldef_packet_v3.bin"])[1], V3)
    body, body_set, all_set = models
    assert isinstance(body, RigidBodyModel)
    assert (body.name, body.id, body.parent_id, len(body.marker_positions)) == ("RaceQuad", 2, -1, 5)
    names = tuple(f"Marker{i}" for i in range(1, 6))
    assert body_set == MarkerSetModel("RaceQuad", names)
    assert all_set == MarkerSetModel("all", tuple(f"RaceQuad_{i}" for i in range(1, 6)))

    hidden = decode_frame(protocol.unpack(PACKETS["mocapframe_packet_occluded_v3.bin"])[1], V3)
    assert [s.name for s in hidden.marker_sets] == ["FakeTree", "all"]
    assert (hidden.labelled["params"] & MarkerFlag.OCCLUDED).tolist() == [1, 0, 0, 0]
    assert hidden.labelled["id"].tolist() == [(7 << 16) + i for i in (2, 3, 4, 5)]
    assert encode_frame(hidden, V3) == protocol.unpack(PACKETS["mocapframe_packet_occluded_v3.bin"])[1]


@pytest.mark.parametrize("name", PACKETS)
def test_every_truncated_packet_raises_the_one_error(name: str) -> None:
    packet = PACKETS[name]
    decode(packet)
    for n in some(range(len(packet))):
        with pytest.raises(FormatError):
            decode(packet[:n])


def test_every_truncated_capture_raises_the_one_error() -> None:
    """Prefixes of every captured packet; of frames also where the header would not tell."""
    for captured in some(traffic()):
        for n in some(range(len(captured.data))):
            with pytest.raises(FormatError):
                protocol.unpack(captured.data[:n])


def test_every_truncated_frame_payload_raises_the_one_error(frames: dict[int, bytes]) -> None:
    for payload in some(list(frames.values())[::20]):
        for n in some(range(len(payload))):
            with pytest.raises(FormatError):
                decode_frame(payload[:n], V3)
    models = protocol.unpack(PACKETS["modeldef_packet_v3.bin"])[1]
    for n in some(range(len(models))):
        with pytest.raises(FormatError):
            decode_models(models[:n], V3)


def test_corrupted_packets_decode_or_raise_the_one_error() -> None:
    chance = random.Random(20240607)
    packets = list(PACKETS.values())
    refused = 0
    for _ in range(20_000):
        packet = bytearray(chance.choice(packets))
        for _ in range(chance.choice((1, 1, 2, 8, 64))):
            packet[chance.randrange(2, len(packet)) if len(packet) > 4 else 2] = chance.choice(
                (0, 1, 0x7F, 0x80, 0xFF, chance.randrange(256))
            )
        try:
            decode(bytes(packet))
        except FormatError:
            refused += 1
    assert 0 < refused < 20_000
