// What to do about a fault, by what its text says (docs/FAULTS.md).
const rows = [
  [/e-?stop/i, "Release the emergency stop, then Reset."],
  [
    /following error/i,
    "See that the axis moves freely and the load is right; slow the move down, then Reset.",
  ],
  [/limit switch/i, "Jog the axis away from its limit switch after Reset and Enable."],
  [
    /outside|limits?\b.*set point|set point/i,
    "Load the move again; report it if it comes back: planning should have refused it.",
  ],
  [
    /heartbeat|gone|lost|rebooted|boot/i,
    "See to the drive's power and cable, then Reset; home it if it was without power.",
  ],
  [
    /bus.?off|passive|interface|no frames|frames/i,
    "See to the cable, its terminators and the bit rate, then Reset.",
  ],
  [/another master/i, "Another program sends on this bus: end it, then Reset."],
  [
    /ticks/i,
    "This computer was too busy: end other programs, or run slew with real-time priority, then Reset.",
  ],
  [
    /torque.*not|not confirmed/i,
    "The drive has not said that it is without torque: take its power off.",
  ],
  [/enable/i, "See to the drive's power stage and its enable input, then Reset."],
  [/homing/i, "See to the home switch and the direction, then home again."],
  [/drive/i, "Look the code up in the drive's manual, take the cause away, then Reset."],
];

export function adviceFor(text) {
  const row = rows.find(([pattern]) => pattern.test(text));
  return row ? row[1] : "Take the cause away, then Reset and Enable.";
}
