"""BVH by Blender: every joint, and every end of a digit, in the world at every frame, in the file's own unit."""

import bpy
from blender_scene import empty_scene, version, y_up
from read_files import tell


def read(path):
    scene = empty_scene()
    bpy.ops.import_anim.bvh(filepath=path, update_scene_fps=True)
    armature = bpy.context.object
    first, last = map(int, armature.animation_data.action.frame_range)
    labels, points = [], []
    for frame in range(first, last + 1):
        scene.frame_set(frame)
        labels, row = [], []
        for bone in armature.pose.bones:
            labels.append(bone.name)
            row.append(y_up(armature.matrix_world @ bone.head))
            if not bone.children:
                labels.append(f"{bone.name} end")
                row.append(y_up(armature.matrix_world @ bone.tail))
        points.append(row)
    rate_hz = scene.render.fps / scene.render.fps_base
    return {"labels": labels, "points": points, "frames": len(points), "rate_hz": rate_hz}


tell("Blender", version(), read)
