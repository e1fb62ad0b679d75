# tests/vm/lines_rig.sh - to be sourced: the rigs and the move of lines.sh, and
# which of gpio-sim's lines is what.
STOP=0 LOW=1 HIGH=2 LAMP=3 SHUTTER=4 FLASH=5 HOME_SWITCH=6

rig() # rig HOMING...: one axis, slow enough for the emulator
{
    cat <<RIG
title: Lines
tick: 20 ms
heartbeat: 100 ms
watchdog: 100 ms
buses:
  can0: {kind: canopen, bit_rate: 1 Mbit/s, interface: vcan0}
axes:
  slide:
    unit: mm
    limits: {position: [0 mm, 600 mm], velocity: 200 mm/s,
             acceleration: 200 mm/s2}
    following_error: {floor: 20 mm, time: 200 ms}
    drive: {kind: cia402, bus: can0, node: 5, counts: 100 per mm}
    sim: {start: 150 mm}
$*
gpio:
  stop: {kind: e-stop, line: rig0, release: 100 ms}
  low: {kind: limit-negative, axis: slide, chip: gpiochip0, line: 1}
  high: {kind: limit-positive, axis: slide, line: rig2, active: low}
  lamp: {kind: lamp, line: rig3}
  shutter: {kind: trigger, line: rig4, width: 100 ms, rest: 100 ms}
  flash: {kind: trigger, line: rig5, active: low, width: 60 ms}
RIG
}

write_rigs()
{
    mkdir -p "$dir/plain" "$dir/homing"
    rig >"$dir/plain/rig.yaml"
    {
        rig "    homing: {by: switch, input: home, speed: 50 mm/s, slow: 2 mm/s,
             distance: 250 mm, go: 50 mm}"
        echo "  home: {kind: home, axis: slide, line: rig6}"
    } >"$dir/homing/rig.yaml"
    cat >"$dir/plain/move.yaml" <<'MOVE'
title: There and back
axes:
  slide:
    curve: s-curve
    keys: [[0 s, 150 mm], [4.5 s, 450 mm], [9 s, 150 mm]]
events:
  - {line: shutter, every: 0.75 s}
  - {line: flash, of: slide, at: 300 mm}
MOVE
    cp "$dir/plain/move.yaml" "$dir/homing/"
}
