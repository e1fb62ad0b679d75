// The whole canvas of the curve editor, from a scene; see editor.js for its parts.
import { timeToX } from "../view/scale.js";
import {
  clipTo,
  drawBand,
  drawBroken,
  drawGrid,
  drawLabel,
  drawRuler,
  drawSamples,
} from "./draw_pane.js";

const keySize = 5;

function diamond(context, x, y, size) {
  context.beginPath();
  context.moveTo(x, y - size);
  context.lineTo(x + size, y);
  context.lineTo(x, y + size);
  context.lineTo(x - size, y);
  context.closePath();
}

function drawKeys(context, scene, targets, dimmed) {
  const { colours, isPicked, brokenKeys } = scene;
  let last = null;
  for (const target of targets) {
    const { axis, key, x, y } = target;
    const picked = isPicked(axis, key);
    // Of thousands of keys on a few pixels one is enough.
    if (last?.axis === axis && !picked && Math.abs(x - last.x) < 1 && Math.abs(y - last.y) < 1)
      continue;
    last = target;
    diamond(context, x, y, picked ? keySize + 1.5 : keySize);
    context.fillStyle = picked ? colours.text : scene.colourOf(axis);
    context.globalAlpha = dimmed(axis) ? 0.5 : 1;
    context.fill();
    context.globalAlpha = 1;
    context.lineWidth = brokenKeys.has(`${axis} ${key}`) ? 2 : 1;
    context.strokeStyle = brokenKeys.has(`${axis} ${key}`) ? colours.bad : colours.ground;
    context.stroke();
  }
}

function drawHandles(context, scene) {
  const { colours } = scene;
  for (const { x, y, keyX, keyY, handle, axis } of scene.handles) {
    context.strokeStyle = scene.colourOf(axis);
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(keyX, keyY);
    context.lineTo(x, y);
    context.stroke();
    context.beginPath();
    if (handle.kind === "free") context.rect(x - 4, y - 4, 8, 8);
    else context.arc(x, y, 4, 0, 2 * Math.PI);
    context.fillStyle = handle.kind.startsWith("auto") ? colours.pane : scene.colourOf(axis);
    context.fill();
    context.stroke();
  }
}

function drawPanes(context, scene) {
  const { layout, axes, active, colours, sampled } = scene;
  layout.panes.forEach((pane, order) => {
    const view = scene.viewFor(order, active ?? axes[0] ?? scene.nothing);
    drawGrid(context, pane, view, scene.fps, colours);
    if (active !== null) drawBand(context, pane, view, order, active, colours);
    for (const axis of axes) {
      const isActive = axis === active;
      if (!axis.samples) continue;
      const style = { colour: scene.colourOf(axis.name), width: isActive ? 2 : 1.2 };
      context.globalAlpha = isActive ? 1 : 0.6;
      drawSamples(context, pane, scene.viewFor(order, axis), order, axis.samples, sampled, style);
      context.globalAlpha = 1;
    }
    if (active?.samples && scene.compared?.samples && scene.compared.axis === active.name)
      drawSamples(context, pane, view, order, scene.compared.samples, sampled, {
        colour: colours.quiet,
        width: 1.5,
        dash: [5, 4],
      });
    for (const axis of axes)
      if (axis.samples)
        drawBroken(context, pane, scene.viewFor(order, axis), order, axis, sampled, colours);
    drawLabel(context, pane, order, active, colours);
  });
}

function shortLabel(label) {
  return label.length > 11 ? `${label.slice(0, 10)}…` : label;
}

function drawSheet(context, scene) {
  const { layout, colours } = scene;
  context.font = "11px system-ui, sans-serif";
  context.textBaseline = "middle";
  for (const row of layout.rows) {
    const isActive = row.axis === scene.active?.name;
    context.fillStyle = isActive ? colours.faint : colours.pane;
    context.fillRect(row.left, row.top + 1, row.width, row.height - 2);
    context.textAlign = "right";
    context.fillStyle = isActive ? colours.text : colours.quiet;
    context.fillText(shortLabel(row.label), row.left - 6, row.top + row.height / 2);
  }
  clipTo(context, layout.sheet, () => drawKeys(context, scene, scene.sheetKeys, () => false));
}

// The events of the move, the playhead, and where the machine is.
function drawTimes(context, scene) {
  const { layout, colours, span } = scene;
  const view = { ...layout.ruler, ...span };
  const bottom = layout.sheet.top + layout.sheet.height;
  const upright = (t, colour, width, dash) => {
    const x = timeToX(view, t);
    if (x < layout.ruler.left || x > layout.ruler.left + layout.ruler.width) return null;
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.setLineDash(dash);
    context.beginPath();
    context.moveTo(x, layout.ruler.height);
    context.lineTo(x, bottom);
    context.stroke();
    context.setLineDash([]);
    return x;
  };
  for (const marker of scene.markers) upright(marker, colours.line, 1, [2, 3]);
  if (scene.machineAt !== null) upright(scene.machineAt, colours.bad, 1.5, [6, 3]);
  const x = upright(scene.playhead, colours.accent, 1.5, []);
  if (x === null) return;
  context.fillStyle = colours.accent;
  context.beginPath();
  context.moveTo(x - 6, layout.ruler.height - 8);
  context.lineTo(x + 6, layout.ruler.height - 8);
  context.lineTo(x, layout.ruler.height);
  context.closePath();
  context.fill();
}

function drawDrag(context, scene) {
  const { drag, colours, layout } = scene;
  if (drag?.box) {
    const { left, right, top, bottom } = drag.box;
    context.fillStyle = colours.band;
    context.fillRect(left, top, right - left, bottom - top);
    context.strokeStyle = colours.accent;
    context.lineWidth = 1;
    context.strokeRect(left, top, right - left, bottom - top);
  }
  const text = drag?.error ?? drag?.text;
  if (!text) return;
  context.font = "12px system-ui, sans-serif";
  context.textAlign = "left";
  const x = layout.panes[0].left + 8;
  const y = layout.panes[0].top + layout.panes[0].height - 12;
  const width = context.measureText(text).width;
  context.fillStyle = colours.ground;
  context.fillRect(x - 4, y - 10, width + 8, 20);
  context.fillStyle = drag.error ? colours.bad : colours.text;
  context.fillText(text, x, y);
}

export function drawScene(context, scene, width, height) {
  const { layout, colours } = scene;
  context.fillStyle = colours.ground;
  context.fillRect(0, 0, width, height);
  drawPanes(context, scene);
  drawRuler(context, layout.ruler, scene.span, scene.fps, colours);
  drawSheet(context, scene);
  clipTo(context, layout.panes[0], () => {
    drawHandles(context, scene);
    drawKeys(context, scene, scene.keys, (axis) => axis !== scene.active?.name);
  });
  drawTimes(context, scene);
  drawDrag(context, scene);
}
