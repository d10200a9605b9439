"""C3D files byte by byte, with whatever their programs got wrong."""

import struct

import numpy as np

from core.takes.formats.c3d_parameters import BLOCK


def real(processor, value):
    if processor == 85:  # DEC: exponent two higher, halves swapped
        low, high = struct.unpack("<HH", struct.pack("<f", value * 4.0))
        return struct.pack("<HH", high, low)
    return struct.pack(">f" if processor == 86 else "<f", value)


def words(processor, *values):
    return struct.pack((">" if processor == 86 else "<") + f"{len(values)}H", *values)


def long_words(value):
    """A count as two words, the lower first."""
    return [value & 0xFFFF, value >> 16]


def encoded(processor, value):
    """Type, dimensions and bytes of an int (a word), a float (a real), an array of reals, or a list of one kind."""
    if isinstance(value, int):
        return 2, (), words(processor, value)
    if isinstance(value, float):
        return 4, (), real(processor, value)
    if isinstance(value, str):
        return -1, (len(value),), value.encode()
    if isinstance(value, np.ndarray):  # the first dimension runs fastest in the file
        return 4, value.shape[::-1], b"".join(real(processor, v) for v in value.ravel())
    if not value:
        return -1, (1, 0), b""
    if isinstance(value[0], str):
        width = max(map(len, value))
        return -1, (width, len(value)), b"".join(text.encode().ljust(width) for text in value)
    if isinstance(value[0], int):
        return 2, (len(value),), words(processor, *value)
    return 4, (len(value),), b"".join(real(processor, v) for v in value)


def section(processor, groups):
    """A parameter section. groups: {group: {parameter: value}}; a value may be (type, dimensions, bytes), too."""
    body = bytes((1, 80, 2, processor))
    for number, (group, parameters) in enumerate(groups.items(), 1):
        body += struct.pack("bb", len(group), -number) + group.encode() + words(processor, 3) + b"\0"
        for name, value in parameters.items():
            kind, dimensions, data = value if isinstance(value, tuple) else encoded(processor, value)
            content = struct.pack("bB", kind, len(dimensions)) + bytes(dimensions) + data + b"\0"
            body += struct.pack("bb", len(name), number) + name.encode()
            body += words(processor, len(content) + 2) + content
    body += b"\0\0"
    return body.ljust(max(2 * BLOCK, -(-len(body) // BLOCK) * BLOCK), b"\0")


def frames(processor, scale, points, analog=0):
    """points (t, m, 3) in mm; a NaN is an invalid point. analog: values after the points of each frame."""
    t, m = points.shape[:2]
    invalid = np.isnan(points).any(axis=2)
    table = np.zeros((t, 4 * m + analog))
    steps = np.nan_to_num(points) if scale < 0 else np.round(np.nan_to_num(points) / scale)
    table[:, : 4 * m] = np.dstack([steps, np.where(invalid, -1.0, 1.0)]).reshape(t, 4 * m)
    order = ">" if processor == 86 else "<"
    if scale > 0:
        return table.astype(order + "i2").tobytes()
    if processor == 85:
        return (table * 4.0).astype("<f4").view("<u2").reshape(t, -1, 2)[:, :, ::-1].tobytes()
    return table.astype(order + "f4").tobytes()


def build(processor, scale, points, groups=None, analog=0, filled=False, **header):
    """The bytes of a C3D file. groups: parameters beyond POINT's SCALE, RATE and LABELS, or instead of them; None
    leaves one out. header: what its words say instead of the truth: n_points, n_analog, first, last, block, samples,
    rate. filled: up to a whole block, as most programs do.
    """
    t, m = points.shape[:2]
    given = {name: dict(parameters) for name, parameters in (groups or {}).items()}
    own = {"SCALE": scale, "RATE": 100.0, "LABELS": [f"point_{i}" for i in range(m)]}
    own.update(given.pop("POINT", {}))
    parameters = section(
        processor, {"POINT": {name: value for name, value in own.items() if value is not None}, **given}
    )
    says = {
        "n_points": m, "n_analog": analog, "first": 1, "last": min(t, 65535), "block": 2 + len(parameters) // BLOCK,
        "samples": 0, "rate": 100.0, **header,
    }  # fmt: skip
    head = bytes((2, 80)) + words(processor, says["n_points"], says["n_analog"], says["first"], says["last"], 10)
    head += real(processor, scale) + words(processor, says["block"], says["samples"]) + real(processor, says["rate"])
    data = head.ljust(BLOCK, b"\0") + parameters + frames(processor, scale, points, analog)
    return data + bytes(-len(data) % BLOCK) if filled else data


def trial(processor, first, last):
    """The group TRIAL of a recording from its frame `first` to `last`."""
    return {
        "ACTUAL_START_FIELD": (2, (2,), words(processor, *long_words(first))),
        "ACTUAL_END_FIELD": (2, (2,), words(processor, *long_words(last))),
    }
