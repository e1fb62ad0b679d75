// The curve editor: one canvas, its pointers and its keys.
import { effect, html, useEffect, useRef } from "../vendor/ui.js";
import { act } from "./actions.js";
import { readColours } from "./colours.js";
import { drawScene } from "./draw.js";
import { gestureAt, keyAt, longPress, pinching, wheel } from "./gestures.js";
import { actionFor } from "./keyboard.js";
import { followScene, sceneOf } from "./scene.js";

function pointOf(canvas, event) {
  const box = canvas.getBoundingClientRect();
  return { x: event.clientX - box.left, y: event.clientY - box.top };
}

// Draws once a frame at most, when something that the scene reads has changed.
class Painter {
  constructor(canvas, session, live) {
    this.canvas = canvas;
    this.size = { width: 1, height: 1 };
    this.scene = null;
    this.session = session;
    this.live = live;
    this.colours = readColours(canvas);
    this.wanted = null;
    session.paint = () => this.paint();
  }

  want() {
    this.wanted ??= requestAnimationFrame(() => this.paint());
  }

  // At once: a frame that was waited for has nothing more to draw.
  paint() {
    const begin = performance.now();
    cancelAnimationFrame(this.wanted);
    this.wanted = null;
    const ratio = devicePixelRatio || 1;
    const { width, height } = this.size;
    const context = this.canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.scene = sceneOf(this.session, this.size, this.colours, this.live);
    drawScene(context, this.scene, width, height);
    this.session.drawn(this.scene, performance.now() - begin);
  }

  fit() {
    const ratio = devicePixelRatio || 1;
    const { width, height } = this.canvas.getBoundingClientRect();
    this.size = { width: Math.max(width, 1), height: Math.max(height, 1) };
    this.canvas.width = Math.round(this.size.width * ratio);
    this.canvas.height = Math.round(this.size.height * ratio);
    this.colours = readColours(this.canvas);
    this.paint(); // a canvas of another size is empty: not for a frame
  }
}

class Pointers {
  constructor(canvas, session, painter) {
    this.canvas = canvas;
    this.session = session;
    this.painter = painter;
    this.down = new Map();
    this.gesture = null;
    this.pinch = null;
    this.press = null;
    this.event = null;
  }

  begin(event) {
    const point = pointOf(this.canvas, event);
    this.canvas.focus({ preventScroll: true });
    this.canvas.setPointerCapture(event.pointerId);
    this.down.set(event.pointerId, point);
    if (this.painter.scene === null) return;
    if (this.down.size === 2) {
      this.gesture?.cancel();
      this.gesture = null;
      clearTimeout(this.press);
      this.pinch = pinching(this.session, this.painter.scene, [...this.down.values()]);
      return;
    }
    if (this.down.size > 2) return;
    this.painter.paint(); // the scene as it is, not as it was a frame ago
    this.gesture = gestureAt(this.session, this.painter.scene, point, event);
    if (event.pointerType === "touch" && this.gesture?.isPan)
      this.press = longPress(
        this.session,
        this.painter.scene,
        point,
        (gesture) => (this.gesture = gesture),
      );
  }

  move(event) {
    const begin = performance.now();
    const point = pointOf(this.canvas, event);
    this.event = event;
    if (!this.down.has(event.pointerId)) return;
    const before = this.down.get(event.pointerId);
    if (Math.hypot(point.x - before.x, point.y - before.y) > 6) clearTimeout(this.press);
    if (this.pinch !== null) {
      this.down.set(event.pointerId, point);
      if (this.down.size === 2) this.pinch([...this.down.values()]);
      return;
    }
    this.gesture?.move(point, event, begin);
  }

  end(event) {
    clearTimeout(this.press);
    if (!this.down.delete(event.pointerId)) return;
    if (this.pinch === null) this.gesture?.end(pointOf(this.canvas, event), event);
    this.gesture = null;
    if (this.down.size === 0) this.pinch = null;
  }

  cancel() {
    clearTimeout(this.press);
    this.gesture?.cancel();
    this.gesture = null;
    this.pinch = null;
    this.down.clear();
  }
}

function onKey(event, session, pointers, onHelp) {
  const action = actionFor(event);
  if (action === null) return;
  const { gesture } = pointers;
  event.preventDefault();
  event.stopPropagation();
  if (action === "none" && gesture !== null) pointers.cancel();
  else if (action === "lock-time" || action === "lock-value")
    gesture?.lock?.(action.slice("lock-".length), pointers.event);
  else if (action === "help") onHelp();
  else void act(session, action);
}

function connect(canvas, session, live, onHelp) {
  const painter = new Painter(canvas, session, live);
  const pointers = new Pointers(canvas, session, painter);
  const on = (name, handler, options) => canvas.addEventListener(name, handler, options);
  on("pointerdown", (event) => pointers.begin(event));
  on("pointermove", (event) => pointers.move(event));
  on("pointerup", (event) => pointers.end(event));
  on("pointercancel", () => pointers.cancel());
  on("keydown", (event) => onKey(event, session, pointers, onHelp));
  on("contextmenu", (event) => event.preventDefault());
  on("dblclick", (event) => {
    const add = painter.scene && keyAt(session, painter.scene, pointOf(canvas, event));
    if (add) void session.edit([add], "Add a key");
  });
  on(
    "wheel",
    (event) => {
      event.preventDefault();
      if (painter.scene) wheel(session, painter.scene, pointOf(canvas, event), event);
    },
    { passive: false },
  );
  const sizes = new ResizeObserver(() => painter.fit());
  sizes.observe(canvas);
  const stop = effect(() => {
    followScene(session, live);
    painter.want();
  });
  return () => {
    stop();
    sizes.disconnect();
    session.paint = () => {};
  };
}

export function CurveEditor({ session, live, onHelp }) {
  const canvas = useRef(null);
  useEffect(() => connect(canvas.current, session, live, onHelp), [session]);
  return html`<canvas
    ref=${canvas}
    class="curve-canvas"
    tabindex="0"
    role="application"
    aria-label="Curve editor: keys of every axis over time, with limits. Press question mark for the keys."
    aria-describedby="notice"
  ></canvas>`;
}
