"""Blender without a window, empty for each file. Its world is Z up, in metres; ours is Y up."""

import bpy


def empty_scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


def y_up(vector):
    return [vector[0], vector[2], -vector[1]]


def version():
    return bpy.app.version_string
