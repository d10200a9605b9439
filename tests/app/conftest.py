"""Fixtures of the tests that draw."""

from __future__ import annotations

from tests.app.drawn import viewport

__all__ = ["viewport"]
