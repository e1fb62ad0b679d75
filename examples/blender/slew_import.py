"""Make an action of what slew wrote: slew export blender RIG MOVE --out F.json.

Paste it into Blender's Python console and call, with the object selected,

    slew_import("/tmp/crane.json", {"dolly": "location[0]",
                                    "pan": "rotation_euler[2]"})

The map says which axis becomes which property; one that is not there becomes
a custom property with the axis's name.  Keys keep their handles, easings,
extrapolation and cycles; the scene gets frame rate and range.
Works with Blender 2.93 to 5.
"""
import json
import re

import bpy

TO_BLENDER = {"mm": 0.001, "m": 1, "deg": 3.141592653589793 / 180, "rad": 1,
              "rev": 2 * 3.141592653589793}


def new_curve(owner, path, index):
    action = owner.animation_data.action
    if hasattr(action, "fcurve_ensure_for_datablock"):
        return action.fcurve_ensure_for_datablock(owner, path, index=index)
    return action.fcurves.new(path, index=index)


def target_of(owner, name, targets):
    """Path and index."""
    if name in targets:
        found = re.match(r"^(.*)\[(\d+)\]$", targets[name])
        return (found[1], int(found[2])) if found else (targets[name], 0)
    owner[name] = 0.0
    return '["%s"]' % name, 0


def unit_of(owner, data_path):
    """LENGTH, ROTATION, ..., NONE where Blender does not say."""
    found = re.match(r"^(?:(.*)\.)?(\w+)$", data_path)
    try:
        holder = owner.path_resolve(found[1]) if found[1] else owner
        return holder.bl_rna.properties[found[2]].unit
    except (TypeError, KeyError, ValueError, AttributeError):
        return "NONE"


def scale_of(unit, property_unit):
    """What a value is multiplied with."""
    if property_unit == "LENGTH":
        return (TO_BLENDER.get(unit, 1) /
                bpy.context.scene.unit_settings.scale_length)
    return TO_BLENDER.get(unit, 1) if property_unit == "ROTATION" else 1


def set_key(point, key, scale):
    point.co = key["t"], key["v"] * scale
    point.handle_left_type = point.handle_right_type = "FREE"
    point.handle_left = key["lt"], key["lv"] * scale
    point.handle_right = key["rt"], key["rv"] * scale
    point.handle_left_type, point.handle_right_type = key["hl"], key["hr"]
    point.interpolation, point.easing = key["interp"], key["easing"]
    point.amplitude = key["amplitude"] * scale
    point.period, point.back = key["period"], key["back"]


def set_cycles(curve, cycles):
    if not cycles:
        return
    modifier = curve.modifiers.new("CYCLES")
    modifier.mode_before = cycles["mode_before"]
    modifier.mode_after = cycles["mode_after"]
    modifier.cycles_before = cycles["count_before"]
    modifier.cycles_after = cycles["count_after"]


def set_curve(owner, read, targets):
    path, index = target_of(owner, read["name"], targets)
    curve = new_curve(owner, path, index)
    scale = scale_of(read["unit"], unit_of(owner, path))
    curve.extrapolation = read["extrapolation"]
    curve.auto_smoothing = read["auto_smoothing"]
    curve.keyframe_points.add(len(read["keys"]))
    for point, key in zip(curve.keyframe_points, read["keys"]):
        set_key(point, key, scale)
    set_cycles(curve, read["cycles"])
    curve.update()


def slew_import(path, targets=None, owner=None):
    owner = owner or bpy.context.object
    with open(path, encoding="utf-8") as file:
        read = json.load(file)
    if read["format"] != "slew-blender-1":
        raise ValueError("not what slew export blender writes")
    render = bpy.context.scene.render
    render.fps, render.fps_base = read["fps"], read["fps_base"]
    bpy.context.scene.frame_start = int(read["frame_start"])
    bpy.context.scene.frame_end = int(-(-read["frame_end"] // 1))
    owner.animation_data_create()
    owner.animation_data.action = bpy.data.actions.new("slew")
    for curve in read["curves"]:
        set_curve(owner, curve, targets or {})
