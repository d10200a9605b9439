"""Axes of the plots: as many numbers as there is room for, none cut, none over another."""

from __future__ import annotations

import math

import pyqtgraph as pg
from PySide6.QtCore import QRectF
from PySide6.QtGui import QFont

from app import theme

NUMBER_PX = 10
LEFT_PX = 34
"""Width of the numbers at the left: a sign and three digits."""
_LEFT_OVER_PX, _BOTTOM_OVER_PX = 7, 14
"""How far half a number reaches over the end of its axis."""
_APART_PX = {"left": (18, 14, 11), "bottom": (52, 40, 34)}
STEPS = {"mm": (1.0, 2.0, 4.0, 8.0, 10.0), "%": (1.0, 2.0, 5.0, 10.0), "°": (1.0, 2.0, 3.0, 4.5, 9.0, 10.0)}
"""Numbers that are round in each unit; all else counts in PLAIN."""
PLAIN = (1.0, 2.0, 5.0, 10.0)


class ValueAxis(pg.AxisItem):
    """Round numbers, far enough apart to be read, those at the ends whole. unit: of the values; behind: each number."""

    def __init__(self, side: str, unit: str = "", behind: str = "") -> None:
        super().__init__(side)
        self._side, self._steps, self._behind = side, STEPS.get(unit, PLAIN), behind
        font = QFont()
        font.setPixelSize(NUMBER_PX)
        self.setStyle(tickFont=font, tickLength=-4)
        self.setPen(theme.STRONG_LINE)
        self.setTextPen(theme.MUTED)
        if side == "left":
            self.setWidth(LEFT_PX)

    def tickValues(self, minVal: float, maxVal: float, size: float) -> list[tuple[float, list[float]]]:  # noqa: N802
        """One level of ticks: the least round step at which numbers stand well apart; closer where that leaves one."""
        low, high = min(minVal, maxVal), max(minVal, maxVal)
        ticks: list[tuple[float, list[float]]] = []
        for apart_px in _APART_PX[self._side]:
            step = round_step((high - low) * apart_px / max(size, 1.0), self._steps)
            if not step:
                return []
            slack = 1e-6 * step
            first, last = math.ceil((low - slack) / step), math.floor((high + slack) / step)
            ticks = [(step, [i * step for i in range(first, last + 1)])]
            if last > first:
                break
        return ticks

    def tickStrings(self, values: list[float], scale: float, spacing: float) -> list[str]:  # noqa: N802
        """Without digits that say nothing."""
        decimals = max(0, math.ceil(-math.log10(spacing) - 1e-9))
        return [f"{value + 0.0:.{decimals}f}{self._behind}" for value in values]

    def boundingRect(self) -> QRectF:  # noqa: N802
        """With what the outermost numbers reach over the ends."""
        whole = super().boundingRect()
        if self._side == "left":
            return whole.adjusted(0, -_LEFT_OVER_PX, 0, _LEFT_OVER_PX)
        return whole.adjusted(-_BOTTOM_OVER_PX, 0, _BOTTOM_OVER_PX, 0)


def round_step(least: float, steps: tuple[float, ...] = PLAIN) -> float:
    """The least of `steps` times a power of ten that is not below; 0 if there is none."""
    if not (math.isfinite(least) and least > 0):
        return 0.0
    power = 10.0 ** math.floor(math.log10(least))
    return next(step * power for step in steps if step * power >= least * (1 - 1e-9))
