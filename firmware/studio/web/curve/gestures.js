// What a pointer does on the canvas: a mouse, a pen or fingers.
//
// One gesture at a time: an object with move(point, event, begin: when it came), end(point,
// event) and cancel(), chosen by what was under the pointer when it went down.  Two fingers
// pinch, whatever one of them did before.
import { isSelected, select } from "../model/keys.js";
import { roundFor, timeText } from "../model/number.js";
import { dragHandle, moveKeys, rippleKeys, timeRange } from "../model/operations.js";
import { boxOf, inBox, nearest } from "../view/hit.js";
import {
  secondsPerPixel,
  valuePerPixel,
  xToTime,
  yToValue,
  zoomTime,
  zoomValue,
} from "../view/scale.js";
import { dragOf, toggleLock } from "./drag.js";
import { isInside } from "./layout.js";

const radius = { mouse: 9, pen: 12, touch: 24 };
const stillPixels = 3; // less is a click
const longPressMs = 450;

export function reachOf(event) {
  return radius[event.pointerType] ?? radius.mouse;
}

// --- looking

function panning(session, scene, start) {
  const span = { ...scene.span };
  const range = { ...session.range.value };
  return {
    isPan: true,
    move(point) {
      const pane = scene.layout.panes[0];
      const dt = (-(point.x - start.x) * (span.to - span.from)) / pane.width;
      const dv = ((point.y - start.y) * (range.high - range.low)) / pane.height;
      void session.look({ from: span.from + dt, to: span.to + dt });
      session.range.value = { low: range.low + dv, high: range.high + dv };
    },
    end(point) {
      if (Math.hypot(point.x - start.x, point.y - start.y) < stillPixels)
        session.selection.value = new Map();
    },
    cancel() {},
  };
}

function scrubbing(session, scene) {
  const go = (point) => {
    const t = xToTime({ ...scene.layout.ruler, ...scene.span }, point.x);
    session.playhead.value = Math.min(Math.max(t, 0), Math.max(session.duration.value, 0));
  };
  return { move: go, end: go, cancel() {}, begin: go };
}

// --- selecting

function boxing(session, scene, start, how) {
  const inSheet = start.y >= scene.layout.sheet.top;
  return {
    move(point) {
      session.dragged.value = { box: boxOf(start, point) };
    },
    end(point) {
      session.dragged.value = null;
      const isClick = Math.hypot(point.x - start.x, point.y - start.y) < stillPixels;
      const targets = inSheet ? scene.sheetKeys : scene.keys;
      const picked = isClick ? [] : inBox(targets, boxOf(start, point));
      session.selection.value = select(session.selection.value, picked, how);
    },
    cancel() {
      session.dragged.value = null;
    },
  };
}

// --- dragging

function snapTargets(session, scene, picked) {
  const on = session.snapping.value;
  const moved = new Set(picked.map((each) => `${each.axis} ${each.key}`));
  const others = scene.keys.filter((each) => !moved.has(`${each.axis} ${each.key}`));
  return {
    fps: on.frame ? session.fps.value : null,
    seconds: on.second,
    playhead: on.playhead ? session.playhead.value : undefined,
    markers: on.marker ? scene.markers : [],
    keys: on.key ? others.map((each) => each.at.t) : [],
    values: on.key
      ? others.filter((each) => each.axis === scene.active?.name).map((each) => each.at.p)
      : null,
  };
}

function roundingOf(session, scene) {
  const time = secondsPerPixel(scene.viewFor(0, scene.active ?? scene.axes[0])) / 4;
  const value = (name) =>
    valuePerPixel(
      scene.viewFor(
        0,
        scene.rows.find((axis) => axis.name === name),
      ),
    ) / 2;
  return session.rounding(time, value);
}

