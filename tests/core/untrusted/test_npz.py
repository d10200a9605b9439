from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from core.errors import FormatError
from core.untrusted.npz import MOST_BYTES, read_npz


def header(shape: str, descr: str = "'<f8'") -> bytes:
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}}}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode()


def packed(path: Path, content: bytes, name: str = "a.npy", how: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(path, "w", how) as archive:
        archive.writestr(name, content)
    return path


def read(path: Path) -> np.ndarray:
    return read_npz(path, ("a",), path.name, "Make it again.")["a"]


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (header("(1099511627776,)"), r"a claims 8,796,093,022,208 bytes, of which at most 128 are there"),
        (header("(2, 2)") + bytes(31), "a claims 32 bytes, 31 are there"),
        (header("(2, 2)") + bytes(33), "a claims 32 bytes, more are there"),
        (header("(-1,)"), "a claims -8 bytes"),
        (header("()", "'|O'") + b"\x80\x04.", "holds object, not numbers"),
        (header("(1,)", "[('x', '<f8')]") + bytes(8), "not numbers or texts"),
        (header("(" + "9" * 5000 + ",)"), "cannot be told"),
        (header("(" + "9" * 3000 + "," + "9" * 3000 + ",)"), "is not a .npz of plain arrays"),
        (header("(" * 3000), "cannot be told"),
        (b"\x93NUMPY\x09\x00" + bytes(100), "version"),
        (b"", "is not a .npz of plain arrays"),
        (b"nothing of the kind at all", "is not a .npz of plain arrays"),
    ],
)
def test_what_is_claimed_is_held_against_what_is_there(tmp_path: Path, content: bytes, told: str) -> None:
    with pytest.raises(FormatError, match=r"bad\.npz") as raised:
        read(packed(tmp_path / "bad.npz", content))
    assert told in raised.value.what and raised.value.action == "Make it again."


def test_what_unpacks_to_more_than_is_read_is_not_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("a.npy", "w") as member:
        member.write(header(f"({MOST_BYTES // 8},)"))
        for _ in range(MOST_BYTES >> 20):
            member.write(bytes(1 << 20))
    with pytest.raises(FormatError, match="at most are read"):
        read(path)


def test_a_size_that_the_list_of_members_lies_about(tmp_path: Path) -> None:
    path = packed(tmp_path / "lies.npz", header("(1000,)") + bytes(8000))
    data = bytearray(path.read_bytes())
    at = data.rindex(b"PK\x01\x02") + 24
    for size in (200, 1 << 31):
        data[at : at + 4] = size.to_bytes(4, "little")
        path.write_bytes(data)
        with pytest.raises(FormatError):
            read(path)


@pytest.mark.parametrize("how", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_packed_in_another_way(tmp_path: Path, how: int) -> None:
    with pytest.raises(FormatError, match="packed in another way"):
        read(packed(tmp_path / "other.npz", header("(1,)") + bytes(8), how=how))


def test_a_list_of_a_hundred_thousand_members(tmp_path: Path) -> None:
    path = tmp_path / "many.npz"
    with zipfile.ZipFile(path, "w") as archive:
        for i in range(1000):
            archive.writestr(f"{i}.npy", b"")
    with pytest.raises(FormatError, match="it lists 1,000 arrays"):
        read(path)
    data = bytearray(path.read_bytes())
    at = data.rindex(b"PK\x05\x06") + 12
    data[at : at + 4] = (1 << 31).to_bytes(4, "little")
    path.write_bytes(data)
    with pytest.raises(FormatError, match="longer than any"):
        read(path)


@pytest.mark.parametrize("field", [4, 8, 16])
def test_the_end_of_an_archive_is_found_where_zipfile_finds_it(tmp_path: Path, field: int) -> None:
    """Its own mark stands once more, within it, and hides nothing."""
    path = packed(tmp_path / "end.npz", header("(1,)") + bytes(8))
    data = bytearray(path.read_bytes())
    at = data.rindex(b"PK\x05\x06")
    data[at + 12 : at + 16] = (1 << 31).to_bytes(4, "little")
    data[at + field : at + field + 4] = b"PK\x05\x06"
    path.write_bytes(data)
    with pytest.raises(FormatError, match="longer than any"):
        read(path)


def test_a_list_of_members_in_zip64_is_as_long_as_that_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What zipfile itself writes once an archive has so many members; their names alone would fill the memory."""
    monkeypatch.setattr(zipfile, "ZIP_FILECOUNT_LIMIT", 0)
    path = packed(tmp_path / "many.npz", header("(1,)") + bytes(8))
    assert b"PK\x06\x07" in path.read_bytes()
    with pytest.raises(FormatError, match="packed as archives of more than 4 GB are"):
        read(path)


def test_plain_arrays_of_every_kind_are_read_as_numpy_does(tmp_path: Path) -> None:
    arrays = {
        "columns": np.asfortranarray(np.arange(12.0).reshape(3, 4)),
        "swapped": np.arange(5, dtype=">i2"),
        "text": np.array(["ThumbMCP", "é"]),
        "number": np.float32(2.5),
        "none": np.empty((0, 3)),
    }
    for save in (np.savez, np.savez_compressed):
        stream = io.BytesIO()
        save(stream, **arrays)
        (tmp_path / "own.npz").write_bytes(stream.getvalue())
        got = read_npz(tmp_path / "own.npz", ("columns", "text"), "own", "", ("swapped", "number", "none", "absent"))
        assert got.keys() == arrays.keys()
        for name, values in arrays.items():
            np.testing.assert_array_equal(got[name], values)
            assert got[name].dtype == np.asarray(values).dtype
