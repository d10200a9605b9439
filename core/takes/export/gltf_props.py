"""Props in a .glb file: a mesh under a node of its own that moves and turns; and such nodes read again, to compare."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from core.cast import props_of
from core.frames import BoolArray, FloatArray, IntArray, PropFrame, TrackedFrame
from core.gltf import INDICES, VERTICES, Document, GlbBuilder, Gltf
from core.props.mesh import prop_mesh
from core.props.prop import Prop
from core.takes.export.compare import compare, mismatch
from core.takes.export.content import Content, last_tracked
from core.takes.export.gltf_motion import Tracks
from core.takes.export.hands import blended_rotations
from core.takes.export.progress import Progress


@dataclass(frozen=True)
class PropMotion:
    """One prop over all solved frames; where it is not tracked, the last pose is held (before the first: the first).

    tracked: (t,) bool. position_m: (t, 3) float64 [m], world. rotation_xyzw: (t, 4) float64, unit, without jumps of
        sign.
    """

    prop: Prop
    tracked: BoolArray
    position_m: FloatArray
    rotation_xyzw: FloatArray

    def at(self, frames: IntArray) -> PropMotion:
        """The motion at these frames, (k,) int64."""
        return PropMotion(self.prop, self.tracked[frames], self.position_m[frames], self.rotation_xyzw[frames])

    def between(self, before: IntArray, after: IntArray, share: FloatArray) -> PropMotion:
        """The motion at places from one frame to another, as HandMotion.between."""
        start, end = self.at(before), self.at(after)
        share = np.where(start.tracked & end.tracked, share, 0.0)
        position_m = start.position_m + share[:, None] * (end.position_m - start.position_m)
        turns = blended_rotations(start.rotation_xyzw, end.rotation_xyzw, share)
        return PropMotion(self.prop, start.tracked, position_m, _without_sign_jumps(turns))


def prop_motions(content: Content, progress: Progress) -> list[PropMotion]:
    """Of the profile's props those that are tracked in at least one frame, in its order."""
    props = props_of(content.cast)
    if not props:
        return []
    n = content.timeline.n_frames
    poses = np.tile(np.eye(4), (len(props), n, 1, 1))
    tracked: BoolArray = np.zeros((len(props), n), dtype=np.bool_)
    for i, frame in enumerate(progress.over(content.solved, "Collecting props", n)):
        for k, prop in enumerate(props):
            seen = prop_of(frame, prop.name)
            if seen is not None:
                poses[k, i], tracked[k, i] = seen.transform_world, True
    return [
        _motion(prop, when, own[last_tracked(when)])
        for prop, own, when in zip(props, poses, tracked, strict=True)
        if when.any()
    ]


def prop_of(frame: TrackedFrame, name: str) -> PropFrame | None:
    """A prop, if it is tracked in this frame."""
    return next((prop for prop in frame.props if prop.name == name and prop.tracked), None)


def _motion(prop: Prop, tracked: BoolArray, poses: FloatArray) -> PropMotion:
    rotations = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    return PropMotion(prop, tracked, poses[:, :3, 3], _without_sign_jumps(rotations))


def _without_sign_jumps(rotations: FloatArray) -> FloatArray:
    """As of hands: q and -q turn alike, and neighbours lie on the same side."""
    same = np.einsum("ti,ti->t", rotations[1:], rotations[:-1]) >= 0.0
    rotations[1:] *= np.cumprod(np.where(same, 1.0, -1.0))[:, None]
    return rotations


def node(motion: PropMotion, name: str, mesh: int) -> Document:
    """As the prop stands in the first frame, for viewers that do not animate."""
    return {
        "name": name,
        "mesh": mesh,
        "translation": motion.position_m[0].tolist(),
        "rotation": motion.rotation_xyzw[0].tolist(),
    }


def mesh_of(builder: GlbBuilder, prop: Prop, material: int) -> Document:
    """The prop's surface in its own frame."""
    vertices, normals, faces = prop_mesh(prop)
    attributes = {
        "POSITION": builder.add(vertices.astype(np.float32), VERTICES, bounds=True),
        "NORMAL": builder.add(normals.astype(np.float32), VERTICES),
    }
    indices = builder.add(faces.ravel().astype(np.uint32), INDICES)
    return {
        "name": prop.name,
        "primitives": [{"attributes": attributes, "indices": indices, "material": material, "mode": 4}],
    }


def check(path: Path, glb: Gltf, tracks: Tracks, motions: list[PropMotion], tolerance_m: float) -> None:
    """Markers and surface of every prop in every frame. Raises ExportError; KeyError or ValueError if unsound."""
    nodes = [(i, one) for i, one in enumerate(glb.document["nodes"]) if "mesh" in one and "skin" not in one]
    named = [glb.document["meshes"][one["mesh"]]["name"] for _, one in nodes]
    if named != [motion.prop.name for motion in motions]:
        raise mismatch(path, f"it holds the props {', '.join(named) or 'none'}")
    for (i, one), motion in zip(nodes, motions, strict=True):
        primitive = glb.document["meshes"][one["mesh"]]["primitives"][0]
        written = _moved(
            glb.array(primitive["attributes"]["POSITION"]), tracks[i, "translation"], tracks[i, "rotation"]
        )
        solved = _moved(prop_mesh(motion.prop)[0], motion.position_m, motion.rotation_xyzw)
        tolerance = np.maximum(tolerance_m, np.abs(solved) * 2.0**-22)
        vertices = [f"{motion.prop.name} vertex {k}" for k in range(written.shape[1])]
        compare(path, written, solved, tolerance, vertices)


def _moved(vertices_m: FloatArray, position_m: FloatArray, rotation_xyzw: FloatArray) -> FloatArray:
    turns = Rotation.from_quat(rotation_xyzw).as_matrix()
    moved: FloatArray = np.einsum("tij,vj->tvi", turns, vertices_m) + position_m[:, None]
    return moved
