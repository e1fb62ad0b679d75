// Points of the path and keys of subjects in the space view: seen, dragged, typed.
import { Vector3 } from "../vendor/space.js";
import { html } from "../vendor/ui.js";
import { roundFor } from "../model/number.js";
import { setPoint } from "../model/operations.js";
import { Choice, Field } from "../panels/inspector.js";

const metres = { mm: 1e-3, m: 1 };
const reach = { mouse: 12, pen: 14, touch: 26 };
const stillPixels = 3;
const steepest = 0.05; // of a ray to the ground: flatter ones go too far

export function nameOf(point) {
  return point.kind === "path" ? `Path point ${point.index + 1}` : `Subject at ${point.t} s`;
}

const isSame = (a, b) => a?.path.join() === b.path.join();

// Where they are in m; of the one that is dragged, where it is dragged to.  A plane path
// is at height 0.
export function placesOf(points, dragged = null) {
  return points
    .filter((point) => point.unit in metres)
    .map((point) => {
      const own = isSame(dragged?.point, point) ? dragged.at : point.at;
      return { ...point, point, at: [0, 1, 2].map((i) => (own[i] ?? 0) * metres[point.unit]) };
    });
}

// The pointer drags them: over the ground, with Shift up and down.
export class PointDrag {
  constructor(view) {
    this.view = view;
    this.dragged = null; // { point, at }
    const { canvas } = view;
    const on = (name, call) => canvas.addEventListener(name, call, { capture: true });
    on("pointerdown", (event) => this.#begin(event));
    on("pointermove", (event) => this.#move(event));
    on("pointerup", (event) => this.#end(event));
    on("pointercancel", (event) => this.#end(event, true));
    canvas.addEventListener("keydown", (event) => {
      if (event.key === "Escape" && this.dragged !== null) this.#end(event, true);
    });
  }

  // On the canvas, in pixels.
  screenOf(at) {
    const { canvas, camera } = this.view;
    const seen = new Vector3(...at).project(camera);
    return {
      x: ((seen.x + 1) / 2) * canvas.clientWidth,
      y: ((1 - seen.y) / 2) * canvas.clientHeight,
      isSeen: seen.z < 1,
    };
  }

  #under(event) {
    let best = null;
    let nearest = reach[event.pointerType] ?? reach.mouse;
    for (const place of this.view.places()) {
      const { x, y, isSeen } = this.screenOf(place.at);
      const away = Math.hypot(x - event.offsetX, y - event.offsetY);
      if (!isSeen || away > nearest) continue;
      nearest = away;
      best = place;
    }
    return best;
  }

  // Where the ray of a pixel meets the plane through `at`: level, or upright and across.
  #meet(event, at, isUpright) {
    const { canvas, camera } = this.view;
    const x = (event.offsetX / canvas.clientWidth) * 2 - 1;
    const y = 1 - (event.offsetY / canvas.clientHeight) * 2;
    const ray = new Vector3(x, y, 0.5).unproject(camera).sub(camera.position).normalize();
    const normal = isUpright ? new Vector3(ray.x, ray.y, 0).normalize() : new Vector3(0, 0, 1);
    const slope = ray.dot(normal);
    if (Math.abs(slope) < steepest) return null;
    const distance = new Vector3(...at).sub(camera.position).dot(normal) / slope;
    return camera.position.clone().addScaledVector(ray, distance);
  }

  #begin(event) {
    const place = event.button === 0 ? this.#under(event) : null;
    if (place === null) return;
    event.stopImmediatePropagation();
    const { canvas, session } = this.view;
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true });
    session.point.value = session.points.value.findIndex((each) => isSame(each, place.point));
    this.start = event;
    this.hasMoved = false; // from then on its own place is one like others
    this.place = place;
    this.dragged = { point: place.point, at: [...place.point.at] };
  }

  #move(event) {
    if (this.dragged === null) return;
    const begin = performance.now();
    event.stopImmediatePropagation();
    const { place, start } = this;
    const [dx, dy] = [event.offsetX - start.offsetX, event.offsetY - start.offsetY];
    this.hasMoved ||= Math.hypot(dx, dy) >= stillPixels;
    if (!this.hasMoved) return;
    const from = this.#meet(start, place.at, event.shiftKey);
    const to = this.#meet(event, place.at, event.shiftKey);
    if (from === null || to === null) return;
    const by = to.sub(from).toArray();
    const moves = event.shiftKey ? [false, false, true] : [true, true, false];
    const unit = metres[place.unit];
    const at = place.point.at.map((value, i) =>
      moves[i] && by[i] !== 0 ? roundFor(value + by[i] / unit, 1e-3 / unit) : value,
    );
    this.dragged = { point: place.point, at };
    this.view.showPoints();
    const operations = setPoint(place.point, { at });
    void this.view.session.preview(operations, null, begin);
  }

  #end(event, isOff = false) {
    if (this.dragged === null) return;
    event.stopImmediatePropagation();
    this.dragged = null;
    const { session } = this.view;
    if (isOff) void session.cancelPreview();
    else void session.finishPreview(`Move ${nameOf(this.place.point).toLowerCase()}`);
    this.view.showPoints();
  }
}

const coordinates = ["X", "Y", "Z"];

// The numbers of one of them.
export function PointFields({ session }) {
  const points = session.points.value;
  if (points.length === 0) return null;
  const index = Math.min(session.point.value, points.length - 1);
  const point = points[index];
  const names = points.map(nameOf);
  const set = (change, label) => session.edit(setPoint(point, change), `Set ${label}`);
  return html`<div class="fields points">
    <${Choice} label="Point" value=${names[index]} names=${names}
      onChoose=${(name) => (session.point.value = names.indexOf(name))} />
    ${
      point.t === undefined
        ? null
        : html`<${Field} label="Time" unit="s" value=${point.t} onSet=${(t) => set({ t }, "the time of a subject")} />`
    }
    ${point.at.map((value, i) => {
      const at = (typed) => point.at.map((_, k) => (k === i ? typed : undefined));
      return html`<${Field} key=${i} label=${coordinates[i]} unit=${point.unit} value=${value}
        onSet=${(typed) => set({ at: at(typed) }, `${coordinates[i]} of ${names[index].toLowerCase()}`)} />`;
    })}
  </div>`;
}
