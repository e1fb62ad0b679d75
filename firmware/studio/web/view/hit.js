// What is under the pointer.  A target is { x, y, ... } in pixels.

// The nearest within the radius; of equally near ones the last, which is drawn on
// top.
export function nearest(targets, x, y, radius) {
  let best = null;
  let shortest = radius * radius;
  for (const target of targets) {
    const away = (target.x - x) ** 2 + (target.y - y) ** 2;
    if (away <= shortest) {
      shortest = away;
      best = target;
    }
  }
  return best;
}

export function boxOf(a, b) {
  return {
    left: Math.min(a.x, b.x),
    right: Math.max(a.x, b.x),
    top: Math.min(a.y, b.y),
    bottom: Math.max(a.y, b.y),
  };
}

export function inBox(targets, box) {
  return targets.filter(
    ({ x, y }) => x >= box.left && x <= box.right && y >= box.top && y <= box.bottom,
  );
}

// The first of ascending times that is not before t: where drawing may begin.
export function firstAtOrAfter(keys, t) {
  let low = 0;
  let high = keys.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (keys[middle].t < t) low = middle + 1;
    else high = middle;
  }
  return low;
}
