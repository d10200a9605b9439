"""The calm dark gradient behind everything."""

from __future__ import annotations

import numpy as np
from vispy import gloo

from app.viewport.scene_visual import SceneVisual

# the two last terms dither by half a step: a gradient this slow shows its steps otherwise
_VERTEX = """
#version 120
attribute vec2 a_position;
varying float v_height;
void main() {
    v_height = 0.5 + 0.5 * a_position.y;
    gl_Position = vec4(a_position, 0.0, 1.0);
}
"""
_FRAGMENT = """
#version 120
uniform vec3 u_top;
uniform vec3 u_bottom;
varying float v_height;
void main() {
    float noise = fract(sin(dot(gl_FragCoord.xy, vec2(12.9898, 78.233))) * 43758.5453) - 0.5;
    gl_FragColor = vec4(mix(u_bottom, u_top, v_height) + noise / 255.0, 1.0);
}
"""


class BackgroundVisual(SceneVisual):
    """Fills the canvas from u_bottom to u_top; writes no depth."""

    def __init__(self, top: tuple[float, float, float], bottom: tuple[float, float, float]) -> None:
        super().__init__(_VERTEX, _FRAGMENT)
        corners = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]], dtype=np.float32)
        self.shared_program["a_position"] = gloo.VertexBuffer(corners)
        self._draw_mode = "triangle_strip"
        self.uniform("u_top", top)
        self.uniform("u_bottom", bottom)
        self.set_gl_state(None, depth_test=False, depth_mask=False, cull_face=False, blend=False)
