"""What a command hands back, and how its figures become one JSON object."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, is_dataclass
from enum import Enum, IntEnum
from pathlib import Path
from typing import Any

from core.printable import printable_json


class Exit(IntEnum):
    """Exit codes of every command."""

    DONE = 0
    FAILED = 1  # the message says what to do
    USAGE = 2
    LOSS = 3  # done, but something was lost


@dataclass(frozen=True)
class Result:
    """figures: what `--json` prints. stands: what was done stands, and so does its status, if that could not be
    printed."""

    exit: Exit = Exit.DONE
    figures: Mapping[str, Any] = field(default_factory=dict)
    stands: bool = False


def to_json(figures: Mapping[str, Any]) -> str:
    """One line of strict JSON; numbers that do not exist become null, and control characters are escaped."""
    return printable_json(json.dumps(plain(figures), ensure_ascii=False, allow_nan=False))


def plain(value: Any) -> Any:
    """As JSON can hold it: numbers that do not exist become None."""
    if isinstance(value, Enum):
        return plain(value.value)
    if hasattr(value, "tolist"):  # numpy's arrays and numbers
        return plain(value.tolist())
    if isinstance(value, float):
        return value + 0.0 if math.isfinite(value) else None  # no -0.0
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return plain(asdict(value))
    if isinstance(value, list | tuple | set):
        return [plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    return value
