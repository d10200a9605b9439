"""A skinned hand, skinned by the graphics card: per frame only sixteen matrices travel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from vispy import gloo

from app.viewport import colours
from app.viewport.solid_visual import LIT, PLACED, SolidVisual
from core.frames import FloatArray, IntArray, Side
from core.hand.mirror import mirror_transforms
from core.hand.model import HandModel, skinning_matrices
from core.hand.skeleton import N_JOINTS, Skeleton

_SKINNING_NAMES = tuple(f"u_skinning[{i}]" for i in range(N_JOINTS))

_GLASS_FROM = 0.3
"""Up to here a guess is only a tint: a hand with nothing worse is drawn in one pass."""

_VERTEX = f"""
#version 120
uniform mat4 u_view;
uniform mat4 u_projection;
uniform mat4 u_skinning[{N_JOINTS}];
uniform float u_scale;

attribute vec3 a_position;
attribute vec3 a_normal;
attribute vec4 a_joints;
attribute vec4 a_weights;

{PLACED}varying float v_guess;

void main() {{
    mat4 blended = a_weights.x * u_skinning[int(a_joints.x)] + a_weights.y * u_skinning[int(a_joints.y)]
                 + a_weights.z * u_skinning[int(a_joints.z)] + a_weights.w * u_skinning[int(a_joints.w)];
    vec4 position_view = u_view * vec4((blended * vec4(a_position * u_scale, 1.0)).xyz, 1.0);
    v_guess = blended[0][3];
    v_normal_world = mat3(blended) * a_normal;
    v_normal_view = mat3(u_view) * v_normal_world;
    v_position_view = position_view.xyz;
    gl_Position = u_projection * position_view;
}}
"""

_FRAGMENT = f"""
#version 120
uniform vec3 u_color;
uniform float u_opacity;
uniform vec3 u_guess_color;
uniform float u_guess_opacity;
uniform float u_glass_from;

{LIT}varying float v_guess;

void main() {{
    vec3 normal = normalize(v_normal_view);
    float facing = facing_eye(normal);
    vec3 halfway = normalize(key_direction() + normalize(-v_position_view));
    float shine = pow(clamp(dot(normal, halfway), 0.0, 1.0), 24.0);
    float rim = pow(1.0 - facing, 3.0);
    vec3 light = mix(light_on(normal), vec3(0.9), 0.7 * v_guess);
    vec3 color = mix(u_color, u_guess_color, v_guess) * light + shine * 0.07 + rim * vec3(0.16, 0.20, 0.26);
    float glass = mix(u_guess_opacity, 0.95, pow(1.0 - facing, 2.0));
    float opacity = u_opacity * mix(1.0, glass, smoothstep(u_glass_from, 1.0, v_guess));
    gl_FragColor = vec4(color, opacity * mix(1.0, 1.6, rim * (1.0 - opacity)));
}}
"""


class HandVisual(SolidVisual):
    """One hand of either side.

    The buffers hold the right hand at scale 1 and are written when the hand's shape changes. A left hand is drawn
    with mirrored matrices; the mirror turns its triangles inside out, so what counts as a front face turns with it.
    """

    def __init__(self, model: HandModel) -> None:
        self._positions, self._normals = gloo.VertexBuffer(), gloo.VertexBuffer()
        self._scale = self._opacity = 1.0
        self._partly_glass = False
        self.set_model(model)
        super().__init__(
            _VERTEX,
            _FRAGMENT,
            model.faces,
            a_position=self._positions,
            a_normal=self._normals,
            a_joints=gloo.VertexBuffer(model.skin_joints.astype(np.float32)),
            a_weights=gloo.VertexBuffer(model.skin_weights.astype(np.float32)),
        )
        self.uniform("u_scale", 1.0)
        self.set_look((0.7, 0.7, 0.7), 1.0)
        self.uniform("u_guess_color", colours.GUESS_COLOR)
        self.uniform("u_guess_opacity", colours.GUESS_OPACITY)
        self.uniform("u_glass_from", _GLASS_FROM)

    def set_model(self, model: HandModel) -> None:
        """The right hand at scale 1, in another shape: same faces and weights, other skeleton and surface."""
        self._model, self._scaled = model, model.skeleton.scaled(self._scale)
        self._positions.set_data(model.vertices_m.astype(np.float32))
        self._normals.set_data(vertex_normals(model.vertices_m, model.faces).astype(np.float32))

    def set_pose(self, side: Side, joints_world: FloatArray, scale: float, guessed: FloatArray) -> None:
        """joints_world: (16, 4, 4) float64 of a hand of this side, as a HandFrame holds them. guessed: (16,) float64,
        how much each joint is a guess, 0..1 (core.hand.certainty)."""
        if scale != self._scale:
            self._scale, self._scaled = scale, self._model.skeleton.scaled(scale)
            self.uniform("u_scale", scale)
        # one by one: vispy uploads only the first matrix of an array
        matrices = skinning_uniforms(self._scaled, side, joints_world, guessed)
        for name, matrix in zip(_SKINNING_NAMES, matrices, strict=True):
            self.view_program[name] = matrix
        self._partly_glass = bool(guessed.max() > _GLASS_FROM)
        self.translucent = self._opacity < 1.0 or self._partly_glass
        self.update_gl_state(front_face="ccw" if side == "right" else "cw")

    def set_look(self, color: tuple[float, float, float], opacity: float) -> None:
        """color: linear red, green, blue in 0..1. opacity below 1 shows a pose that is not sure."""
        self._opacity = opacity
        self.translucent = opacity < 1.0 or self._partly_glass
        self.uniform("u_color", color)
        self.uniform("u_opacity", opacity)


def skinning_uniforms(
    skeleton: Skeleton, side: Side, joints_world: FloatArray, guessed: FloatArray
) -> NDArray[np.float32]:
    """(16, 4, 4) float32: rest right hand to world for a hand of either side, each transposed as OpenGL wants it.

    skeleton: of a right hand, at the hand's own scale. guessed: (16,) in 0..1 travels in the first cell of the last
    row, which no motion needs, and so is blended over the skin by the same weights.
    """
    if side == "right":
        matrices = skinning_matrices(skeleton, joints_world)
    else:
        matrices = skinning_matrices(skeleton, mirror_transforms(joints_world))
        matrices[:, 0, :] *= -1.0
    matrices[:, 3, 0] = guessed
    return matrices.transpose(0, 2, 1).astype(np.float32)


def vertex_normals(vertices_m: FloatArray, faces: IntArray) -> FloatArray:
    """(v, 3) float64, unit: the mean of the adjacent faces' normals, weighted by their area."""
    corners = vertices_m[faces]
    face_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices_m)
    for k in range(3):
        np.add.at(normals, faces[:, k], face_normals)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(lengths > 0.0, lengths, 1.0)
