// What the page is about: the rig, the move's text, its plan, what is selected.
// Everything that is drawn is a signal here; everything that changes the text goes
// through `edit`, `change` or a preview that is finished.
import { batch, computed, signal } from "../vendor/ui.js";
import { History } from "./history.js";
import {
  emptySelection,
  readKeys,
  readOther,
  readViolations,
  selectTimes,
  selectedKeys,
} from "./keys.js";
import { roundFor } from "./number.js";

export const columns = 800; // of samples across the view
const mostCosts = 1000;
const frameMs = 16;

const none = [];

const settingsKey = "slew.studio";

function settings() {
  try {
    return JSON.parse(localStorage.getItem(settingsKey)) ?? {};
  } catch {
    return {};
  }
}

export function remember(changes) {
  try {
    localStorage.setItem(settingsKey, JSON.stringify({ ...settings(), ...changes }));
  } catch {
    // A page without storage forgets, and works.
  }
}

export class Session {
  #planner;
  #history = new History("");
  #words = null;
  #colours = new Map();
  #preview = null; // of the drag that is under way: { operations, drag }
  #late = null; // timer of what is shown without its plan
  #serial = 0; // of the picture that is shown

  constructor(planner) {
    const kept = settings();
    this.#planner = planner;
    this.studio = signal(null);
    this.rigText = signal("");
    this.text = signal("");
    this.saved = signal("");
    this.etag = null;
    this.report = signal(null);
    this.axes = signal([]); // with keys and samples; those of the last good plan
    this.isBroken = signal(false); // the text cannot be planned
    this.isPlanning = signal(false);
    this.selection = signal(emptySelection());
    this.active = signal(null); // name of the axis that is edited
    this.hidden = signal(new Set());
    this.playhead = signal(0);
    this.view = signal({ from: 0, to: 10 });
    this.sampled = signal({ from: 0, to: 10 }); // what the samples cover
    this.range = signal({ low: -0.08, high: 1.08 }); // of positions, in shares
    this.isNormalised = signal(kept.isNormalised ?? true);
    this.snapping = signal(
      kept.snapping ?? { frame: true, second: false, marker: true, playhead: true, key: true },
    );
    this.isRippling = signal(false);
    this.inFrames = signal(kept.inFrames ?? false);
    this.compared = signal(null); // { axis, curve, samples, error }
    this.approach = signal(null); // that the machine is about to go: { poses, size, ... }
    this.tab = signal("Keys"); // that is shown
    this.notice = signal(null); // { text, isError }
    this.place = signal(null); // { line, column } that the text goes to
    this.dragged = signal(null); // what the drag under way says of itself
    this.clipboard = null;
    this.scene = null; // of the curve editor
    this.space = null; // the space view, once it was shown
    // ms, of the last steps of drags and drawings.  step: from the pointer's event to the
    // end of the drawing and of the panels that show its plan; plan: until the plan is
    // here, own: of this the planner alone
    this.costs = { step: [], plan: [], own: [], draw: [] };
    this.paint = () => {}; // draws at once what an editor shows
    this.undoLabel = signal("");
    this.redoLabel = signal("");
    this.isDirty = computed(() => this.text.value !== this.saved.value);
    this.title = computed(() => this.report.value?.title ?? "");
    this.fps = computed(() => this.report.value?.fps ?? null);
    this.violations = signal([]);
    this.otherSamples = signal(null); // { name, samples } of the one that is edited
    // Curves that are no axis's.
    this.others = computed(() => {
      const shown = this.otherSamples.value;
      return (this.report.value?.others ?? [])
        .map(readOther)
        .map((other) =>
          other.name === shown?.name ? { ...other, samples: shown.samples } : other,
        );
    });
    this.tracks = computed(() => [...this.axes.value, ...this.others.value]);
    this.points = computed(() => this.report.value?.points ?? []); // in space
    this.point = signal(0); // the index of the one that is edited
    this.duration = computed(() => this.report.value?.end_s ?? 0);
    this.picked = computed(() => selectedKeys(this.tracks.value, this.selection.value));
    this.activeAxis = computed(
      () =>
        this.tracks.value.find((axis) => axis.name === this.active.value) ??
        this.axes.value[0] ??
        null,
    );
  }

