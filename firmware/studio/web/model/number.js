// Numbers as a person reads them.

// At most `decimals` of them, and no more than needed.
export function shortNumber(value, decimals) {
  const text = value.toFixed(Math.min(Math.max(decimals, 0), 9));
  const short = text.includes(".") ? text.replace(/\.?0+$/, "") : text;
  return short === "-0" ? "0" : short;
}

// How many decimals tell apart values that differ by `step`.
export function decimalsFor(step) {
  if (!(step > 0)) return 6;
  return Math.min(Math.max(Math.ceil(-Math.log10(step) - 1e-9), 0), 9);
}

// The roundest number within half of `step` of a value: what a drag writes, so
// that a file has 137.4 mm and not 137.41873201.
export function roundFor(value, step) {
  return Number(value.toFixed(decimalsFor(step)));
}

// Three significant digits and the unit: "1.25 mm/s".
export function withUnit(value, unit, order = 0) {
  if (!Number.isFinite(value)) return "not limited";
  const size = Math.abs(value);
  const decimals = size >= 100 ? 1 : size >= 1 ? 2 : 4;
  const per = ["", "/s", "/s²", "/s³"][order];
  return `${shortNumber(value, decimals)} ${unit}${per}`;
}

// "12.40 s", or "f298" where a frame rate is given and asked for.
export function timeText(seconds, fps = null) {
  if (fps) return `f${shortNumber(seconds * fps, 1)}`;
  return `${seconds.toFixed(2)} s`;
}

export function clamp(value, low, high) {
  return Math.min(Math.max(value, low), high);
}
