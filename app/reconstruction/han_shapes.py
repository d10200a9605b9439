"""Hand shape of Han's users 1 to 4, each found from its own motion.

What the data call palm width is no breadth of skin: 77, 74, 65 and 64 mm are the median distances between the
markers IndexMCP and PinkyMCP over each user's frames (77.8, 74.2, 65.9 and 64.5 mm, right hands). A hand that was
found is therefore measured alike: between those two markers of the model, over the same poses. Beside it stands the
breadth over the knuckles of the shaped hand, as anthropometry measures it.
"""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray

PALM_WIDTHS_MM = (77.0, 74.0, 65.0, 64.0)
"""Of users 1 to 4, as the data set states them."""


def palm_width_mm(points_m: FloatArray, marker_names: tuple[str, ...]) -> float:
    """Median distance between the markers IndexMCP and PinkyMCP [mm]. points_m: (n, m, 3) float64 [m]."""
    index, pinky = marker_names.index("IndexMCP"), marker_names.index("PinkyMCP")
    return 1000.0 * float(np.nanmedian(np.linalg.norm(points_m[:, index] - points_m[:, pinky], axis=1)))
