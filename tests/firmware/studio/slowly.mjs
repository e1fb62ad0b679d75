// The text of a rig with another tick.  Ten ticks lost in a row stop a machine, and
// beside a browser or other work a tick of 1 ms is lost too often.
export function slowly(rig, tickMs) {
  const line = `tick: ${tickMs} ms\n`;
  return /^tick: /m.test(rig) ? rig.replace(/^tick: .*\n/m, line) : line + rig;
}
