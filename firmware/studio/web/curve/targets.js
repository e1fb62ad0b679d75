// What can be grabbed on the canvas, in pixels, for view/hit.js.
import { firstAtOrAfter } from "../view/hit.js";
import { timeToX, valueToY } from "../view/scale.js";

const margin = 12; // px beyond the view

// Where a key is, or where the drag under way has it: planning may take longer than
// the pointer.
function placeOf(moved, key, at) {
  const now = moved?.get(key);
  return now === undefined ? at : { ...at, ...now };
}

// `moved`: by axis and key, { t, p } of what is dragged.
export function keyTargets(axes, viewFor, moved) {
  const targets = [];
  for (const axis of axes) {
    const view = viewFor(axis);
    const beyond = (margin * (view.to - view.from)) / view.width;
    for (let i = firstAtOrAfter(axis.keys, view.from - beyond); i < axis.keys.length; i++) {
      const at = placeOf(moved?.get(axis.name), i, axis.keys[i]);
      if (at.t > view.to + beyond) break;
      targets.push({
        kind: "key",
        axis: axis.name,
        key: i,
        at,
        x: timeToX(view, at.t),
        y: valueToY(view, at.p),
      });
    }
  }
  return targets;
}

// Both handles of every key that is picked.
export function handleTargets(axes, picked, viewFor) {
  const targets = [];
  for (const { axis: name, key, at } of picked) {
    const view = viewFor(axes.find((axis) => axis.name === name));
    for (const side of ["left", "right"]) {
      const handle = at[side];
      if (handle === null) continue;
      targets.push({
        kind: "handle",
        side,
        axis: name,
        key,
        at,
        handle,
        x: timeToX(view, at.t + handle.dt),
        y: valueToY(view, at.p + handle.dp),
        keyX: timeToX(view, at.t),
        keyY: valueToY(view, at.p),
      });
    }
  }
  return targets;
}

export function sheetTargets(axes, rows, span, moved) {
  const targets = [];
  for (const row of rows) {
    const axis = axes.find((each) => each.name === row.axis);
    const view = { ...row, ...span, low: 0, high: 1 };
    for (let i = firstAtOrAfter(axis.keys, span.from); i < axis.keys.length; i++) {
      const at = placeOf(moved?.get(axis.name), i, axis.keys[i]);
      if (at.t > span.to) break;
      targets.push({
        kind: "key",
        axis: axis.name,
        key: i,
        at,
        x: timeToX(view, at.t),
        y: row.top + row.height / 2,
      });
    }
  }
  return targets;
}
