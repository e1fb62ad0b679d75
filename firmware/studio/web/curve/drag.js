// How far a drag goes: pixels to seconds and values, with locks, fine steps and
// snapping.  Pure.
import { clamp } from "../model/number.js";
import { secondsPerPixel, valuePerPixel } from "../view/scale.js";
import { snapTime, snapValue } from "../view/snap.js";

const fine = 0.1;
const snapPixels = 8;
const lockPixels = 4;

// "time" or "value" where Shift-less X or Y was pressed; null: both.
export function toggleLock(lock, wanted) {
  return lock === wanted ? null : wanted;
}

// drag: { dx, dy (px), lock, isFine, isSnapping }
// grabbed: the key under the pointer, { t, p }
// range: [least, most] seconds that the keys can go
// targets: as snapTime, with `values` beside
export function dragOf(drag, grabbed, view, range, targets) {
  const rate = drag.isFine ? fine : 1;
  const canTime = drag.lock !== "value";
  const canValue = drag.lock !== "time";
  let dt = canTime ? drag.dx * rate * secondsPerPixel(view) : 0;
  let dp = canValue ? -drag.dy * rate * valuePerPixel(view) : 0;
  let snapped = null;
  if (drag.isSnapping && canTime && Math.abs(drag.dx) >= lockPixels) {
    const near = snapPixels * secondsPerPixel(view);
    const snap = snapTime(grabbed.t + dt, targets, near);
    dt = snap.t - grabbed.t;
    snapped = snap.to;
  }
  if (drag.isSnapping && canValue && targets.values)
    dp =
      snapValue(grabbed.p + dp, targets.values, snapPixels * 0.5 * valuePerPixel(view)) - grabbed.p;
  const inside = clamp(dt, range[0], range[1]);
  return { dt: inside, dp, snapped: inside === dt ? snapped : null };
}
