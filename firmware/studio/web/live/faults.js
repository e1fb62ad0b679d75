// What to do about a fault, by its code (CONTROLLER_FAULT_LIST in
// firmware/control/controller.h; docs/FAULTS.md).
export const advices = {
  DRIVE: "Look the code up in the drive's manual, take the cause away, then Reset.",
  OFFLINE: "See to the drive's power and cable, then Reset; home it if it was without power.",
  STATE:
    "Somebody or something took the drive out of operation: see to its enable input, then Reset.",
  STALE: "See to the drive's cable and the load of its bus, then Reset.",
  FOLLOWING:
    "See that the axis moves freely and the load is right; slow the move down, then Reset.",
  RUNAWAY:
    "The axis moved away from where it was sent: see to the sign of its encoder and motor, its coupling and its load before Reset.",
  GATE: "Load the move again; report it if it comes back: planning should have refused it.",
  ESTOP: "Release the emergency stop, then Reset.",
  ESTOP_CHANNELS:
    "Press the emergency stop and release it; see to its wiring if it comes back. Then Reset.",
  LIMIT_SWITCH: "Jog the axis away from its limit switch after Reset and Enable.",
  ENABLE: "See to the drive's power stage and its enable input, then Reset.",
  OVERRUN:
    "This computer was too busy: end other programs, or run slew with real-time priority, then Reset.",
  MASTER: "Another program sends on this bus: end it, then Reset.",
  BUS_FULL: "See to the cable and the bit rate, and that a node answers, then Reset.",
  BUS_PASSIVE: "See to the cable, its terminators and the bit rate, then Reset.",
  BUS: "See to the cable, its terminators and the bit rate, then Reset.",
  REST: "See that the axes can brake as hard as their limits say, then Reset.",
  TRACK: "The file of the move was read too slowly: put it on a local disk, then Reset.",
  GUARDIAN:
    "Nobody would take the drives' torque if slew were killed: see who ended its guardian, and start slew again.",
  COUNTER: "Move the axis back by hand, or clear the drive's position, then Reset and home it.",
  INPUT: "See that the input's chip and cable are there, then Reset.",
  RACKING: "See what holds one rail back, square the bridge by hand, then Reset and home it.",
  ARRIVAL: "See that the axis moves freely and its profile is possible, then Reset.",
};

export function adviceFor(code) {
  return advices[code] ?? "Take the cause away, then Reset and Enable.";
}
