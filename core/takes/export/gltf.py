"""glTF 2.0, binary (.glb): both hands as animated, skinned meshes, and props, for Blender, Unity, Unreal and the web.

Metres, Y up, as everything in glTF. Each hand is a mesh with a skin of 16 joints under a node of its own; the wrist
moves and turns, the other joints turn; the tips of the digits are joints too, which carry no skin, so that a program
that draws bones knows where the last ones end. Keys stand at the frames' own times. Where a hand is not tracked, and
where there are no frames, its last pose is held, and `extras` of its node say from when to when. If the engine was
still finding the hand's size, the wrist's scale follows it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from core.frames import FloatArray, IntArray, Side
from core.gltf import INDICES, VERTICES, Document, GlbBuilder, read_glb
from core.hand.joint_axes import joint_axes
from core.hand.mirror import mirror_points, skin_hand
from core.hand.model import HandModel
from core.hand.skeleton import DIGITS, JOINT_PARENTS, N_JOINTS, TIP_JOINTS, Skeleton
from core.takes.export import gltf_extras, gltf_props
from core.takes.export.compare import compare, mismatch
from core.takes.export.content import Content, hand_of
from core.takes.export.gltf_motion import GltfHand, gltf_hands, read_tracks
from core.takes.export.gltf_props import PropMotion, prop_motions
from core.takes.export.hands import HandMotion, hand_motion
from core.takes.export.naming import file_stem
from core.takes.export.progress import Progress
from core.takes.formats.assemble import unique_labels

TOLERANCE_M = 1e-6
"""Within 4 m of the origin; farther out the precision of 32-bit reals."""

_SURFACES_COMPARED = 5
_COLOURS = ([0.80, 0.62, 0.52, 1.0], [0.62, 0.52, 0.74, 1.0], [0.50, 0.68, 0.64, 1.0], [0.72, 0.70, 0.48, 1.0])
"""Skin by performer, again from the first after the last."""

_PROP_COLOUR = [0.45, 0.50, 0.56, 1.0]


def names(content: Content) -> list[str]:
    """One file."""
    return [file_stem(content.solution.name) + ".glb"]


def counts(content: Content) -> list[int]:
    """Keys of its animation."""
    return [len(_keys(content)[0])]


def write(content: Content, paths: list[Path], progress: Progress) -> None:
    """Writes and reads back. Raises ExportError, CancelledError, OSError."""
    (path,) = paths
    hands = content.tracked
    times_s, before, after, share = _keys(content)
    motions = [
        hand_motion(content, hand, progress.part(0.6 * i / len(hands), 0.6 * (i + 1) / len(hands))).between(
            before, after, share
        )
        for i, hand in enumerate(hands)
    ]
    props = [prop.between(before, after, share) for prop in prop_motions(content, progress.part(0.6, 0.7))]
    progress(0.7, f"Writing {path.name}")
    _write(path, motions, props, content, times_s)
    progress(0.8, f"Reading back {path.name}")
    _check(path, motions, props, content, times_s, np.where(share > 0.0, -1, before))
    progress(1.0, f"{path.name} is complete")


def _keys(content: Content) -> tuple[FloatArray, IntArray, IntArray, FloatArray]:
    """(k,) float64 [s], when keys stand; and what they show: (k,) int64, int64 and float64, the frames before and after
    and the share of the way. At the frames' own times, unless a rate is asked for."""
    if content.options.rate_hz is None or not content.timeline.n_frames:
        times_s, frames = content.timeline.keys()
        return times_s, frames, frames, np.zeros(len(frames))
    grid = content.grid
    return content.timeline.times_s[0] + grid.times_s, grid.before, grid.after, grid.share


