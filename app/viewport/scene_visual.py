"""What the visuals of the viewport share: one shader each, linked once, and a camera given as uniforms."""

from __future__ import annotations

from typing import Any

import numpy as np
from vispy import gloo
from vispy.visuals import Visual

from core.frames import FloatArray


class SceneVisual(Visual):
    """A vispy Visual drawn with the viewport's own camera.

    Its shaders declare `uniform mat4 u_view, u_projection`. Only uniforms and buffers change after the first
    drawing; vispy links the program again whenever a template variable does, and that costs 40 ms.
    """

    def set_camera(self, view: FloatArray, projection: FloatArray) -> None:
        """view, projection: (4, 4) float64, acting on columns."""
        self.uniform("u_view", view.T)
        self.uniform("u_projection", projection.T)

    def uniform(self, name: str, value: Any) -> None:
        """Set one uniform; matrices are handed over transposed, as OpenGL stores them."""
        self.view_program[name] = np.asarray(value, dtype=np.float32)

    def _prepare_transforms(self, view: Visual) -> None:
        """Nothing: the camera is in the uniforms, vispy's own transforms are not used."""


class VertexStream:
    """Vertices that change each frame, in a buffer that only grows, by doubling.

    A vispy program takes the number of vertices from the buffer it was bound to; what a frame does not use is
    left zero: transparent, and for lines without length.
    """

    def __init__(self, program: Any, vertex_type: np.dtype[np.void]) -> None:
        self._program = program
        self._vertices = np.zeros(0, vertex_type)
        self._buffer = gloo.VertexBuffer()
        self.resize(64)

    def resize(self, n: int) -> np.ndarray:
        """(n,) structured array to fill; `send` follows."""
        if n > len(self._vertices):
            capacity = max(64, 1 << (n - 1).bit_length())
            self._vertices = np.zeros(capacity, self._vertices.dtype)
            self._buffer = gloo.VertexBuffer(self._vertices)
            self._program.bind(self._buffer)
        self._vertices[n:] = 0
        return self._vertices[:n]

    def send(self) -> None:
        """Hand the vertices to the graphics card at the next drawing."""
        self._buffer.set_data(self._vertices, copy=True)
