// What is done to selected keys, as operations for the planner (planner.mjs): pure
// functions of the keys.  `picked` is what selectedKeys gives.

const shortest = 1e-3; // between two keys of an axis, s

function scaledHandle(handle, timeFactor, valueFactor) {
  if (handle === null || (handle.kind !== "free" && handle.kind !== "aligned")) return null;
  return { kind: handle.kind, dt: handle.dt * timeFactor, dp: handle.dp * valueFactor };
}

function given(operation) {
  return Object.fromEntries(Object.entries(operation).filter(([, value]) => value !== null));
}

// So far can all of them go in time without one passing a key that stays.
export function timeRange(axes, picked) {
  let low = -Infinity;
  let high = Infinity;
  for (const axis of axes) {
    const moved = new Set(picked.filter((each) => each.axis === axis.name).map((each) => each.key));
    for (const key of moved) {
      const at = axis.keys[key].t;
      if (key > 0 && !moved.has(key - 1)) low = Math.max(low, axis.keys[key - 1].t + shortest - at);
      if (key + 1 < axis.keys.length && !moved.has(key + 1))
        high = Math.min(high, axis.keys[key + 1].t - shortest - at);
      if (at >= 0) low = Math.max(low, 0 - at);
    }
  }
  return [Math.min(low, 0), Math.max(high, 0)];
}

export function moveKeys(picked, dt, dp, round) {
  return picked.map(({ axis, key, at }) =>
    given({
      op: "key",
      axis,
      key,
      t: dt === 0 ? null : round.time(at.t + dt),
      p: dp === 0 ? null : round.value(at.p + dp, axis),
    }),
  );
}

// Every key at or after `from`, on these axes, goes `dt` later.
export function rippleKeys(axes, from, dt, round) {
  const operations = [];
  for (const axis of axes)
    axis.keys.forEach((key, index) => {
      if (key.t >= from - 1e-9)
        operations.push({ op: "key", axis: axis.name, key: index, t: round.time(key.t + dt) });
    });
  return operations;
}

// Times grow away from `about` by `timeFactor`, positions from `aboutValue(axis)` by
// `valueFactor`; velocities, accelerations and handles follow.
export function scaleKeys(picked, { about, timeFactor = 1, aboutValue, valueFactor = 1 }, round) {
  return picked.map(({ axis, key, at }) => {
    const base = aboutValue ? aboutValue(axis) : 0;
    const mirrored = timeFactor < 0;
    const left = mirrored ? at.right : at.left;
    const right = mirrored ? at.left : at.right;
    return given({
      op: "key",
      axis,
      key,
      t: timeFactor === 1 ? null : round.time(about + (at.t - about) * timeFactor),
      p: valueFactor === 1 ? null : round.value(base + (at.p - base) * valueFactor, axis),
      v: at.v === null ? null : (at.v * valueFactor) / timeFactor,
      a: at.a === null ? null : (at.a * valueFactor) / (timeFactor * timeFactor),
      left: scaledHandle(left, timeFactor, valueFactor),
      right: scaledHandle(right, timeFactor, valueFactor),
    });
  });
}

// Forth becomes back, about the middle of what is selected.
export function mirrorTime(picked, round) {
  if (picked.length === 0) return [];
  const times = picked.map((each) => each.at.t);
  const about = (Math.min(...times) + Math.max(...times)) / 2;
  return scaleKeys(picked, { about, timeFactor: -1 }, round);
}

// Up becomes down, about the middle of what is selected of each axis.
export function mirrorValue(picked, round) {
  const middle = (axis) => {
    const values = picked.filter((each) => each.axis === axis).map((each) => each.at.p);
    return (Math.min(...values) + Math.max(...values)) / 2;
  };
  return scaleKeys(picked, { about: 0, aboutValue: middle, valueFactor: -1 }, round);
}

export function removeKeys(picked) {
  return picked.map(({ axis, key }) => ({ op: "remove", axis, key }));
}

export function setHandles(picked, kind) {
  return picked.map(({ axis, key, at }) => ({
    op: "key",
    axis,
    key,
    left: { kind, dt: at.left?.dt ?? -0.1, dp: at.left?.dp ?? 0 },
    right: { kind, dt: at.right?.dt ?? 0.1, dp: at.right?.dp ?? 0 },
  }));
}

// Where a handle goes that is dragged: an automatic one becomes aligned; of aligned
// ones the other side follows, at its own length.
export function dragHandle(axis, key, at, side, dt, dp) {
  const other = side === "left" ? "right" : "left";
  const mine = at[side];
  const kind = mine.kind === "free" || mine.kind === "vector" ? "free" : "aligned";
  const inside = side === "left" ? Math.min(dt, -shortest) : Math.max(dt, shortest);
  const operation = { op: "key", axis, key, [side]: { kind, dt: inside, dp } };
  const mate = at[other];
  if (kind !== "aligned" || mate === null || mate.kind === "free" || mate.kind === "vector")
    return operation;
  return { ...operation, [other]: { kind, dt: mate.dt, dp: (dp / inside) * mate.dt } };
}

// A point in space, with other coordinates or, of a subject, at another time: only what
// changes.
export function setPoint(point, { at = [], t }) {
  const set = (path, value, unit) => ({ op: "set", path: [...point.path, ...path], value, unit });
  const place = point.t === undefined ? [] : ["1"];
  return [
    ...(t === undefined || t === point.t ? [] : [set(["0"], t, "s")]),
    ...at.flatMap((value, i) =>
      value === undefined || value === point.at[i]
        ? []
        : [set([...place, String(i)], value, point.unit)],
    ),
  ];
}

// --- the clipboard: keys with their times from the first of them

export function copyKeys(picked) {
  if (picked.length === 0) return null;
  const start = Math.min(...picked.map((each) => each.at.t));
  return picked.map(({ axis, at }) => ({ axis, dt: at.t - start, at }));
}

// At `t`; copies of one axis alone go to `onto` where that is given.
export function pasteKeys(clipboard, t, onto, round) {
  const single = new Set(clipboard.map((each) => each.axis)).size === 1;
  return clipboard.map(({ axis, dt, at }) =>
    given({
      op: "add",
      axis: single && onto ? onto : axis,
      t: round.time(t + dt),
      p: at.p,
      v: at.v,
      a: at.a,
      left: scaledHandle(at.left, 1, 1),
      right: scaledHandle(at.right, 1, 1),
    }),
  );
}