def _write(
    path: Path, motions: list[HandMotion], props: list[PropMotion], content: Content, times_s: FloatArray
) -> None:
    builder = GlbBuilder()
    nodes: list[Document] = []
    meshes: list[Document] = []
    skins: list[Document] = []
    samplers: list[Document] = []
    channels: list[Document] = []
    roots: list[int] = []
    materials = [
        _material("skin" if i == 0 else f"skin {i + 1}", _COLOURS[i % len(_COLOURS)]) for i in range(len(content.cast))
    ]
    times = builder.add(times_s.astype(np.float32), bounds=True)
    for motion in motions:
        first = len(nodes)
        nodes += _joint_nodes(motion, first, content.cast[motion.hand.performer].hand.skeleton)
        roots += [len(nodes), len(nodes) + 1]
        about_hand = gltf_extras.of_hand(content, motion.hand)
        nodes.append({"name": f"{motion.words} hand", "children": [first], "extras": about_hand})  # an armature
        nodes.append({"name": f"{motion.words} surface", "mesh": len(meshes), "skin": len(skins)})
        meshes.append(_mesh(builder, motion, content.cast[motion.hand.performer].hand))
        skins.append(
            {
                "name": f"{motion.words} hand",
                "joints": list(range(first, first + N_JOINTS + len(DIGITS))),
                "skeleton": roots[-2],
                "inverseBindMatrices": builder.add(_inverse_bind(np.concatenate([motion.rest_m, motion.tips_m]))),
            }
        )
        for node, path_name, values in _tracks(motion):
            channels.append({"sampler": len(samplers), "target": {"node": first + node, "path": path_name}})
            output = builder.add(values.astype(np.float32))
            samplers.append({"input": times, "output": output, "interpolation": "LINEAR"})
    for prop in props:
        roots.append(len(nodes))
        for path_name, values in (("translation", prop.position_m), ("rotation", prop.rotation_xyzw)):
            channels.append({"sampler": len(samplers), "target": {"node": len(nodes), "path": path_name}})
            output = builder.add(values.astype(np.float32))
            samplers.append({"input": times, "output": output, "interpolation": "LINEAR"})
        name = _unique(prop.prop.name, nodes)
        nodes.append(gltf_props.node(prop, name, len(meshes)) | gltf_extras.of_prop(content, prop.prop.name))
        meshes.append(gltf_props.mesh_of(builder, prop.prop, len(materials)))
    if props:
        materials.append(_material("prop", _PROP_COLOUR))
    about = gltf_extras.of_take(content)
    builder.write(
        path,
        {
            "asset": gltf_extras.asset(content),
            "scene": 0,
            "scenes": [{"name": content.solution.name, "nodes": roots, "extras": about}],
            "nodes": nodes,
            "meshes": meshes,
            "skins": skins,
            "materials": materials,
            "animations": [
                {"name": content.solution.name, "samplers": samplers, "channels": channels, "extras": about}
            ],
        },
    )


