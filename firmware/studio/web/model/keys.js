// The keys of an axis, from the numbers that the planner gives (planner.mjs).
export const orderNames = ["position", "velocity", "acceleration", "jerk"];

function handle(numbers, at, kinds) {
  const [kind, dt, dp] = numbers.subarray(at, at + 3);
  return Number.isNaN(dt) ? null : { kind: kinds[kind], dt, dp };
}

function optional(value) {
  return Number.isNaN(value) ? null : value;
}

function readKey(row, words) {
  return {
    t: row[0],
    p: row[1],
    v: optional(row[2]),
    a: optional(row[3]),
    line: row[4],
    column: row[5],
    curve: words.curves[row[6]],
    fixed: row[7],
    left: handle(row, 8, words.handles),
    right: handle(row, 11, words.handles),
    interpolation: words.interpolations[row[14]] ?? null,
    easing: words.easings[row[15]] ?? null,
    slope: row[16],
  };
}

const rows = new WeakMap(); // the numbers that a key was read from

function isSameRow(a, b) {
  return a?.length === b.length && a.every((value, i) => Object.is(value, b[i]));
}

// [{ t, p, v, a, line, column, curve, fixed, left, right, slope }]; a key that is as at its
// place in `former` is that one.
export function readKeys(numbers, words, former = []) {
  const keys = [];
  for (let at = 0; at + words.size <= numbers.length; at += words.size) {
    const row = numbers.subarray(at, at + words.size);
    const known = former[keys.length];
    const isKnown = known !== undefined && isSameRow(rows.get(known), row);
    const key = isKnown ? known : readKey(row, words);
    if (!isKnown) rows.set(key, row);
    keys.push(key);
  }
  return keys;
}

// [{ axis, kind, order, what, time_s, value, limit, key (absent without keys), line,
// column }]
export function readViolations(numbers, words) {
  const violations = [];
  for (let at = 0; at + words.violation <= numbers.length; at += words.violation) {
    const [axis, kind, time_s, value, limit, key, line, column] = numbers.subarray(at, at + 8);
    violations.push({ axis, ...words.violations[kind], time_s, value, limit, line, column });
    if (!Number.isNaN(key)) violations.at(-1).key = key;
  }
  return violations;
}

const anywhere = [-Infinity, Infinity];
const unlimited = [anywhere, [0, 0], [0, 0], [0, 0]];

// A curve that is no axis's (how much there is of a pose, the warp, a camera's roll), as
// an axis that nothing limits; by the name that operations call it.
export function readOther({ kind, name, unit, curve, keys }) {
  return {
    kind,
    name: kind === "pose" ? `pose ${name}` : `the ${name}`,
    label: name,
    unit,
    curve,
    isOther: true,
    isKeyed: true,
    limits: unlimited,
    keys: keys.map(([t, p, line, column]) => ({
      ...{ t, p, line, column, curve, fixed: 0, slope: NaN },
      ...{ v: null, a: null, left: null, right: null },
    })),
    samples: null,
  };
}

// --- what is selected: indices of keys by the name of their axis

export function emptySelection() {
  return new Map();
}

export function isSelected(selection, axis, key) {
  return selection.get(axis)?.has(key) ?? false;
}

export function countSelected(selection) {
  let count = 0;
  for (const keys of selection.values()) count += keys.size;
  return count;
}

// `how` is "set" (only these), "add" or "toggle".
export function select(selection, picked, how) {
  const result = new Map();
  if (how !== "set") for (const [axis, keys] of selection) result.set(axis, new Set(keys));
  for (const { axis, key } of picked) {
    const keys = result.get(axis) ?? new Set();
    if (how === "toggle" && keys.has(key)) keys.delete(key);
    else keys.add(key);
    result.set(axis, keys);
  }
  for (const [axis, keys] of result) if (keys.size === 0) result.delete(axis);
  return result;
}

// [{ axis, key, at }] of what is selected and there, axis by axis, in order.
export function selectedKeys(axes, selection) {
  const picked = [];
  for (const axis of axes)
    for (const key of [...(selection.get(axis.name) ?? [])].sort((a, b) => a - b))
      if (key < axis.keys.length) picked.push({ axis: axis.name, key, at: axis.keys[key] });
  return picked;
}

// The selection again by time, after keys may have changed their places.
export function selectTimes(axes, times) {
  const selection = new Map();
  for (const { axis: name, t } of times) {
    const keys = axes.find((axis) => axis.name === name)?.keys ?? [];
    let best = -1;
    keys.forEach((key, index) => {
      if (best < 0 || Math.abs(key.t - t) < Math.abs(keys[best].t - t)) best = index;
    });
    if (best < 0 || Math.abs(keys[best].t - t) > 1e-3) continue;
    selection.set(name, (selection.get(name) ?? new Set()).add(best));
  }
  return selection;
}
