#!/usr/bin/env python3
"""Do docs/schema and the readers agree?

    python3 tests/proofs/check_schema.py [build/tests/firmware/host/rig/test_rig_load]

The schemas are what an editor checks, the C tables what slew checks.  Checked:
the schemas are schemas; they accept the examples, the register maps and the quirks;
every map has the same keys,
the same of them required, and every choice the same words, on both sides; of
the malformed files in tests/data/bad they refuse all but those in BEYOND.
"""
import glob
import json
import os
import re
import subprocess
import sys

import jsonschema
import yaml

# Malformed in ways that need more than a schema: order, sums, other values.
BEYOND = {
    "map_apart_shared",
    "map_apart_unknown",
    "map_bounds_reversed",
    "map_condition_float",
    "map_group_too_long",
    "map_never",
    "map_status_not_polled",
    "map_step_value_range",
    "map_scale_name",
    "map_scale_polled",
    "map_scale_unit",
    "map_too_many_reads",
    "map_until_unknown",
    "map_unknown_item",
    "move_back_unused",
    "move_blend_axis_of_base",
    "move_blend_axis_twice",
    "move_blend_base_weighted",
    "move_blend_negative",
    "move_blend_unknown_pose",
    "move_blend_weight_unit",
    "move_camera_axis_of_path",
    "move_camera_dwell_beyond",
    "move_camera_end_open",
    "move_camera_no_direction",
    "move_camera_up_is_forward",
    "move_camera_without_path",  # a rig with kinematics needs none
    "move_coupling_cam_curve",
    "move_coupling_driven",
    "move_coupling_order",
    "move_coupling_unknown_master",
    "move_duplicate_axis",  # the YAML library keeps the last
    "move_ease_order",
    "move_easing_unused",
    "move_ends_of_another",
    "move_event_without_line",
    "move_frame_without_rate",
    "move_grid_zero",
    "move_handle_computed",
    "move_handle_missing",
    "move_handle_wrong_side",
    "move_handles_unused",
    "move_key_velocity_unused",
    "move_layer_axis",
    "move_left_unused",
    "move_mu_range",
    "move_mu_unused",
    "move_negative_time",
    "move_path_axis_twice",
    "move_path_backwards",
    "move_path_closed",
    "move_path_corner_missing",
    "move_path_drawn_half",
    "move_path_law_without_time",
    "move_path_mixed_units",
    "move_path_point_of_two",
    "move_path_point_twice",
    "move_path_to_unused",
    "move_path_unknown_axis",
    "move_time_too_large",
    "move_times_decrease",
    "move_times_equal",
    "move_too_large",
    "move_unknown_axis",
    "move_until_zero",
    "move_velocity_needed",
    "move_velocity_unused",
    "move_warp_before_start",
    "move_warp_position",
    "move_wrong_unit",
    "rig_anchor",
    "rig_angle_on_mm",
    "rig_bandwidth",
    "rig_payload_slanted",
    "rig_payload_wall",
    "rig_shaper_damping",
    "rig_shaper_frequency",
    "rig_shaper_unused",
    "rig_bit_rate",
    "rig_cia402_bandwidth_unused",
    "rig_cia402_guarding",
    "rig_cia402_times_boot",
    "rig_cia402_times_sdo",
    "rig_cia402_no_bandwidth",
    "rig_cia402_revolution",
    "rig_cia402_torque_stop",
    "rig_control_escape",
    "rig_counts_overflow",
    "rig_counts_unit",
    "rig_counts_zero",
    "rig_data_bit_rate",
    "rig_duplicate_key",
    "rig_homing_above_limit",
    "rig_homing_away",
    "rig_homing_go_outside",
    "rig_homing_method_missing",
    "rig_homing_moteus",
    "rig_homing_no_line",
    "rig_homing_odrive_method",
    "rig_homing_odrive_slow",
    "rig_homing_slow_above",
    "rig_homing_unused",
    "rig_infinite",  # a number to YAML
    "rig_line_axis_missing",
    "rig_line_axis_unknown",
    "rig_line_axis_unused",
    "rig_homing_hard_stop_torque",
    "rig_homing_hard_stop_modbus",
    "rig_homing_hard_stop_unrated",
    "rig_homing_torque_of_switch",
    "rig_line_discrepancy",
    "rig_line_lamp_bias",
    "rig_line_lead",
    "rig_line_nine_triggers",
    "rig_line_release",
    "rig_line_rest_unused",
    "rig_line_sim_reversed",
    "rig_line_sim_unused",
    "rig_line_switch_twice",
    "rig_line_three_estops",
    "rig_line_width",
    "rig_merge_key",
    "rig_monitor_cold",
    "rig_monitor_current_zero",
    "rig_monitor_hot",
    "rig_monitor_moteus",
    "rig_monitor_no_object",
    "rig_monitor_no_such",
    "rig_monitor_object",
    "rig_monitor_voltage_order",
    "rig_moteus_without_fd",
    "rig_nan",  # a number to YAML
    "rig_negative_limit",
    "rig_no_buses",
    "rig_node_ours",
    "rig_odrive_endpoints",
    "rig_odrive_no_watchdog",
    "rig_odrive_unwatched",
    "rig_odrive_with_fd",
    "rig_range_reversed",
    "rig_sim_home_switch",
    "rig_sim_device",
    "rig_sim_load_static",
    "rig_sim_load_pitch_error",
    "rig_sim_loops_below",
    "rig_sim_loops_current",
    "rig_sim_loops_fast",
    "rig_sim_loops_multiple",
    "rig_sim_loops_period",
    "rig_sim_loops_reset",
    "rig_sim_loops_sampled",
    "rig_sim_loops_slow",
    "rig_sim_motor_steep",
    "rig_sim_load_stops",
    "rig_sim_load_stribeck",
    "rig_start_outside",
    "rig_stop_below",
    "rig_stop_jerk",
    "rig_tag",
    "rig_tick_fraction",
    "rig_tick_range",
    "rig_too_large",
    "rig_too_many_digits",
    "rig_turns_digits",
    "rig_turns_overflow",
    "rig_unknown_bus",
    "rig_virtual_homing",
    "rig_virtual_line",
    "rig_virtual_sim",
    "rig_watchdog",
    "rig_zero_limit",
}


