"""Write the action of the active object as JSON for slew, handles and all.

In Blender: Scripting workspace, Open, this file, Run Script; or paste it into
the Python console and call

    slew_export("/tmp/crane.json")

Values are Blender's own (metres, radians, whatever the property holds) and times
are frames; slew converts them.  What slew cannot play (other modifiers than
Cycles, drivers, sampled curves) is listed under "lost", nothing is baked.
Works with Blender 2.93 to 5.
"""
import json

import bpy

KEY_POINTS = {"t": ("co", 0), "v": ("co", 1),
              "lt": ("handle_left", 0), "lv": ("handle_left", 1),
              "rt": ("handle_right", 0), "rv": ("handle_right", 1)}
KEY_WORDS = {"hl": "handle_left_type", "hr": "handle_right_type",
             "interp": "interpolation", "easing": "easing",
             "amplitude": "amplitude", "period": "period", "back": "back"}


def fcurves_of(owner):
    """The curves of an object, also where actions have layers and slots."""
    data = owner.animation_data
    action = data.action
    if hasattr(action, "fcurves"):
        return list(action.fcurves)
    bags = [strip.channelbag(data.action_slot)
            for layer in action.layers for strip in layer.strips]
    return [curve for bag in bags if bag for curve in bag.fcurves]


def key_of(point):
    key = {name: getattr(point, attribute)[i]
           for name, (attribute, i) in KEY_POINTS.items()}
    key.update({name: getattr(point, attribute)
                for name, attribute in KEY_WORDS.items()})
    return key


def cycles_of(curve, name, lost):
    """The Cycles modifier, which must be the first; others are lost."""
    cycles = None
    for i, modifier in enumerate(curve.modifiers):
        if modifier.mute:
            continue
        restricted = (modifier.use_restricted_range or
                      modifier.use_influence)
        if modifier.type == "CYCLES" and i == 0 and not restricted:
            cycles = {"mode_before": modifier.mode_before,
                      "mode_after": modifier.mode_after,
                      "count_before": modifier.cycles_before,
                      "count_after": modifier.cycles_after}
        else:
            lost.append("%s: modifier %s" % (name, modifier.type))
    return cycles


def curve_of(curve, lost):
    name = "%s[%d]" % (curve.data_path, curve.array_index)
    if not curve.keyframe_points:
        lost.append("%s: no keys" % name)
        return None
    return {"name": name,
            "extrapolation": curve.extrapolation,
            "auto_smoothing": curve.auto_smoothing,
            "cycles": cycles_of(curve, name, lost),
            "keys": [key_of(point) for point in curve.keyframe_points]}


def slew_export(path, owner=None):
    owner = owner or bpy.context.object
    if not (owner and owner.animation_data and owner.animation_data.action):
        raise ValueError("the active object has no action")
    scene, lost = bpy.context.scene, []
    curves = [curve_of(curve, lost) for curve in fcurves_of(owner)]
    lost += ["%s: driver" % driver.data_path
             for driver in owner.animation_data.drivers]
    with open(path, "w", encoding="utf-8") as file:
        json.dump({"format": "slew-blender-1",
                   "object": owner.name,
                   "fps": scene.render.fps,
                   # single precision: 1.001 is 1.00100004673
                   "fps_base": round(scene.render.fps_base, 6),
                   "lost": lost,
                   "curves": [curve for curve in curves if curve]},
                  file, indent=1)
    for what in lost:
        print("slew: lost", what)


if __name__ == "__main__" and bpy.data.filepath:
    slew_export(bpy.path.ensure_ext(bpy.data.filepath, ".json"))
