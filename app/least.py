"""In how much of a recording a hand must be tracked."""

from __future__ import annotations

LEAST_TRACKED = 0.5
"""A hand that is tracked in fewer frames than this share was not recorded, or not found; unless asked otherwise."""
