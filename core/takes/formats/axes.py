"""Turning a file's axes to the house's: right-handed, Y up."""

from __future__ import annotations

import numpy as np

Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""(3, 3) rotation from Z up to Y up: -90 degrees about X."""

TO_Y_UP = {"X": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), "Y": np.eye(3), "Z": Z_UP}
"""(3, 3) rotation to Y up, by the name of the axis that points up in the file."""
