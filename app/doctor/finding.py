"""One thing the doctor looked at."""

from __future__ import annotations

from dataclasses import dataclass

from devices.device import Level


@dataclass(frozen=True)
class Finding:
    """topic: what was looked at. text: what was found. action: how to mend it, empty if all is well."""

    level: Level
    topic: str
    text: str
    action: str = ""


def good(topic: str, text: str) -> Finding:
    """All is well."""
    return Finding(Level.GOOD, topic, text)


def warning(topic: str, text: str, action: str) -> Finding:
    """Works, but not as well as it could."""
    return Finding(Level.WARNING, topic, text, action)


def problem(topic: str, text: str, action: str) -> Finding:
    """Something will not work."""
    return Finding(Level.PROBLEM, topic, text, action)
