"""Write the action of the active object as JSON for slew, handles and all.

In Blender: Scripting workspace, Open, this file, Run Script; or paste it into
the Python console and call

    slew_export("/tmp/crane.json")

Times are frames, values are Blender's own with the unit that the property has;
slew converts them.  What slew cannot play (other modifiers than Cycles, drivers,
sampled curves) is listed under "lost", nothing is baked.
Works with Blender 2.93 to 5.
"""
import json
import re

import bpy

KEY_POINTS = {"t": ("co", 0), "v": ("co", 1),
              "lt": ("handle_left", 0), "lv": ("handle_left", 1),
              "rt": ("handle_right", 0), "rv": ("handle_right", 1)}
KEY_WORDS = {"hl": "handle_left_type", "hr": "handle_right_type",
             "interp": "interpolation", "easing": "easing",
             "amplitude": "amplitude", "period": "period", "back": "back"}
# Of these, the scene's unit scale counts for lengths.
UNITS = {"LENGTH": "m", "ROTATION": "rad", "CAMERA": "mm"}
VALUES = ("v", "lv", "rv", "amplitude")


def fcurves_of(owner):
    """The curves of an object, also where actions have layers and slots."""
    data = owner.animation_data
    action = data.action
    if hasattr(action, "fcurves"):
        return list(action.fcurves)
    bags = [strip.channelbag(data.action_slot)
            for layer in action.layers for strip in layer.strips]
    return [curve for bag in bags if bag for curve in bag.fcurves]


def unit_of(owner, data_path):
    """The unit of a property, "own" where Blender does not say."""
    found = re.match(r"^(?:(.*)\.)?(\w+)$", data_path)
    try:
        holder = owner.path_resolve(found[1]) if found[1] else owner
        return UNITS.get(holder.bl_rna.properties[found[2]].unit, "own")
    except (TypeError, KeyError, ValueError, AttributeError):
        return "own"


def key_of(point, scale):
    key = {name: getattr(point, attribute)[i]
           for name, (attribute, i) in KEY_POINTS.items()}
    key.update({name: getattr(point, attribute)
                for name, attribute in KEY_WORDS.items()})
    if scale != 1:
        key.update({name: key[name] * scale for name in VALUES})
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


def curve_of(owner, curve, lost):
    name = "%s[%d]" % (curve.data_path, curve.array_index)
    if not curve.keyframe_points:
        lost.append("%s: no keys" % name)
        return None
    unit = unit_of(owner, curve.data_path)
    length = bpy.context.scene.unit_settings.scale_length
    scale = length if unit == "m" else 1
    return {"name": name,
            "unit": unit,
            "extrapolation": curve.extrapolation,
            "auto_smoothing": curve.auto_smoothing,
            "cycles": cycles_of(curve, name, lost),
            "keys": [key_of(point, scale) for point in curve.keyframe_points]}


def lines_of(action):
    """JSON with a key per line."""
    curves = action.pop("curves")
    yield json.dumps(action)[:-1] + ', "curves": ['
    for i, curve in enumerate(curves):
        keys = curve.pop("keys")
        yield json.dumps(curve)[:-1] + ', "keys": ['
        yield ",\n".join(json.dumps(key) for key in keys)
        yield "]}" + ("," if i + 1 < len(curves) else "")
    yield "]}"


def slew_export(path, owner=None):
    owner = owner or bpy.context.object
    if not (owner and owner.animation_data and owner.animation_data.action):
        raise ValueError("the active object has no action")
    scene, lost = bpy.context.scene, []
    curves = [curve_of(owner, curve, lost) for curve in fcurves_of(owner)]
    lost += ["%s: driver" % driver.data_path
             for driver in owner.animation_data.drivers]
    action = {"format": "slew-blender-1",
              "object": owner.name,
              "fps": scene.render.fps,
              # single precision: 1.001 is 1.00100004673
              "fps_base": round(scene.render.fps_base, 6),
              "frame_start": scene.frame_start,
              "frame_end": scene.frame_end,
              "lost": lost,
              "curves": [curve for curve in curves if curve]}
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(lines_of(action)) + "\n")
    for what in lost:
        print("slew: lost", what)


if __name__ == "__main__" and bpy.data.filepath:
    slew_export(bpy.path.ensure_ext(bpy.data.filepath, ".json"))
