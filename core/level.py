"""One language of lights, from the device to the take."""

from __future__ import annotations

from enum import Enum


class Level(Enum):
    """One language of lights for the whole application."""

    GOOD = "good"
    WARNING = "warning"
    PROBLEM = "problem"
    IDLE = "idle"
