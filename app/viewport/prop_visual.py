"""A prop as the cylinder, sphere or box that it is, or as balls at its markers."""

from __future__ import annotations

import numpy as np
from vispy import gloo

from app.viewport import colours
from app.viewport.solid_visual import LIT, PLACED, SolidVisual
from core.frames import FloatArray
from core.props.mesh import prop_mesh
from core.props.prop import Prop

_VERTEX = f"""
#version 120
uniform mat4 u_view;
uniform mat4 u_projection;
uniform mat4 u_pose;

attribute vec3 a_position;
attribute vec3 a_normal;
{PLACED}
void main() {{
    vec4 position_view = u_view * u_pose * vec4(a_position, 1.0);
    v_normal_world = mat3(u_pose) * a_normal;
    v_normal_view = mat3(u_view) * v_normal_world;
    v_position_view = position_view.xyz;
    gl_Position = u_projection * position_view;
}}
"""

# The light of the hands, without their soft shine.
_FRAGMENT = f"""
#version 120
uniform vec3 u_color;
uniform float u_opacity;
{LIT}
void main() {{
    vec3 normal = normalize(v_normal_view);
    float rim = pow(1.0 - facing_eye(normal), 3.0);
    gl_FragColor = vec4(u_color * light_on(normal) + rim * vec3(0.12, 0.15, 0.20), u_opacity);
}}
"""


class PropVisual(SolidVisual):
    """One prop of the profile. Not seen now, it is drawn as a lost hand is: a pale shade where it was."""

    def __init__(self, prop: Prop) -> None:
        self.prop = prop
        vertices, normals, faces = prop_mesh(prop)
        super().__init__(
            _VERTEX,
            _FRAGMENT,
            faces,
            a_position=gloo.VertexBuffer(vertices.astype(np.float32)),
            a_normal=gloo.VertexBuffer(normals.astype(np.float32)),
        )

    def set_pose(self, transform_world: FloatArray, tracked: bool) -> None:
        """transform_world: (4, 4) float64 [m]."""
        self.uniform("u_pose", transform_world.T)
        self.translucent = not tracked
        self.uniform("u_color", colours.PROP_COLOR if tracked else colours.LOST_COLOR)
        self.uniform("u_opacity", 1.0 if tracked else colours.LOST_OPACITY)
