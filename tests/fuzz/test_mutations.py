"""What is made to break readers does not break those who make it."""

from __future__ import annotations

import json
import tracemalloc
from random import Random

from tests.fuzz.json_mutations import content_spoilt
from tests.fuzz.mutations import MOST_BYTES, TEXT, spoilt


def test_no_spoilt_document_is_larger_than_memory() -> None:
    """A document that is spoilt twice may hold what stands for 100,000 brackets, in a list that is repeated."""
    sound = json.dumps({"a": ["\0deep\0"] * 500, "b": 1}).encode()
    tracemalloc.start()
    try:
        for seed in range(20):
            assert len(spoilt([sound], (content_spoilt, *TEXT), Random(seed))) <= MOST_BYTES
            content_spoilt(sound, Random(seed))
        assert tracemalloc.get_traced_memory()[1] < 100 << 20
    finally:
        tracemalloc.stop()