# Files that slew reads.
GOOD = {
    "rig": ("examples/*/rig.yaml",),
    "move": ("examples/*/move.yaml",),
    "faults": ("examples/*/faults.yaml", "tests/data/faults/*.yaml"),
    "map": ("hal/maps/*.yaml", "tests/data/maps/*.yaml"),
    "quirks": ("hal/quirks/*.yaml",),
}


class Core(yaml.SafeLoader):
    """YAML 1.2 as editors read it: `on` is a word, 8E1 a number."""


Core.yaml_implicit_resolvers = {
    first: [(tag, regexp) for tag, regexp in resolvers
            if tag != "tag:yaml.org,2002:bool"]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
Core.add_implicit_resolver(
    "tag:yaml.org,2002:bool",
    re.compile("^(true|True|TRUE|false|False|FALSE)$"), list("tTfF"))
Core.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)[eE][-+]?[0-9]+$"),
    list("-+.0123456789"))


def load_schema(name):
    with open(f"docs/schema/{name}.schema.json", encoding="utf-8") as file:
        schema = json.load(file)
    jsonschema.Draft7Validator.check_schema(schema)
    return schema


def schema_keys(name, schema):
    """{(file, shape, key, required or optional)}"""
    shapes = dict(schema["definitions"])
    shapes[name] = schema
    return {
        (name, shape, key,
         "required" if key in body.get("required", []) else "optional")
        for shape, body in shapes.items() if "properties" in body
        for key in body["properties"]
    }


def words_of(schema, value):
    """The enum behind a value, through references."""
    if "enum" in value:
        return value["enum"]
    for part in value.get("allOf", []) + value.get("anyOf", []) + [value]:
        if "$ref" in part:
            name = part["$ref"].rsplit("/", 1)[1]
            return words_of(schema, schema["definitions"][name])
    return []


def schema_words(name, schema, places):
    """{(file, shape.key, word)} for the choices that the tables have."""
    shapes = {**schema["definitions"], name: schema}
    return {
        (name, place, word)
        for place in places
        for word in words_of(schema, shapes[place.split(".")[0]]["properties"][
            place.split(".")[1]])
    }


def reader_rows(program):
    """Rows of test_rig_load --fields, by their first word."""
    text = subprocess.run([program, "--fields"], check=True,
                          capture_output=True, text=True).stdout
    rows = {"key": set(), "word": set()}
    for line in text.splitlines():
        kind, *row = line.split(" ")
        rows[kind].add(tuple(row))
    return rows


def differences(what, readers, schemas):
    return ([f"{what} {' '.join(row)}: readers only"
             for row in sorted(readers - schemas)] +
            [f"{what} {' '.join(row)}: schema only"
             for row in sorted(schemas - readers)])


def check_names(program, schemas):
    rows = reader_rows(program)
    keys = set().union(*(schema_keys(n, s) for n, s in schemas.items()))
    words = set().union(*(
        schema_words(n, s, {row[1] for row in rows["word"] if row[0] == n})
        for n, s in schemas.items()))
    return (differences("key", rows["key"], keys) +
            differences("word", rows["word"], words))


def is_accepted(schema, path):
    """False as well when the file is no YAML."""
    try:
        with open(path, encoding="utf-8") as file:
            value = yaml.load(file, Core)
    except (yaml.YAMLError, UnicodeDecodeError):
        return False
    return jsonschema.Draft7Validator(schema).is_valid(value)


def check_files(schemas):
    wrong = []
    for name, schema in schemas.items():
        good = sorted(sum(map(glob.glob, GOOD[name]), []))
        if not good:
            wrong.append(f"{name}: no file that the schema could accept")
        for path in good:
            if not is_accepted(schema, path):
                wrong.append(f"{path}: refused by the schema")
        for path in sorted(glob.glob(f"tests/data/bad/{name}_*.yaml")):
            stem = os.path.basename(path)[:-len(".yaml")]
            if is_accepted(schema, path) != (stem in BEYOND):
                wrong.append(f"{path}: the schema does not say as listed")
    return wrong


def built_program():
    """The program that holds the tables, made up to date."""
    program = "build/tests/firmware/host/rig/test_rig_load"
    subprocess.run(["make", "--silent", program], check=True)
    return program


def main():
    if len(sys.argv) > 2:
        sys.exit(__doc__)
    program = sys.argv[1] if len(sys.argv) == 2 else built_program()
    schemas = {name: load_schema(name) for name in GOOD}
    wrong = check_names(program, schemas) + check_files(schemas)
    for line in wrong:
        print(line)
    print(f"schema: {len(wrong)} differences")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
