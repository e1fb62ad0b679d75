// One pane: its grid, the limits, and the curves in it.
import { shortNumber, decimalsFor } from "../model/number.js";
import { ticks, timeToX, timeTicks, valueToY } from "../view/scale.js";

const paneNames = ["position", "velocity", "acceleration", "jerk"];
const per = ["", "/s", "/s²", "/s³"];

export function clipTo(context, pane, draw) {
  context.save();
  context.beginPath();
  context.rect(pane.left, pane.top, pane.width, pane.height);
  context.clip();
  draw();
  context.restore();
}

export function drawRuler(context, ruler, span, fps, colours) {
  context.fillStyle = colours.ground;
  context.fillRect(0, ruler.top, ruler.left + ruler.width, ruler.height);
  context.fillStyle = colours.quiet;
  context.font = "11px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  const { step, values } = timeTicks(span.from, span.to, ruler.width / 80, fps);
  for (const t of values) {
    const text = fps ? `f${Math.round(t * fps)}` : `${shortNumber(t, decimalsFor(step))} s`;
    context.fillText(text, timeToX({ ...ruler, ...span }, t), ruler.top + 9);
  }
}

export function drawGrid(context, pane, view, fps, colours) {
  context.fillStyle = colours.pane;
  context.fillRect(pane.left, pane.top, pane.width, pane.height);
  context.lineWidth = 1;
  context.strokeStyle = colours.faint;
  context.beginPath();
  for (const t of timeTicks(view.from, view.to, pane.width / 80, fps).values) {
    const x = Math.round(timeToX(view, t)) + 0.5;
    context.moveTo(x, pane.top);
    context.lineTo(x, pane.top + pane.height);
  }
  context.stroke();
  context.font = "11px system-ui, sans-serif";
  context.textBaseline = "middle";
  context.textAlign = "right";
  const { step, values } = ticks(view.low, view.high, Math.max(pane.height / 34, 2));
  for (const value of values) {
    const y = Math.round(valueToY(view, value)) + 0.5;
    context.strokeStyle = value === 0 ? colours.line : colours.faint;
    context.beginPath();
    context.moveTo(pane.left, y);
    context.lineTo(pane.left + pane.width, y);
    context.stroke();
    context.fillStyle = colours.quiet;
    if (y > pane.top + 16 && y < pane.top + pane.height - 4)
      context.fillText(shortNumber(value, decimalsFor(step)), pane.left - 6, y);
  }
}

// What a pane shows and its unit, over the curves.
export function drawLabel(context, pane, order, axis, colours) {
  const name = order === 0 && axis?.isOther ? axis.name : paneNames[order];
  const label = axis === null ? name : `${name}, ${axis.unit}${per[order]}`;
  context.font = "11px system-ui, sans-serif";
  context.textBaseline = "middle";
  context.textAlign = "left";
  context.globalAlpha = 0.85;
  context.fillStyle = colours.pane;
  context.fillRect(pane.left + 3, pane.top + 2, context.measureText(label).width + 6, 14);
  context.globalAlpha = 1;
  context.fillStyle = colours.text;
  context.fillText(label, pane.left + 6, pane.top + 9);
}

// What lies outside the limits is shaded, with a line at the limit.
export function drawBand(context, pane, view, order, axis, colours) {
  const [low, high] = axis.limits[order];
  if (!Number.isFinite(high) || (order > 0 && !(high > 0))) return;
  clipTo(context, pane, () => {
    const top = valueToY(view, high);
    const bottom = valueToY(view, low);
    context.fillStyle = colours.band;
    context.fillRect(pane.left, pane.top - 1, pane.width, Math.max(top - pane.top + 1, 0));
    context.fillRect(pane.left, bottom, pane.width, Math.max(pane.top + pane.height - bottom, 0));
    context.strokeStyle = colours.bad;
    context.setLineDash([4, 4]);
    context.beginPath();
    for (const y of [top, bottom]) {
      context.moveTo(pane.left, y);
      context.lineTo(pane.left + pane.width, y);
    }
    context.stroke();
    context.setLineDash([]);
  });
}

// Samples are the lowest and highest value of a column: a line through them that
// loses no peak.
export function drawSamples(context, pane, view, order, samples, sampled, style) {
  const count = samples.length / 8;
  const step = (sampled.to - sampled.from) / count;
  clipTo(context, pane, () => {
    context.strokeStyle = style.colour;
    context.lineWidth = style.width;
    context.setLineDash(style.dash ?? []);
    context.beginPath();
    for (let i = 0; i < count; i++) {
      const x = timeToX(view, sampled.from + (i + 0.5) * step);
      const low = valueToY(view, samples[8 * i + 2 * order]);
      const high = valueToY(view, samples[8 * i + 2 * order + 1]);
      if (Number.isNaN(low)) continue;
      // In turn from below and from above, so that the line goes on.
      context.lineTo(x, i % 2 ? low : high);
      if (Math.abs(low - high) > 0.5) context.lineTo(x, i % 2 ? high : low);
    }
    context.stroke();
    context.setLineDash([]);
  });
}

// The columns in which a limit is broken, at the very bottom and on the line.
export function drawBroken(context, pane, view, order, axis, sampled, colours) {
  const [low, high] = axis.limits[order];
  if (order > 0 && !(high > 0)) return;
  const { samples } = axis;
  const count = samples.length / 8;
  const step = (sampled.to - sampled.from) / count;
  const slack = order === 0 ? 1e-9 : 1e-9 * Math.abs(high);
  clipTo(context, pane, () => {
    context.fillStyle = colours.bad;
    for (let i = 0; i < count; i++) {
      const least = samples[8 * i + 2 * order];
      const most = samples[8 * i + 2 * order + 1];
      if (!(least < low - slack || most > high + slack)) continue;
      const x = timeToX(view, sampled.from + i * step);
      const wide = Math.max((pane.width * step) / (view.to - view.from), 2);
      context.fillRect(x, pane.top + pane.height - 4, wide, 4);
      const y = valueToY(view, most > high + slack ? most : least);
      context.fillRect(
        x - 1,
        Math.min(Math.max(y, pane.top + 1), pane.top + pane.height - 4) - 1.5,
        wide + 2,
        3,
      );
    }
  });
}
