"""What a take says of each of its devices."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

_OF_ALL = ("kind", "title")


def device_key(stream: str) -> str:
    """'natnet-1' of the stream 'natnet-1/markers'."""
    return stream.partition("/")[0]


def devices_of(device: Mapping[str, str], streams: Iterable[str]) -> dict[str, dict[str, str]]:
    """Of each device by its key what it said of itself, as `app.take_info` writes it: that of the stream that was
    solved stands without a key, or else the first. {} of a take whose streams have no names.

    device: as in TakeInfo. streams: keys, that of the one that was solved first.
    """
    found: dict[str, dict[str, str]] = {device_key(stream): {} for stream in streams if stream}
    rest: dict[str, str] = {}
    for name, text in device.items():
        key, _, what = name.partition(": ")
        if key in found:
            found[key][what] = text
        else:
            rest[name] = text
    first = next((key for key, said in found.items() if not said), "")
    return found | {first: rest} if first else found


def details(said: Mapping[str, str]) -> list[str]:
    """'Server: 10.0.0.2, command port 1510': what there is besides kind and title, a line each."""
    return [f"{name}: {text}" for name, text in said.items() if name not in _OF_ALL]
