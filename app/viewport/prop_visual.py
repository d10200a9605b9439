"""A prop as the cylinder, sphere or box that it is, or as balls at its markers."""

from __future__ import annotations

import numpy as np
from vispy import gloo

from app.viewport import colours
from app.viewport.scene_visual import SceneVisual
from core.frames import FloatArray
from core.props.mesh import prop_mesh
from core.props.prop import Prop

_VERTEX = """
#version 120
uniform mat4 u_view;
uniform mat4 u_projection;
uniform mat4 u_pose;

attribute vec3 a_position;
attribute vec3 a_normal;

varying vec3 v_normal_world;
varying vec3 v_normal_view;
varying vec3 v_position_view;

void main() {
    vec4 position_view = u_view * u_pose * vec4(a_position, 1.0);
    v_normal_world = mat3(u_pose) * a_normal;
    v_normal_view = mat3(u_view) * v_normal_world;
    v_position_view = position_view.xyz;
    gl_Position = u_projection * position_view;
}
"""

# The light of the hands, without their soft shine.
_FRAGMENT = """
#version 120
uniform vec3 u_color;
uniform float u_opacity;

varying vec3 v_normal_world;
varying vec3 v_normal_view;
varying vec3 v_position_view;

void main() {
    vec3 normal = normalize(v_normal_view);
    float facing = clamp(dot(normal, normalize(-v_position_view)), 0.0, 1.0);
    float sky = 0.5 + 0.5 * normalize(v_normal_world).y;
    vec3 ambient = mix(vec3(0.20, 0.19, 0.19), vec3(0.42, 0.45, 0.50), sky);
    float key = clamp(dot(normal, normalize(vec3(-0.45, 0.65, 0.75))) * 0.75 + 0.25, 0.0, 1.0);
    float rim = pow(1.0 - facing, 3.0);
    vec3 color = u_color * (ambient + key * key * vec3(0.70, 0.68, 0.66)) + rim * vec3(0.12, 0.15, 0.20);
    gl_FragColor = vec4(color, u_opacity);
}
"""


class PropVisual(SceneVisual):
    """One prop of the profile. Not seen now, it is drawn as a lost hand is: a pale shade where it was."""

    def __init__(self, prop: Prop) -> None:
        super().__init__(_VERTEX, _FRAGMENT)
        self.prop = prop
        vertices, normals, faces = prop_mesh(prop)
        self.shared_program["a_position"] = gloo.VertexBuffer(vertices.astype(np.float32))
        self.shared_program["a_normal"] = gloo.VertexBuffer(normals.astype(np.float32))
        self._draw_mode = "triangles"
        self._index_buffer = gloo.IndexBuffer(faces.astype(np.uint32))
        self._opacity = 1.0
        self.set_gl_state(
            None, depth_test=True, depth_mask=True, cull_face="back", front_face="ccw",
            blend_func=("src_alpha", "one_minus_src_alpha"),
        )  # fmt: skip
        self.visible = False

    def set_pose(self, transform_world: FloatArray, tracked: bool) -> None:
        """transform_world: (4, 4) float64 [m]."""
        self.uniform("u_pose", transform_world.T)
        self._opacity = 1.0 if tracked else colours.LOST_OPACITY
        self.uniform("u_color", colours.PROP_COLOR if tracked else colours.LOST_COLOR)
        self.uniform("u_opacity", self._opacity)

    def draw(self) -> None:
        """Draw; where it is translucent its depth goes first, so that only the outer surface shows through."""
        if not self.visible:
            return
        self.update_gl_state(blend=False, depth_func="less")
        if self._opacity < 1.0:
            gloo.set_color_mask(False, False, False, False)
            super().draw()
            gloo.set_color_mask(True, True, True, True)
            self.update_gl_state(blend=True, depth_func="lequal")
        super().draw()
