"""Records out of their JSON form (app.commands.result.plain), by the types that they declare."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np


def restored(value: Any, kind: Any) -> Any:
    """kind: a dataclass, or what its fields may be: numbers, texts, paths, arrays, tuples and mappings of such, other
    dataclasses, or None. A number that does not exist is null in JSON.

    Raises KeyError, TypeError, ValueError and AttributeError for what is no such thing.
    """
    origin, args = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return None if value is None else restored(value, next(one for one in args if one is not NoneType))
    if isinstance(kind, type) and is_dataclass(kind):
        hints = get_type_hints(kind)
        given = {one.name: value[one.name] for one in fields(kind) if one.init and one.name in value}
        return kind(**{name: restored(item, hints[name]) for name, item in given.items()})
    if kind is float:
        return math.nan if value is None else float(value)
    if kind is Path:
        return Path(value)
    if origin is np.ndarray:
        return np.array(value, dtype=get_args(args[1])[0])
    if origin is tuple:
        return tuple(restored(item, args[0]) for item in value)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return {key: restored(item, args[1]) for key, item in value.items()}
    return value
