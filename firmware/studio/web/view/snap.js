// What a dragged time or value clings to.

// `near` in seconds.  Targets: { fps, seconds, playhead, markers, keys }, each
// absent where it is switched off.  Things win over grids where both are near.
export function snapTime(t, targets, near) {
  const things = [];
  if (targets.playhead !== undefined) things.push({ t: targets.playhead, to: "playhead" });
  for (const marker of targets.markers ?? []) things.push({ t: marker, to: "marker" });
  for (const key of targets.keys ?? []) things.push({ t: key, to: "key" });
  const thing = closest(things, t, near);
  if (thing !== null) return thing;
  const grid = [];
  if (targets.fps) grid.push({ t: Math.round(t * targets.fps) / targets.fps, to: "frame" });
  if (targets.seconds) grid.push({ t: Math.round(t), to: "second" });
  return closest(grid, t, near) ?? { t, to: null };
}

function closest(candidates, t, near) {
  let best = null;
  for (const each of candidates) {
    const away = Math.abs(each.t - t);
    if (away <= near && (best === null || away < Math.abs(best.t - t))) best = each;
  }
  return best;
}

export function snapValue(value, values, near) {
  let best = value;
  let shortest = near;
  for (const each of values) {
    const away = Math.abs(each - value);
    if (away <= shortest) {
      shortest = away;
      best = each;
    }
  }
  return best;
}
