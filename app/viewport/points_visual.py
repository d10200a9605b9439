"""Markers as small shaded balls; where one is only predicted a ring, as wide as the error to expect. Points that are
no hand's have shapes of their own."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from app.viewport.scene_visual import SceneVisual, VertexStream
from core.frames import FloatArray, IntArray

MARKER_RADIUS_M = 0.0042
SMALLEST_PX = 3.0
"""Radius of a ball that is far away."""

WIDEST_RING_M = 0.03
"""What may be anywhere on a finger says no more with a wider ring, and covers the hand."""


class Shape(IntEnum):
    """How a point without a ring is drawn."""

    BALL = 0
    SQUARE = 1
    DIAMOND = 2
    CROSS = 3


_VERTEX = """
#version 120
uniform mat4 u_view;
uniform mat4 u_projection;
uniform float u_height_px;
uniform float u_smallest_px;
uniform float u_radius_m;

attribute vec3 a_position;
attribute vec4 a_color;
attribute float a_ring_m;
attribute float a_shape;

varying vec4 v_color;
varying float v_shape;
varying float v_ball_px;
varying float v_ring_px;

void main() {
    vec4 position_view = u_view * vec4(a_position, 1.0);
    // the ball's front, not its centre: a marker stuck to the skin is not swallowed by it
    position_view.xyz -= normalize(position_view.xyz) * u_radius_m * 1.5;
    gl_Position = u_projection * position_view;
    float px_per_m = 0.5 * u_height_px * u_projection[1][1] / gl_Position.w;
    v_ball_px = max(px_per_m * u_radius_m, u_smallest_px);
    v_ring_px = a_ring_m > 0.0 ? max(px_per_m * a_ring_m, v_ball_px) : 0.0;
    gl_PointSize = 2.0 * max(v_ball_px, v_ring_px) + 2.0;
    v_color = a_color;
    v_shape = a_shape;
}
"""

_FRAGMENT = """
#version 120
uniform float u_opacity;

varying vec4 v_color;
varying float v_shape;
varying float v_ball_px;
varying float v_ring_px;

// how far inside its outline a pixel of a flat shape is
float flat_inside_px(vec2 at_px, float radius_px) {
    vec2 away_px = abs(at_px);
    if (v_shape < 1.5) return 0.86 * radius_px - max(away_px.x, away_px.y);
    if (v_shape < 2.5) return 0.71 * (radius_px - away_px.x - away_px.y);
    float stroke_px = max(0.24 * radius_px, 0.9);
    return min(stroke_px - 0.71 * abs(away_px.x - away_px.y), radius_px - max(away_px.x, away_px.y));
}

void main() {
    float radius_px = max(v_ball_px, v_ring_px);
    vec2 offset_px = (gl_PointCoord * 2.0 - 1.0) * (radius_px + 1.0);
    offset_px.y = -offset_px.y;
    float r_px = length(offset_px);
    bool is_flat = v_shape > 0.5 && v_ring_px == 0.0;
    float inside = clamp((is_flat ? flat_inside_px(offset_px, radius_px) : radius_px - r_px) + 0.5, 0.0, 1.0);
    if (inside * v_color.a <= 0.0) discard;
    float light = 1.0, alpha = 1.0;
    if (v_ring_px > 0.0) {
        float wide = clamp(v_ring_px / v_ball_px - 1.0, 0.0, 1.0);
        float line_px = mix(0.38 * v_ball_px, max(0.2 * v_ball_px, 1.3), wide);
        float line = clamp(r_px - (v_ring_px - line_px) + 0.5, 0.0, 1.0);
        float middle = wide * clamp(0.45 * v_ball_px - r_px + 0.5, 0.0, 1.0);
        alpha = max(mix(0.16, 0.09, wide), max(line * mix(1.0, 0.8, wide), middle));
    } else if (!is_flat) {
        vec2 offset = offset_px / v_ball_px;
        vec3 normal = vec3(offset, sqrt(max(0.0, 1.0 - dot(offset, offset))));
        light = 0.62 + 0.42 * clamp(dot(normal, normalize(vec3(-0.4, 0.6, 0.7))), 0.0, 1.0);
    }
    gl_FragColor = vec4(v_color.rgb * light, v_color.a * alpha * inside * u_opacity);
}
"""

_VERTEX_TYPE = np.dtype(
    [("a_position", np.float32, 3), ("a_color", np.float32, 4), ("a_ring_m", np.float32), ("a_shape", np.float32)]
)


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

    def set_points(self, positions_m: FloatArray, colors: FloatArray, rings_m: FloatArray, shapes: IntArray) -> None:
        """positions_m: (n, 3) [m]; colors: (n, 4) in 0..1; rings_m: (n,) [m], radius of a ring, 0 for none;
        shapes: (n,) of Shape, of the points without a ring.

        No ring is smaller than a ball, none wider than WIDEST_RING_M.
        """
        self.visible = len(positions_m) > 0
        if not self.visible:
            return
        vertices = self._stream.resize(len(positions_m))
        vertices["a_position"], vertices["a_color"] = positions_m, colors
        vertices["a_ring_m"], vertices["a_shape"] = np.minimum(rings_m, WIDEST_RING_M), shapes
        self._stream.send()

    def set_screen(self, height_px: float, pixel_ratio: float) -> None:
        """height_px: of the drawing surface in device pixels; pixel_ratio: device pixels per window unit."""
        self.uniform("u_height_px", height_px)
        self.uniform("u_smallest_px", SMALLEST_PX * pixel_ratio)

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
