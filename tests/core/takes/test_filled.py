"""Which numbers of a pose are a gap's curve, in a take: read by older programs and newer ones."""

from __future__ import annotations

import zlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from core.errors import FormatError
from core.frames import TrackedFrame
from core.takes.codec import decode_solved, encode_solved
from core.takes.schemas import descriptor_set, message_class
from tests.core.takes.frames import bits, tracked_frame


def frame(filled: np.ndarray) -> TrackedFrame:
    made = next(made for made in map(tracked_frame, map(np.random.default_rng, range(9))) if made.hands)
    return replace(made, hands=(replace(made.hands[0], filled=filled),))


def older_class() -> Any:
    """SolvedFrame as a program knows it that was made before the field."""
    files = descriptor_pb2.FileDescriptorSet.FromString(descriptor_set())
    (hand,) = [message for message in files.file[0].message_type if message.name == "Hand"]
    (field,) = [field for field in hand.field if field.name == "filled"]
    hand.field.remove(field)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(files.file[0])
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("phalanx.take.SolvedFrame"))


def test_what_is_filled_survives_and_nothing_takes_no_room() -> None:
    some = np.isin(np.arange(26), [0, 7, 25])
    (read,) = decode_solved(encode_solved(frame(some))).hands
    np.testing.assert_array_equal(read.filled, some)
    none, nothing = (
        encode_solved(frame(np.zeros(26, dtype=np.bool_))),
        encode_solved(frame(np.zeros(0, dtype=np.bool_))),
    )
    assert none == nothing
    assert len(encode_solved(frame(some))) == len(none) + 2 + 1 + 3
    assert decode_solved(none).hands[0].filled.shape == (0,)


def test_an_older_program_reads_all_the_rest() -> None:
    filled, plain = frame(np.arange(26) < 9), frame(np.zeros(0, dtype=np.bool_))
    older = older_class().FromString(encode_solved(filled))
    (hand,) = older.hands
    assert "filled" not in type(hand).DESCRIPTOR.fields_by_name
    assert bits(np.array(hand.theta_rad)) == bits(plain.hands[0].theta_rad)
    older.DiscardUnknownFields()
    older.ClearField("crc32")
    body = older.SerializeToString()
    again = decode_solved(body + b"\x7d" + zlib.crc32(body).to_bytes(4, "little"))
    assert bits(again) == bits(decode_solved(encode_solved(plain)))


@pytest.mark.parametrize("number", [26, 2**32 - 1])
def test_a_number_that_no_pose_has_is_refused(number: int) -> None:
    message = message_class("SolvedFrame").FromString(encode_solved(frame(np.zeros(0, dtype=np.bool_))))
    message.ClearField("crc32")
    message.hands[0].filled.append(number)
    body = message.SerializeToString()
    with pytest.raises(FormatError, match=f"holds {number} as filled"):
        decode_solved(body + b"\x7d" + zlib.crc32(body).to_bytes(4, "little"))
