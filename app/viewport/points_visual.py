"""Markers as small shaded balls, hollow where a marker is only predicted."""

from __future__ import annotations

import numpy as np

from app.viewport.scene_visual import SceneVisual, VertexStream
from core.frames import FloatArray

MARKER_RADIUS_M = 0.0042

_VERTEX = """
#version 120
uniform mat4 u_view;
uniform mat4 u_projection;
uniform float u_height_px;
uniform float u_smallest_px;
uniform float u_radius_m;

attribute vec3 a_position;
attribute vec4 a_color;
attribute float a_hollow;

varying vec4 v_color;
varying float v_hollow;
varying float v_radius_px;

void main() {
    vec4 position_view = u_view * vec4(a_position, 1.0);
    // the ball's front, not its centre: a marker stuck to the skin is not swallowed by it
    position_view.xyz -= normalize(position_view.xyz) * u_radius_m * 1.5;
    gl_Position = u_projection * position_view;
    v_radius_px = max(0.5 * u_height_px * u_projection[1][1] * u_radius_m / gl_Position.w, u_smallest_px);
    gl_PointSize = 2.0 * v_radius_px + 2.0;
    v_color = a_color;
    v_hollow = a_hollow;
}
"""

_FRAGMENT = """
#version 120
uniform float u_opacity;

varying vec4 v_color;
varying float v_hollow;
varying float v_radius_px;

void main() {
    vec2 offset = (gl_PointCoord * 2.0 - 1.0) * (v_radius_px + 1.0) / v_radius_px;
    offset.y = -offset.y;
    float r = length(offset);
    float edge = 1.0 / v_radius_px;
    float inside = 1.0 - smoothstep(1.0 - edge, 1.0 + edge, r);
    if (inside * v_color.a <= 0.0) discard;
    vec3 normal = vec3(offset, sqrt(max(0.0, 1.0 - r * r)));
    float light = 0.62 + 0.42 * clamp(dot(normal, normalize(vec3(-0.4, 0.6, 0.7))), 0.0, 1.0);
    float ring = smoothstep(0.62 - edge, 0.62 + edge, r);
    float alpha = mix(1.0, mix(0.16, 1.0, ring), v_hollow);
    gl_FragColor = vec4(v_color.rgb * mix(light, 1.0, v_hollow), v_color.a * alpha * inside * u_opacity);
}
"""

_VERTEX_TYPE = np.dtype([("a_position", np.float32, 3), ("a_color", np.float32, 4), ("a_hollow", np.float32)])


class PointsVisual(SceneVisual):
    """Any number of markers, given anew each frame. What the hand covers still shows, faintly."""

    def __init__(self) -> None:
        super().__init__(_VERTEX, _FRAGMENT)
        self._stream = VertexStream(self.view_program, _VERTEX_TYPE)
        self._draw_mode = "points"
        self.uniform("u_radius_m", MARKER_RADIUS_M)
        self.uniform("u_opacity", 1.0)
        self.set_gl_state(
            None, depth_test=True, depth_mask=False, cull_face=False, blend=True,
            blend_func=("src_alpha", "one_minus_src_alpha"),
        )  # fmt: skip
        self.visible = False

    def set_points(self, positions_m: FloatArray, colors: FloatArray, hollow: FloatArray) -> None:
        """positions_m: (n, 3) [m]; colors: (n, 4) in 0..1; hollow: (n,) bool."""
        self.visible = len(positions_m) > 0
        if not self.visible:
            return
        vertices = self._stream.resize(len(positions_m))
        vertices["a_position"], vertices["a_color"], vertices["a_hollow"] = positions_m, colors, hollow
        self._stream.send()

    def set_screen(self, height_px: float, pixel_ratio: float) -> None:
        """height_px: of the drawing surface in device pixels; pixel_ratio: device pixels per window unit."""
        self.uniform("u_height_px", height_px)
        self.uniform("u_smallest_px", 3.0 * pixel_ratio)

    def draw(self) -> None:
        """Draw what is in front, then what is hidden behind a surface."""
        if not self.visible:
            return
        self.uniform("u_opacity", 0.28)
        self.update_gl_state(depth_func="greater")
        super().draw()
        self.uniform("u_opacity", 1.0)
        self.update_gl_state(depth_func="lequal")
        super().draw()