function textOf(session, target, drag, round) {
  const axis = session.tracks.value.find((each) => each.name === target.axis);
  const fps = session.inFrames.value ? session.fps.value : null;
  const time = timeText(round.time(target.at.t + drag.dt), fps);
  const value = `${round.value(target.at.p + drag.dp, target.axis)} ${axis.unit}`;
  return `${target.axis}: ${time}, ${value}${drag.snapped ? `, at a ${drag.snapped}` : ""}`;
}

function draggingKeys(session, scene, start, target, onlyTime) {
  const picked = session.picked.value;
  const isRippling = session.isRippling.value;
  const from = Math.min(...picked.map((each) => each.at.t));
  const touched = scene.rows.filter((axis) => picked.some((each) => each.axis === axis.name));
  const targets = snapTargets(session, scene, picked);
  const view = scene.viewFor(
    0,
    scene.rows.find((axis) => axis.name === target.axis),
  );
  const round = roundingOf(session, scene);
  const range = isRippling ? rippleRange(touched, from) : timeRange(touched, picked);
  let lock = onlyTime ? "time" : null;
  let last = null;
  let hasMoved = false; // from then on its own place is one like others
  const operationsOf = ({ dt, dp }) =>
    isRippling
      ? mergeByKey(rippleKeys(touched, from, dt, round), moveKeys(picked, 0, dp, round))
      : moveKeys(picked, dt, dp, round);
  return {
    move(point, event, begin) {
      last = point;
      const moved = { dx: point.x - start.x, dy: point.y - start.y };
      hasMoved ||= Math.hypot(moved.dx, moved.dy) >= stillPixels;
      if (!hasMoved) return;
      const isSnapping = !(event.ctrlKey || event.metaKey);
      const drag = dragOf(
        { ...moved, lock, isFine: event.shiftKey, isSnapping },
        target.at,
        view,
        range,
        targets,
      );
      const operations = drag.dt === 0 && drag.dp === 0 ? [] : operationsOf(drag);
      const shown = {
        text: textOf(session, target, drag, round),
        moved: placesOf(operations),
      };
      void session.preview(operations, shown, begin);
    },
    lock(wanted, event) {
      if (!onlyTime) lock = toggleLock(lock, wanted);
      if (last !== null) this.move(last, event);
    },
    end(point, event) {
      if (!hasMoved && !event.shiftKey)
        session.selection.value = select(new Map(), [target], "set");
      void session.finishPreview(picked.length === 1 ? "Move a key" : `Move ${picked.length} keys`);
    },
    cancel() {
      void session.cancelPreview();
    },
  };
}

// { t, p } that operations give keys, by axis and key.
function placesOf(operations) {
  const places = new Map();
  for (const { axis, key, t, p } of operations) {
    const given = { ...(t === undefined ? {} : { t }), ...(p === undefined ? {} : { p }) };
    if (!places.has(axis)) places.set(axis, new Map());
    places.get(axis).set(key, given);
  }
  return places;
}

function rippleRange(axes, from) {
  let low = -Infinity;
  for (const axis of axes) {
    const first = axis.keys.findIndex((key) => key.t >= from - 1e-9);
    if (first < 0) continue;
    low = Math.max(low, (first > 0 ? axis.keys[first - 1].t + 1e-3 : 0) - axis.keys[first].t);
  }
  return [Math.min(low, 0), Infinity];
}

function mergeByKey(all, more) {
  const result = new Map(all.map((each) => [`${each.axis} ${each.key}`, each]));
  for (const each of more) {
    const name = `${each.axis} ${each.key}`;
    result.set(name, { ...result.get(name), ...each });
  }
  return [...result.values()];
}

