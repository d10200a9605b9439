"""Straight lines: the floor, the axes, the skeleton."""

from __future__ import annotations

import numpy as np

from app.viewport.scene_visual import SceneVisual, VertexStream
from core.frames import FloatArray

_VERTEX = """
#version 120
uniform mat4 u_view;
uniform mat4 u_projection;
uniform vec3 u_origin;

attribute vec3 a_position;
attribute vec4 a_color;

varying vec4 v_color;
varying vec3 v_position;

void main() {
    v_position = a_position + u_origin;
    v_color = a_color;
    gl_Position = u_projection * u_view * vec4(v_position, 1.0);
}
"""

_FRAGMENT = """
#version 120
uniform vec3 u_center;
uniform float u_fade_from;
uniform float u_fade_to;

varying vec4 v_color;
varying vec3 v_position;

void main() {
    float fade = 1.0 - smoothstep(u_fade_from, u_fade_to, distance(v_position, u_center));
    gl_FragColor = vec4(v_color.rgb, v_color.a * fade);
}
"""

_VERTEX_TYPE = np.dtype([("a_position", np.float32, 3), ("a_color", np.float32, 4)])
_NEVER_M = 1e9


class LinesVisual(SceneVisual):
    """Separate segments, each from one vertex to the next. on_top: nothing hides them."""

    def __init__(self, *, width: float = 1.0, on_top: bool = False) -> None:
        super().__init__(_VERTEX, _FRAGMENT)
        self._stream = VertexStream(self.view_program, _VERTEX_TYPE)
        self._draw_mode = "lines"
        self.uniform("u_origin", (0.0, 0.0, 0.0))
        self.set_fade((0.0, 0.0, 0.0), _NEVER_M, 2 * _NEVER_M)
        self.set_gl_state(
            None, depth_test=not on_top, depth_mask=False, depth_func="lequal", cull_face=False, blend=True,
            blend_func=("src_alpha", "one_minus_src_alpha"), line_width=width,
        )  # fmt: skip
        self.visible = False

    def set_lines(self, positions_m: FloatArray, colors: FloatArray) -> None:
        """positions_m: (2 n, 3) [m], start and end of each segment; colors: (2 n, 4) or (4,) in 0..1."""
        self.visible = len(positions_m) > 0
        if not self.visible:
            return
        vertices = self._stream.resize(len(positions_m))
        vertices["a_position"], vertices["a_color"] = positions_m, colors
        self._stream.send()

    def set_origin(self, origin_m: FloatArray) -> None:
        """Move all lines by origin_m (3,) [m] without writing them again."""
        self.uniform("u_origin", origin_m)

    def set_fade(self, center_m: object, from_m: float, to_m: float) -> None:
        """Lines vanish with their distance from center_m (3,) [m], between from_m and to_m [m]."""
        self.uniform("u_center", center_m)
        self.uniform("u_fade_from", from_m)
        self.uniform("u_fade_to", to_m)


def grid_lines(half_extent_m: float, step_m: float, skip_m: float) -> FloatArray:
    """(2 n, 3) float64 [m]: a grid on the floor about the origin, without the lines that a grid of skip_m draws."""
    n = round(half_extent_m / step_m)
    ticks = np.arange(-n, n + 1)
    if skip_m:
        ticks = ticks[ticks % round(skip_m / step_m) != 0]
    at = ticks * step_m
    ends = np.zeros((len(at), 2, 2, 3))  # line, direction, end, xyz
    ends[:, 0, :, 2] = at[:, None]
    ends[:, 0, 0, 0], ends[:, 0, 1, 0] = -half_extent_m, half_extent_m
    ends[:, 1, :, 0] = at[:, None]
    ends[:, 1, 0, 2], ends[:, 1, 1, 2] = -half_extent_m, half_extent_m
    return ends.reshape(-1, 3)


def triad_lines(transform_world: FloatArray, length_m: float) -> FloatArray:
    """(6, 3) float64 [m]: the three axes of a (4, 4) transform, x, y, z."""
    origin = transform_world[:3, 3]
    ends = origin + transform_world[:3, :3].T * length_m
    return np.stack([np.broadcast_to(origin, (3, 3)), ends], axis=1).reshape(6, 3)
