"""Frames of a take by number, read from the file when asked for."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from functools import lru_cache
from typing import Any, Generic, TypeVar, overload

import numpy as np
from mcap.opcode import Opcode

from core.errors import FormatError
from core.frames import FloatArray, IntArray
from core.takes.index import IN_FILE
from core.takes.records import MAX_CHUNK, MAX_MESSAGE, MESSAGE_HEAD, RECORD_HEAD, ChunkPlace, TakeFile, decompress

Frame = TypeVar("Frame", covariant=True)

_HEAD_SIZE = RECORD_HEAD.size + MESSAGE_HEAD.size
_CHUNKS_KEPT, _BYTES_KEPT = 16, 2 * MAX_CHUNK
"""Room for those of a take, and for two of the largest there may be: a raw and a solved frame are read in turn."""


class Store:
    """Messages of a take by place. Keeps the last few chunks unpacked, no more of them than memory has room for."""

    def __init__(self, file: TakeFile, chunks: Sequence[ChunkPlace]) -> None:
        self._file = file
        self._chunks = chunks
        largest = max((place.uncompressed_size for place in chunks), default=0)
        self._unpacked = lru_cache(min(_CHUNKS_KEPT, _BYTES_KEPT // max(largest, 1)))(self._unpack)

    def message(self, chunk: int, offset: int, until: int) -> tuple[bytes, bytes]:
        """(head, data) of the message record at a place, which must end by `until`, where the next begins: records that
        lie in each other would be unpacked without end. Raises FormatError and TakeError."""
        if chunk == IN_FILE:
            head = self._file.read(offset, _HEAD_SIZE)
            begin, end = 0, len(head)
        else:
            head = self._unpacked(chunk)
            begin, end = offset, len(head)
        if end - begin < _HEAD_SIZE:
            raise self._damaged(offset)
        opcode, length = RECORD_HEAD.unpack_from(head, begin)
        fits = MESSAGE_HEAD.size <= length <= MAX_MESSAGE and offset + RECORD_HEAD.size + length <= until
        if opcode != Opcode.MESSAGE or not fits:
            raise self._damaged(offset)
        size = length - MESSAGE_HEAD.size
        body = begin + _HEAD_SIZE
        data = self._file.read(offset + _HEAD_SIZE, size) if chunk == IN_FILE else head[body : body + size]
        if len(data) != size:
            raise self._damaged(offset)
        return head[begin + RECORD_HEAD.size : body], data

    def _unpack(self, chunk: int) -> bytes:
        place = self._chunks[chunk]
        records = decompress(place, self._file.read(place.offset, place.size))
        if records is None:
            raise self._damaged(place.offset)
        return records

    def _damaged(self, offset: int) -> FormatError:
        return FormatError(
            f"Take {self._file.path} has changed or is damaged (record at {offset}).", "Recover the take."
        )


class Frames(Sequence[Frame], Generic[Frame]):
    """Frames in the order they were recorded. Each access reads and decodes one frame, below a millisecond; a slice
    is a view that reads nothing."""

    def __init__(self, store: Store, places: IntArray, start_ns: int, decode: Callable[[bytes], Frame]) -> None:
        """places: (3, n) int64 as Places.columns gives them, in the order of the file, or (4, n) with where each must
        end. start_ns: MCAP time of the take's first frame."""
        self._store = store
        self._places = places if len(places) == 4 else np.vstack([places, _ends(places)])
        self._start_ns = start_ns
        self.decode = decode

    def __len__(self) -> int:
        return int(self._places.shape[1])

    @overload
    def __getitem__(self, index: int) -> Frame: ...

    @overload
    def __getitem__(self, index: slice) -> Frames[Frame]: ...

    def __getitem__(self, index: int | slice) -> Frame | Frames[Frame]:
        if isinstance(index, slice):
            return Frames(self._store, self._places[:, index], self._start_ns, self.decode)
        return self.decode(self.message(index)[1])

    def message(self, index: int) -> tuple[bytes, bytes]:
        """(head, data) of the message record of a frame, as the file has it."""
        chunk, offset, _, end = self._places[:, index].tolist()
        return self._store.message(chunk, offset, end)

    def without(self, left_out: Collection[int]) -> Frames[Frame]:
        """All but those of these numbers."""
        return Frames(self._store, np.delete(self._places, sorted(left_out), axis=1), self._start_ns, self.decode)

    @property
    def times_s(self) -> FloatArray:
        """(n,) float64 [s], when each frame was exposed, from the first raw frame, by the host clock; known without
        decoding. Not ascending where the clock was not."""
        times: FloatArray = (self._places[2] - self._start_ns) / 1e9
        return times

    @property
    def order(self) -> IntArray:
        """(2, n) int64: sorts frames of several topics into the order of the file."""
        return np.asarray(self._places[:2])


def in_file_order(topics: Sequence[Frames[Any]]) -> Iterator[tuple[int, int]]:
    """(which of the topics, number in it) of every frame, in the order in which they were recorded."""
    which = np.concatenate([np.full(len(frames), i) for i, frames in enumerate(topics)])
    number = np.concatenate([np.arange(len(frames)) for frames in topics])
    chunk, offset = np.concatenate([frames.order for frames in topics], axis=1)
    for k in np.lexsort((offset, chunk)):
        yield int(which[k]), int(number[k])


def _ends(places: IntArray) -> IntArray:
    """(n,) int64: where the next message in the same chunk begins."""
    chunk, offset = places[:2]
    last = np.full(len(chunk), np.iinfo(np.int64).max)
    last[:-1] = np.where(chunk[1:] == chunk[:-1], offset[1:], last[:-1])
    return last
