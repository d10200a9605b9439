"""JSON whose text is right and whose content is not: of another kind, too deep, too long, without what it needs."""

from __future__ import annotations

import json
from random import Random
from typing import Any

from tests.fuzz.mutations import Mutation

_DEEP = b"\0deep\0"
"""Stands in the document for brackets that no encoder would nest."""
_MOST_DEEP = 8
"""So often: a list of thousands of them would be gigabytes."""

_VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 1.5, 1e308, -1e308, 1e-320, float("nan"), float("inf"), 10**18, 10**40, -(10**400),
    "", "x", "NaN", "1", "x" * 5000, "\0", "\x1b[31m", "\ud800", "../../etc/passwd", "/dev/zero", [], {}, [[]], [None],
    [1, 2, 3], [0.0] * 4, [float("nan")] * 3, [1e308] * 3, ["a", 1], {"a": {}}, [[0.0] * 3] * 4, [10**400],
)  # fmt: skip


def _places(node: Any, found: list[tuple[Any, Any]]) -> list[tuple[Any, Any]]:
    """Every (container, key) of a document."""
    for key in node.keys() if isinstance(node, dict) else range(len(node)):
        found.append((node, key))
        if isinstance(node[key], dict | list):
            _places(node[key], found)
    return found


def _spoil(document: Any, random: Random) -> None:
    places = _places(document, [])
    if not places:
        return
    node, key = random.choice(places[: random.choice((12, 60, len(places)))])
    match random.randrange(7):
        case 0 | 1 | 2:
            node[key] = random.choice(_VALUES)
        case 3:
            other, theirs = random.choice(places)
            node[key] = json.loads(json.dumps(other[theirs]))
        case 4:
            node[key] = _DEEP.decode()
        case 5 if isinstance(node, dict):
            node[random.choice((key + "s", key.upper(), ""))] = node.pop(key)
        case 6 if isinstance(node, list):
            node[key:key] = [node[key]] * random.choice((1, 2, 60, 2000))
        case _:
            del node[key]


def content_spoilt(data: bytes, random: Random) -> bytes:
    """A value replaced by one of another kind, moved, named otherwise, repeated, nested 100,000 deep, or gone."""
    try:
        document = json.loads(data)
        for _ in range(random.choice((1, 1, 2, 4))):
            _spoil(document, random)
        text = json.dumps(document)
    except (ValueError, RecursionError):  # spoilt before
        return data
    brackets = random.choice(("[", '{"a":')) * 100_000
    return text.replace(json.dumps(_DEEP.decode()), brackets, _MOST_DEEP).encode()


MUTATION: Mutation = content_spoilt
