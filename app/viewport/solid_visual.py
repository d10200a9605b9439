"""What hands and props share: triangles in one light, opaque or translucent."""

from __future__ import annotations

from typing import Any

import numpy as np
from vispy import gloo

from app.viewport.scene_visual import SceneVisual
from core.frames import IntArray

PLACED = """
varying vec3 v_normal_world;
varying vec3 v_normal_view;
varying vec3 v_position_view;
"""
"""What a vertex shader hands to a fragment shader that is lit."""

# Hemisphere light from the world's sky, one soft key light beside the camera, a rim against the dark background.
LIT = (
    PLACED
    + """
vec3 key_direction() {
    return normalize(vec3(-0.45, 0.65, 0.75));
}

vec3 light_on(vec3 normal) {
    float sky = 0.5 + 0.5 * normalize(v_normal_world).y;
    vec3 ambient = mix(vec3(0.20, 0.19, 0.19), vec3(0.42, 0.45, 0.50), sky);
    float key = clamp(dot(normal, key_direction()) * 0.75 + 0.25, 0.0, 1.0);
    return ambient + key * key * vec3(0.70, 0.68, 0.66);
}

float facing_eye(vec3 normal) {
    return clamp(dot(normal, normalize(-v_position_view)), 0.0, 1.0);
}
"""
)


class SolidVisual(SceneVisual):
    """A closed surface of triangles. `translucent`: is any of it, as it is now?"""

    def __init__(self, vertex: str, fragment: str, faces: IntArray, **buffers: Any) -> None:
        super().__init__(vertex, fragment)
        self.translucent = False
        for name, buffer in buffers.items():
            self.shared_program[name] = buffer
        self._draw_mode = "triangles"
        self._index_buffer = gloo.IndexBuffer(faces.astype(np.uint32))
        self.set_gl_state(
            None, depth_test=True, depth_mask=True, cull_face="back", front_face="ccw",
            blend_func=("src_alpha", "one_minus_src_alpha"),
        )  # fmt: skip
        self.visible = False

    def draw(self) -> None:
        """Draw; where it is translucent its depth goes first, so that only the outer surface shows through."""
        if not self.visible:
            return
        self.update_gl_state(blend=False, depth_func="less")
        if self.translucent:
            gloo.set_color_mask(False, False, False, False)
            super().draw()
            gloo.set_color_mask(True, True, True, True)
            self.update_gl_state(blend=True, depth_func="lequal")
        super().draw()