def _material(name: str, colour: list[float]) -> Document:
    surface = {"baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 0.7}
    return {"name": name, "pbrMetallicRoughness": surface}


def _unique(name: str, nodes: list[Document]) -> str:
    """A name that no node has: programs find what is animated by it."""
    return unique_labels([*(node["name"] for node in nodes), name])[-1]


def _joint_nodes(motion: HandMotion, first: int, skeleton: Skeleton) -> list[Document]:
    """The joints as they stand in the first frame, for viewers that do not animate; after them the tips."""
    nodes: list[Document] = []
    axes = joint_axes(skeleton, motion.hand.side)
    for joint in range(N_JOINTS):
        translation = motion.wrist_m[0] if joint == 0 else motion.offsets_m[joint]
        node: Document = {
            "name": motion.names.joints[joint],
            "translation": translation.tolist(),
            "rotation": motion.rotations_xyzw[0, joint].tolist(),
            "extras": gltf_extras.of_joint(axes, joint),
        }
        children = [first + child for child, parent in enumerate(JOINT_PARENTS) if parent == joint]
        children += [first + N_JOINTS + TIP_JOINTS.index(joint)] if joint in TIP_JOINTS else []
        node["children"] = children
        if joint == 0 and motion.sizes[0] != 1.0:
            node["scale"] = [float(motion.sizes[0])] * 3
        nodes.append(node)
    offsets_m = motion.tips_m - motion.rest_m[list(TIP_JOINTS)]
    nodes += [
        {"name": name, "translation": offset.tolist()}
        for name, offset in zip(motion.names.tips, offsets_m, strict=True)
    ]
    return nodes


def _tracks(motion: HandMotion) -> list[tuple[int, str, FloatArray]]:
    """What is animated: joint, property, values per frame."""
    tracks = [(0, "translation", motion.wrist_m)]
    if np.any(motion.sizes != 1.0):
        tracks.append((0, "scale", np.repeat(motion.sizes[:, None], 3, axis=1)))
    return tracks + [(joint, "rotation", motion.rotations_xyzw[:, joint]) for joint in range(N_JOINTS)]


def _mesh(builder: GlbBuilder, motion: HandMotion, model: HandModel) -> Document:
    hand = model.scaled(motion.scale)
    vertices, faces = surface(hand, motion.hand.side)
    weights = hand.skin_weights.astype(np.float32)
    weights /= weights.sum(axis=1, keepdims=True)
    joints = np.where(weights > 0.0, hand.skin_joints, 0).astype(np.uint8)
    attributes = {
        "POSITION": builder.add(vertices.astype(np.float32), VERTICES, bounds=True),
        "NORMAL": builder.add(_normals(vertices, faces).astype(np.float32), VERTICES),
        "JOINTS_0": builder.add(joints, VERTICES),
        "WEIGHTS_0": builder.add(weights, VERTICES),
    }
    indices = builder.add(faces.ravel().astype(np.uint32), INDICES)
    primitive = {"attributes": attributes, "indices": indices, "material": motion.hand.performer, "mode": 4}
    return {"name": f"{motion.words} hand", "primitives": [primitive]}


def surface(hand: HandModel, side: Side) -> tuple[FloatArray, IntArray]:
    """Vertices (v, 3) float64 [m] and faces (f, 3) of one side's hand at rest, counter-clockwise from outside."""
    if side == "right":
        return hand.vertices_m, hand.faces
    return mirror_points(hand.vertices_m), hand.faces[:, ::-1]


def _normals(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """(v, 3) float64, unit, of the faces around each vertex, weighed by their area."""
    corners = vertices[faces]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices)
    np.add.at(normals, faces, areas[:, None, :])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    unit: FloatArray = np.where(lengths > 0.0, normals / np.maximum(lengths, 1e-300), (0.0, 1.0, 0.0))
    return unit


def _inverse_bind(rest_m: FloatArray) -> np.ndarray:
    matrices = np.tile(np.eye(4, dtype=np.float32), (len(rest_m), 1, 1))
    matrices[:, :3, 3] = -rest_m
    return matrices


def _check(
    path: Path, motions: list[HandMotion], props: list[PropMotion], content: Content, times_s: FloatArray,
    frames: IntArray,
) -> None:  # fmt: skip
    try:
        glb = read_glb(path)
        read = gltf_hands(glb)
        gltf_props.check(path, glb, read_tracks(glb)[0], props, TOLERANCE_M)
        told = glb.document["scenes"][0]["extras"], glb.document["animations"][0]["extras"]
    except (ValueError, KeyError, IndexError, TypeError) as error:
        raise mismatch(path, f"it is not sound ({error})") from error
    if told != (gltf_extras.of_take(content),) * 2:
        raise mismatch(path, "what it says of the take differs")
    if len(read) != len(motions):
        raise mismatch(path, f"it holds {len(read)} hands instead of {len(motions)}")
    for hand, motion in zip(read, motions, strict=True):
        names = [*motion.names.joints, *motion.names.tips]
        if list(hand.joint_names) != names:
            raise mismatch(path, f"it holds the joints {', '.join(hand.joint_names)}")
        within_s = 1e-7 * max(float(times_s[-1]), 1.0)
        compare(path, hand.times_s[:, None], times_s[:, None], within_s, ("time",), unit="s")
        solved = np.concatenate([motion.joints_m, motion.ends_m], axis=1)
        tolerance = np.maximum(TOLERANCE_M, np.abs(solved) * 2.0**-22)
        compare(path, hand.positions_m(), solved, tolerance, names)
        _check_surface(path, hand, motion, content, frames)


def _check_surface(path: Path, hand: GltfHand, motion: HandMotion, content: Content, frames: IntArray) -> None:
    """A few keys of the skinned surface against the engine's. frames: (k,) int64, that each key shows; -1: between."""
    tracked = np.flatnonzero(motion.tracked & (frames >= 0))
    if not len(tracked):
        return
    for key in tracked[np.linspace(0, len(tracked) - 1, _SURFACES_COMPARED).astype(int)]:
        solved = hand_of(content.solved[int(frames[key])], motion.hand)
        if solved is None:
            continue
        model = content.cast[motion.hand.performer].hand.scaled(solved.scale)
        expected = skin_hand(model, solved.side, solved.joints_world)
        tolerance = max(TOLERANCE_M, float(np.abs(expected).max()) * 2.0**-22)
        vertices = [f"{motion.words} vertex {i}" for i in range(len(expected))]
        compare(path, hand.surface_m(int(key))[None], expected[None], tolerance, vertices, int(frames[key]) + 1)
