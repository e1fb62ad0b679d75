// The binary frames of the server (docs/STUDIO.md), little-endian.
const magic = 0x31574c53; // "SLW1"
const headBytes = 88;
const axisBytes = 104;
const busBytes = 24;
const mostAxes = 64;
const mostBuses = 32;

export const stateNames = ["off", "ready", "moving", "holding", "stopping", "fault"];

function q32(view, at) {
  return Number(view.getBigInt64(at, true)) / 2 ** 32;
}

function q30(view, at) {
  return Number(view.getBigInt64(at, true)) / 2 ** 30;
}

function pathSeconds(view, at) {
  return Number(view.getBigInt64(at, true)) / 4096 / 1e9;
}

function lastLowHigh(view, at) {
  return { last: q32(view, at), low: q32(view, at + 8), high: q32(view, at + 16) };
}

function readAxis(view, at) {
  const bits = view.getUint8(at + 89);
  const isKnown = (bit) => (bits & bit) !== 0;
  return {
    demand: lastLowHigh(view, at),
    actual: lastLowHigh(view, at + 24),
    error: lastLowHigh(view, at + 48),
    velocity: q32(view, at + 72),
    torque: isKnown(4) ? view.getInt32(at + 80, true) / 10 : null, // %
    statusword: isKnown(128) ? view.getUint16(at + 84, true) : null,
    faultCode: view.getUint16(at + 86, true),
    drive: view.getUint8(at + 88),
    known: isKnown(1),
    homed: isKnown(2),
    switches: { home: isKnown(8), low: isKnown(16), high: isKnown(32), probe: isKnown(64) },
  };
}

function readBus(view, at) {
  return {
    busyNs: Number(view.getBigInt64(at, true)),
    errors: Number(view.getBigUint64(at + 8, true)),
    state: view.getInt32(at + 16, true),
  };
}

function readHead(view) {
  const bits = view.getUint8(81);
  return {
    number: view.getUint32(8, true),
    ticks: view.getUint32(12, true),
    tick: Number(view.getBigUint64(16, true)),
    time: Number(view.getBigInt64(24, true)) / 1e9,
    path: pathSeconds(view, 32),
    end: pathSeconds(view, 40),
    rate: q30(view, 48),
    override: q30(view, 56),
    ticksLost: view.getUint32(64, true),
    ticksUnseen: view.getUint32(68, true),
    latestUs: Number(view.getBigInt64(72, true)) / 1e3,
    state: stateNames[view.getUint8(80)] ?? "unknown",
    enabling: (bits & 1) !== 0,
    homing: (bits & 2) !== 0,
    jogging: (bits & 4) !== 0,
    reversed: (bits & 8) !== 0,
    torqueOff: (bits & 16) !== 0,
    real: (bits & 32) !== 0,
    joined: view.getUint32(84, true),
  };
}

// What a frame says, or null where it is not one: too short, too long, or of
// another version.
export function readFrame(buffer) {
  const view = new DataView(buffer);
  if (view.byteLength < headBytes || view.getUint32(0, true) !== magic) return null;
  const axes = view.getUint16(4, true);
  const buses = view.getUint8(6);
  const lines = view.getUint8(7);
  if (axes > mostAxes || buses > mostBuses) return null;
  const busesAt = headBytes + axes * axisBytes;
  const linesAt = busesAt + buses * busBytes;
  if (view.byteLength !== linesAt + lines) return null;
  const each = (count, read, at, size) =>
    Array.from({ length: count }, (_, i) => read(view, at + i * size));
  return {
    ...readHead(view),
    axes: each(axes, readAxis, headBytes, axisBytes),
    buses: each(buses, readBus, busesAt, busBytes),
    lines: each(lines, (from, at) => from.getInt8(at), linesAt, 1),
  };
}

// The share of a bus that was taken between two frames, 0 to 1; null where that
// cannot be said.
export function busLoad(before, after, index) {
  const span = (after.time - before.time) * 1e9;
  if (!(span > 0) || index >= before.buses.length) return null;
  const busy = after.buses[index].busyNs - before.buses[index].busyNs;
  return busy < 0 ? null : busy / span;
}
