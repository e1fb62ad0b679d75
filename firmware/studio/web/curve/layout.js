// Where things are on the editor's canvas: a ruler, four panes, and the dope sheet.
import { withMargin } from "../view/scale.js";

export const rulerHeight = 24;
export const gutter = 68; // for the numbers on the left
const rowHeight = 20;
const gap = 6;
const shares = [0.55, 0.15, 0.15, 0.15]; // position, velocity, acceleration, jerk

// { ruler, panes: [rectangle of p, v, a, j], sheet, rows: [{ axis, ...rectangle }] }
export function layOut(width, height, axes) {
  const left = gutter;
  const inner = Math.max(width - gutter - 8, 1);
  const most = Math.max(0, Math.floor((height * 0.3) / rowHeight));
  const count = Math.min(axes.length, most);
  const sheetTop = height - count * rowHeight - gap;
  const room = Math.max(sheetTop - rulerHeight - gap * 4, 4);
  let top = rulerHeight;
  const panes = shares.map((share) => {
    const pane = { left, top, width: inner, height: room * share };
    top += pane.height + gap;
    return pane;
  });
  return {
    ruler: { left, top: 0, width: inner, height: rulerHeight },
    panes,
    sheet: { left, top: sheetTop, width: inner, height: count * rowHeight },
    rows: axes.slice(0, count).map((axis, i) => ({
      axis: axis.name,
      label: axis.label ?? axis.name,
      left,
      top: sheetTop + i * rowHeight,
      width: inner,
      height: rowHeight,
    })),
  };
}

// Lowest and highest value in the samples, by order; null without any.
export function sampleRange(samples, order) {
  let low = Infinity;
  let high = -Infinity;
  for (let at = 2 * order; at < samples.length; at += 8) {
    if (samples[at] < low) low = samples[at];
    if (samples[at + 1] > high) high = samples[at + 1];
  }
  return low <= high ? [low, high] : null;
}

// An axis of the session is another object once something of it has changed, so what was
// found out about it holds.
function onceOf(find) {
  const found = new WeakMap();
  return (axis) => {
    if (!found.has(axis)) found.set(axis, find(axis));
    return found.get(axis);
  };
}

const sampledRanges = onceOf((axis) =>
  [0, 1, 2, 3].map((order) => (axis.samples ? sampleRange(axis.samples, order) : null)),
);

// The span of positions that stands for 0 to 1 in a normalised view: what the
// move uses, which does not change while one zooms.
export const positionRange = onceOf((axis) => {
  let low = Infinity;
  let high = -Infinity;
  for (const key of axis.keys) {
    low = Math.min(low, key.p);
    high = Math.max(high, key.p);
  }
  const sampled = low > high ? sampledRanges(axis)[0] : null;
  if (sampled !== null) [low, high] = sampled;
  if (low > high) [low, high] = [0, 1];
  return high > low ? [low, high] : withMargin(low, high);
});

// What an axis shows in a pane: a view of view/scale.js.  Positions by `range` in
// shares of the axis's own span, or of the span common to all; what has a limit by
// this, so that the bands of all axes are one.
export function viewOf(pane, order, axis, { from, to }, range, common) {
  const base = { ...pane, from, to };
  if (order === 0) {
    const [low, high] = common ?? positionRange(axis);
    const span = high - low;
    return { ...base, low: low + range.low * span, high: low + range.high * span };
  }
  const limit = axis.limits[order][1];
  const sampled = sampledRanges(axis)[order];
  const seen = sampled === null ? 0 : Math.max(Math.abs(sampled[0]), Math.abs(sampled[1]));
  // Above twice the limit the line leaves the pane; the mark stays.
  const most = limit > 0 ? Math.min(Math.max(limit * 1.25, seen * 1.05), limit * 2) : seen * 1.15;
  return { ...base, low: -(most || 1), high: most || 1 };
}

// The span of all axes together.
export function commonRange(axes) {
  const ranges = axes.map(positionRange);
  if (ranges.length === 0) return [0, 1];
  return [Math.min(...ranges.map((each) => each[0])), Math.max(...ranges.map((each) => each[1]))];
}

export function isInside(rectangle, x, y) {
  return (
    x >= rectangle.left &&
    x <= rectangle.left + rectangle.width &&
    y >= rectangle.top &&
    y <= rectangle.top + rectangle.height
  );
}