function draggingHandle(session, scene, start, target) {
  const view = scene.viewFor(
    0,
    scene.axes.find((axis) => axis.name === target.axis),
  );
  const perSecond = secondsPerPixel(view);
  const perValue = valuePerPixel(view);
  let hasMoved = false;
  return {
    move(point, event, begin) {
      const rate = event.shiftKey ? 0.1 : 1;
      const [dx, dy] = [point.x - start.x, point.y - start.y];
      hasMoved ||= Math.hypot(dx, dy) >= stillPixels;
      if (!hasMoved) return;
      const dt = roundFor(target.handle.dt + dx * rate * perSecond, perSecond / 4);
      const dp = roundFor(target.handle.dp - dy * rate * perValue, perValue / 2);
      const shown = { text: `${target.side} handle: ${dt} s, ${dp}` };
      const operation = dragHandle(target.axis, target.key, target.at, target.side, dt, dp);
      void session.preview(dx === 0 && dy === 0 ? [] : [operation], shown, begin);
    },
    end() {
      void session.finishPreview("Move a handle");
    },
    cancel() {
      void session.cancelPreview();
    },
  };
}

// --- which of them

export function gestureAt(session, scene, point, event) {
  const { layout } = scene;
  if (event.button === 1 || event.altKey) return panning(session, scene, point);
  if (isInside(layout.ruler, point.x, point.y)) {
    const gesture = scrubbing(session, scene);
    gesture.begin(point);
    return gesture;
  }
  const reach = reachOf(event);
  const inSheet = isInside(layout.sheet, point.x, point.y);
  const handle = inSheet ? null : nearest(scene.handles, point.x, point.y, reach);
  if (handle !== null) return draggingHandle(session, scene, point, handle);
  const target = nearest(inSheet ? scene.sheetKeys : scene.keys, point.x, point.y, reach);
  if (target !== null) {
    const how = event.shiftKey ? "toggle" : scene.isPicked(target.axis, target.key) ? "add" : "set";
    session.selection.value = select(session.selection.value, [target], how);
    session.activate(target.axis);
    if (!isSelected(session.selection.value, target.axis, target.key)) return null;
    return draggingKeys(session, scene, point, target, inSheet);
  }
  if (inSheet) {
    const row = layout.rows.find((each) => isInside(each, point.x, point.y));
    if (row) session.activate(row.axis);
  }
  if (event.pointerType === "touch") return panning(session, scene, point);
  return boxing(session, scene, point, event.shiftKey ? "add" : "set");
}

export function longPress(session, scene, start, begin) {
  return setTimeout(() => begin(boxing(session, scene, start, "set")), longPressMs);
}

// Two fingers: what was under them stays under them.
export function pinching(session, scene, points) {
  const [a, b] = points;
  const start = { ...scene.viewFor(0, scene.active ?? scene.axes[0]), ...scene.span };
  const distance = Math.max(Math.abs(a.x - b.x), 20);
  const middle = (a.x + b.x) / 2;
  return (now) => {
    const wide = Math.max(Math.abs(now[0].x - now[1].x), 20);
    const shifted = (now[0].x + now[1].x) / 2 - middle;
    const zoomed = zoomTime(start, distance / wide, middle);
    const dt = -shifted * secondsPerPixel(zoomed);
    void session.look({ from: zoomed.from + dt, to: zoomed.to + dt });
  };
}

export function wheel(session, scene, point, event) {
  const factor = Math.exp(Math.min(Math.max(event.deltaY, -240), 240) * 0.002);
  const pane = { ...scene.layout.panes[0], ...scene.span, ...session.range.value };
  if (event.ctrlKey || event.metaKey) {
    const { low, high } = zoomValue(pane, factor, point.y);
    session.range.value = { low, high };
  } else if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
    const dt = (event.deltaX || event.deltaY) * secondsPerPixel(pane);
    void session.look({ from: pane.from + dt, to: pane.to + dt });
  } else void session.look(zoomTime(pane, factor, point.x));
}

// The place of a new key: at the pointer, on the axis that is edited.
export function keyAt(session, scene, point) {
  const { active } = scene;
  if (active === null || !active.isKeyed || !isInside(scene.layout.panes[0], point.x, point.y))
    return null;
  const view = scene.viewFor(0, active);
  const round = roundingOf(session, scene);
  return {
    op: "add",
    axis: active.name,
    t: round.time(Math.max(xToTime(view, point.x), 0)),
    p: round.value(yToValue(view, point.y), active.name),
  };
}
