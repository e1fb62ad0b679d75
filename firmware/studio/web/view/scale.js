// From seconds and values to pixels and back.
//
// A view is { from, to, low, high, left, top, width, height }: seconds and values
// at the edges of a rectangle in pixels.  Functions return new views.

const shortest = 1e-3; // s, and
const longest = 3e6; //   the other end of what can be seen at once

export function timeToX(view, t) {
  return view.left + ((t - view.from) / (view.to - view.from)) * view.width;
}

export function xToTime(view, x) {
  return view.from + ((x - view.left) / view.width) * (view.to - view.from);
}

export function valueToY(view, value) {
  return view.top + ((view.high - value) / (view.high - view.low)) * view.height;
}

export function yToValue(view, y) {
  return view.high - ((y - view.top) / view.height) * (view.high - view.low);
}

export function secondsPerPixel(view) {
  return (view.to - view.from) / view.width;
}

export function valuePerPixel(view) {
  return (view.high - view.low) / view.height;
}

// Times and values move with the pointer.
export function pan(view, dx, dy) {
  const dt = -dx * secondsPerPixel(view);
  const dv = dy * valuePerPixel(view);
  return {
    ...view,
    from: view.from + dt,
    to: view.to + dt,
    low: view.low + dv,
    high: view.high + dv,
  };
}

// `factor` below 1 shows less; what is at x stays there.
export function zoomTime(view, factor, x) {
  const at = xToTime(view, x);
  const span = Math.min(Math.max((view.to - view.from) * factor, shortest), longest);
  const real = span / (view.to - view.from);
  return { ...view, from: at + (view.from - at) * real, to: at + (view.to - at) * real };
}

export function zoomValue(view, factor, y) {
  const at = yToValue(view, y);
  const span = (view.high - view.low) * factor;
  if (span < 1e-7 || span > 1e10) return view;
  return { ...view, low: at + (view.low - at) * factor, high: at + (view.high - at) * factor };
}

// A margin around what is to be seen, and a size where it has none.
export function withMargin(low, high, share = 0.08) {
  if (!(high > low)) {
    const half = Math.max(Math.abs(low) * 0.1, 1);
    return [low - half, low + half];
  }
  const margin = (high - low) * share;
  return [low - margin, high + margin];
}

// Round values at most `most` of them: { step, values }.
export function ticks(low, high, most) {
  const span = high - low;
  if (!(span > 0) || most < 1) return { step: 1, values: [] };
  const decade = 10 ** Math.floor(Math.log10(span / most));
  const step = decade * [1, 2, 5, 10].find((each) => span / (decade * each) <= most);
  const values = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; i++)
    values.push(i * step);
  return { step, values };
}

// As ticks, at whole frames while these can be told apart.
export function timeTicks(from, to, most, fps) {
  if (!fps) return ticks(from, to, most);
  const inFrames = ticks(from * fps, to * fps, most);
  const step = Math.max(1, inFrames.step);
  const values = [];
  for (let i = Math.ceil((from * fps) / step - 1e-9); i * step <= to * fps + 1e-9; i++)
    values.push((i * step) / fps);
  return { step: step / fps, values };
}