  say(text, isError = false) {
    this.notice.value = { text, isError };
  }

  // A drawing is done: what was drawn, and the ms it took.
  drawn(scene, ms) {
    if (this.scene?.axes.length === 0 && scene.axes.length > 0) performance.mark("curves");
    this.scene = scene;
    this.#keepCost("draw", ms);
  }

  #keepCost(kind, ms) {
    this.costs[kind].push(ms);
    if (this.costs[kind].length > mostCosts) this.costs[kind].shift();
  }

  // --- opening and saving

  async open() {
    const [studio, rig, [move, etag]] = await Promise.all([
      fetch("/api/studio").then((answer) => answer.json()),
      fetch("/api/rig").then((answer) => answer.text()),
      // Not found where there is no move yet.
      fetch("/api/move").then(async (answer) =>
        answer.ok ? [await answer.text(), answer.headers.get("ETag")] : ["", null],
      ),
    ]);
    this.etag = etag;
    this.studio.value = studio;
    const { words } = await this.#planner.ask("load", {
      rig: { name: studio.rig, text: rig },
      move: { name: studio.move ?? "move.yaml", text: move },
    });
    this.#words = words;
    this.rigText.value = rig;
    this.#history = new History(move);
    this.saved.value = move;
    this.text.value = move;
    await this.#plan();
    this.showAll();
  }

  // false where the file on disk has changed since; then nothing was written.
  async save(overwrite = false) {
    const text = this.text.value;
    const etag = overwrite ? await this.#etagOnDisk() : this.etag;
    const answer = await fetch("/api/move", {
      method: "PUT",
      headers: { "If-Match": etag ?? "*" },
      body: text,
    });
    if (answer.status === 204) {
      this.etag = answer.headers.get("ETag");
      this.saved.value = text;
      this.say("Saved.");
      return true;
    }
    if (answer.status === 412) {
      this.say("Not saved: the file has changed on disk since it was opened.", true);
      return false;
    }
    this.say(
      `Not saved: ${(await answer.json().catch(() => null))?.error ?? answer.statusText}`,
      true,
    );
    return false;
  }

  async #etagOnDisk() {
    return (await fetch("/api/move")).headers.get("ETag");
  }

  // What is on disk takes the place of the text; the history keeps what was.
  async reload() {
    const answer = await fetch("/api/move");
    const text = await answer.text();
    this.etag = answer.headers.get("ETag");
    this.saved.value = text;
    await this.replace(text, "Read again from disk");
  }

  // --- changes of the text

  async change(edits, label, group = null) {
    if (edits.length === 0) return;
    this.#history.apply(edits, label, group);
    await this.#changed();
  }

  replace(text, label) {
    return this.change([{ from: 0, to: this.text.value.length, insert: text }], label);
  }

  // Operations on the document; those keys are selected afterwards.
  async edit(operations, label, group = null) {
    if (operations.length === 0) return false;
    const answer = await this.#planner.ask("edit", { operations });
    if (!answer.ok) {
      this.say(answer.error ?? answer.failed, true);
      return false;
    }
    const times = this.#timesAfter(operations);
    await this.change(answer.edits, label, group);
    if (times.length > 0) this.selection.value = selectTimes(this.tracks.value, times);
    return true;
  }

  // `drag`: what it says of itself, shown with its plan, so that a step is drawn once; no
  // longer than a frame is waited for that.  `begin`: when the event came that asks for it.
  async preview(operations, drag, begin = performance.now()) {
    this.#preview = { operations, drag };
    this.#late ??= setTimeout(() => this.#showDrag(), frameMs);
    const picture = await this.#planner.askLatest("preview", {
      operations,
      view: this.#samplesView(),
    });
    if (picture === null || this.#preview === null) return;
    if (picture.error !== undefined) {
      this.#showDrag({ error: picture.error });
      return;
    }
    this.#keepCost("plan", performance.now() - begin);
    this.#keepCost("own", picture.ms);
    batch(() => {
      this.#showDrag();
      this.#show(picture);
    });
    this.paint();
    // After the panels, which are rendered in a task that waits already.
    queueMicrotask(() => this.#keepCost("step", performance.now() - begin));
  }

  #showDrag(more) {
    clearTimeout(this.#late);
    this.#late = null;
    const { drag } = this.#preview;
    this.dragged.value = more === undefined ? drag : { ...drag, ...more };
  }

  // What was asked for last; null: nothing was.
  #endPreview() {
    const preview = this.#preview;
    clearTimeout(this.#late);
    this.#late = null;
    this.#preview = null;
    this.#planner.drop("preview");
    this.dragged.value = null;
    return preview;
  }

  async finishPreview(label) {
    const preview = this.#endPreview();
    if (preview !== null) await this.edit(preview.operations, label);
  }

  async cancelPreview() {
    this.#endPreview();
    await this.#plan();
  }

  async undo() {
    if (!this.#history.canUndo) return;
    this.#history.undo();
    await this.#changed();
  }

  async redo() {
    if (!this.#history.canRedo) return;
    this.#history.redo();
    await this.#changed();
  }

  async fit(method, tolerance) {
    this.isPlanning.value = true;
    const answer = await this.#planner.ask("fit", { method, tolerance });
    this.isPlanning.value = false;
    if (!answer.ok) {
      this.say(answer.error ?? answer.failed, true);
      return;
    }
    await this.change(answer.edits, `Fit (${method})`);
    this.say(
      this.violations.value.length === 0
        ? "Inside all limits now."
        : "Better, not yet inside all limits.",
    );
  }

  async compare(axis, curve) {
    if (curve === "") {
      this.compared.value = null;
      return;
    }
    const answer = await this.#planner.ask("compare", { axis, curve, view: this.#samplesView() });
    this.compared.value = { axis, curve, ...answer };
  }

  poses(from, to, count) {
    return this.#planner.askLatest("poses", { from, to, count });
  }

  // From where the axes of the move stand to where they are at a time.
  planApproach(from, t, count) {
    return this.#planner.ask("approach", { from, t, count });
  }

  body(t) {
    return this.#planner.askLatest("body", { t });
  }

  valuesAt(t) {
    return this.#planner.askLatest("at", { t });
  }

  #timesAfter(operations) {
    const times = [];
    for (const operation of operations) {
      const axis = this.tracks.value.find((each) => each.name === operation.axis);
      if (operation.op === "add") times.push({ axis: operation.axis, t: operation.t });
      if (operation.op === "key" && typeof (operation.t ?? 0) === "number")
        times.push({ axis: operation.axis, t: operation.t ?? axis.keys[operation.key].t });
    }
    return times;
  }

  async #changed() {
    this.text.value = this.#history.text;
    this.undoLabel.value = this.#history.undoLabel;
    this.redoLabel.value = this.#history.redoLabel;
    await this.#plan();
  }

  // --- the plan

  #samplesView() {
    const { from, to } = this.view.value;
    const other = this.others.value.findIndex((each) => each.name === this.active.value);
    return { from, to, columns, other };
  }

  async #plan() {
    this.isPlanning.value = true;
    const picture = await this.#planner.askLatest("plan", {
      move: this.text.value,
      view: this.#samplesView(),
    });
    if (picture === null) return;
    this.isPlanning.value = false;
    if (picture.failed !== undefined) this.say(picture.failed, true);
    else this.#show(picture);
    const { compared } = this;
    if (compared.value) await this.compare(compared.value.axis, compared.value.curve);
  }

  #keepOther(samples) {
    this.otherSamples.value = samples ? { name: this.active.value, samples } : null;
  }

  #show({ report, serial, view, keys, samples, violations, otherSamples }) {
    batch(() => {
      this.report.value = report;
      this.isBroken.value = report.status !== "ok";
      if (this.isBroken.value) return;
      const { from, to } = this.sampled.value;
      const follows = serial === this.#serial + 1 && view.from === from && view.to === to;
      const isWhole = samples.every((each) => each.samples.length === 8 * view.columns);
      this.#serial = serial;
      this.violations.value = readViolations(violations, this.#words);
      this.#keepOther(otherSamples);
      // What was sent before is not here: all of it again.
      if (!follows && !isWhole) void this.look(this.view.value);
      else this.sampled.value = { from: view.from, to: view.to };
      this.axes.value = report.axes.map((axis, index) => ({
        ...axis,
        index,
        colour: this.#colourOf(axis.name),
        limits: [
          [axis.low, axis.high],
          ...[axis.velocity, axis.acceleration, axis.jerk].map((most) => [-most, most]),
        ],
        keys: this.#keysOf(axis.name, keys[index]),
        isKeyed: keys[index] !== null,
        samples: this.#samplesOf(axis.name, samples[index], view, follows),
      }));
      if (!this.tracks.value.some((axis) => axis.name === this.active.value))
        this.active.value = this.axes.value[0]?.name ?? null;
    });
  }

  #axisNamed(name) {
    return this.axes.value.find((axis) => axis.name === name);
  }

  // "same": as they are here.
  #keysOf(name, keys) {
    if (keys === null) return [];
    const former = this.#axisNamed(name)?.keys ?? [];
    return keys === "same" ? former : readKeys(keys, this.#words, former);
  }

  // All columns, or those that changed, which are put among the others.
  #samplesOf(name, { first, samples }, { columns: count }, follows) {
    if (samples.length === 8 * count) return samples;
    const own = this.#axisNamed(name)?.samples ?? null;
    if (follows) own?.set(samples, 8 * first);
    return own;
  }

  #colourOf(name) {
    if (!this.#colours.has(name)) this.#colours.set(name, this.#colours.size % 8);
    return this.#colours.get(name);
  }

  // --- what is seen

  // An axis, or another curve, is the one that is edited.
  activate(name) {
    if (name === this.active.value) return;
    this.active.value = name;
    if (this.activeAxis.value?.isOther) void this.look(this.view.value);
  }

  async look(view) {
    this.view.value = { from: view.from, to: view.to };
    const asked = { ...this.view.value };
    const answer = await this.#planner.askLatest("samples", { view: this.#samplesView() });
    if (
      answer === null ||
      answer.samples === undefined ||
      answer.samples.length !== this.axes.value.length
    )
      return;
    batch(() => {
      this.sampled.value = asked;
      this.#keepOther(answer.otherSamples);
      this.axes.value = this.axes.value.map((axis, index) => ({
        ...axis,
        samples: answer.samples[index],
      }));
    });
    if (this.compared.value)
      await this.compare(this.compared.value.axis, this.compared.value.curve);
  }

  showAll() {
    const end = Math.max(this.duration.value, 0.1);
    this.range.value = { low: -0.08, high: 1.08 };
    return this.look({ from: -0.03 * end, to: 1.03 * end });
  }

  // Names of curves and of handles, as the planner spells them; the same lists always.
  get curves() {
    return this.#words?.curves ?? none;
  }

  get handles() {
    return this.#words?.handles ?? none;
  }

  // How a drag rounds what it writes: as fine as the screen shows.
  rounding(secondsPerPixel, valuePerPixelOf) {
    return {
      time: (t) => roundFor(t, secondsPerPixel),
      value: (p, axis) => roundFor(p, valuePerPixelOf(axis)),
    };
  }
}
