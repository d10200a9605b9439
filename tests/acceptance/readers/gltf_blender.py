"""glTF by Blender: every bone and thing in the world at every key, and the skinned surfaces at some."""

import json
import struct
from pathlib import Path

import bpy
from blender_scene import empty_scene, version, y_up
from read_files import tell

SURFACES = 4  # instants at which surfaces are sampled


def key_times(path):
    """When the file has keys, which Blender keeps as fractions of its own frames."""
    data = Path(path).read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    file, body = json.loads(data[20 : 20 + length]), data[28 + length :]
    times = set()
    for animation in file["animations"]:
        for sampler in animation["samplers"]:
            accessor = file["accessors"][sampler["input"]]
            view = file["bufferViews"][accessor["bufferView"]]
            start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
            times.update(struct.unpack_from(f"<{accessor['count']}f", body, start))
    return sorted(times)


def plain(value):
    """A property of Blender as JSON has it."""
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if hasattr(value, "to_list"):
        return value.to_list()
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    return value if isinstance(value, (str, int, float, bool)) else str(value)


def read(path):
    scene = empty_scene()
    scene.render.fps = 60  # instants between its frames need not fall on a grid
    bpy.ops.import_scene.gltf(filepath=path)
    times = key_times(path)
    every = max(1, len(times) // SURFACES)
    nodes, surfaces, surface_times_s = {}, {}, []
    for k, time_s in enumerate(times):
        frame = time_s * scene.render.fps
        scene.frame_set(int(frame), subframe=frame - int(frame))
        graph = bpy.context.evaluated_depsgraph_get()
        for thing in scene.objects:
            if thing.type == "ARMATURE":
                for bone in thing.pose.bones:
                    nodes.setdefault(bone.name, []).append(y_up(thing.matrix_world @ bone.head))
            else:
                nodes.setdefault(thing.name, []).append(y_up(thing.matrix_world.translation))
        if k % every:
            continue
        surface_times_s.append(time_s)
        for thing in scene.objects:
            if thing.type == "MESH" and thing.users_collection[0] == scene.collection:
                mesh = thing.evaluated_get(graph).to_mesh()
                surfaces.setdefault(thing.name, []).append([y_up(thing.matrix_world @ v.co) for v in mesh.vertices])
    return {
        "extras": {name: plain(value) for name, value in scene.items()},
        "node_extras": {thing.name: {name: plain(value) for name, value in thing.items()} for thing in scene.objects},
        "times_s": times,
        "nodes": nodes,
        "surface_times_s": surface_times_s,
        "surfaces": surfaces,
        "animations": [
            [action.name, (action.frame_range[1] - action.frame_range[0]) / scene.render.fps]
            for action in bpy.data.actions
        ],
    }


tell("Blender", version(), read)
