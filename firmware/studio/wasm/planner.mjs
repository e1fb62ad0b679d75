// firmware/studio/wasm/planner.mjs - slew's own loader and planner, for a page,
// a Worker or node.  docs/STUDIO.md, "the planner in the browser", is its
// reference.

const encoder = new TextEncoder();
const decoder = new TextDecoder();

const KEY = 24;
const POSE = 16;
const COLUMN = 8;
const SUBJECT = 3;
const VIOLATION = 8;

// Of an address it is compiled while it comes in.
async function instanceOf(source, imports) {
  if (typeof source !== "string" && !(source instanceof URL))
    return (await WebAssembly.instantiate(source, imports)).instance;
  const answer = await fetch(source);
  if (!answer.ok) throw new Error(`${source}: ${answer.status}`);
  return (await WebAssembly.instantiateStreaming(answer, imports)).instance;
}

// What the C library would ask a system for; nothing of slew does.
const system = new Proxy({}, { get: () => () => 52 });

// Whether an offset of UTF-8 is one of UTF-16, for all offsets at once: those
// asked for, ascending.
function unitsOf(text, offsets) {
  const units = [];
  let bytes = 0;
  let at = 0;
  for (const offset of offsets) {
    while (bytes < offset && at < text.length) {
      const code = text.codePointAt(at);
      bytes += code < 0x80 ? 1 : code < 0x800 ? 2 : code < 0x10000 ? 3 : 4;
      at += code < 0x10000 ? 1 : 2;
    }
    units.push(at);
  }
  return units;
}

class Plan {
  #planner;
  #handle;
  #move;
  #report;

  constructor(planner, handle, move) {
    this.#planner = planner;
    this.#handle = handle;
    this.#move = move;
  }

  get handle() {
    if (this.#handle === 0) throw new Error("the plan was freed");
    return this.#handle;
  }

  get report() {
    if (this.#report === undefined) {
      const { wasm } = this.#planner;
      this.#report = JSON.parse(
        this.#planner.textAt(wasm.studio_plan_report(this.handle)),
      );
      for (const message of this.#report.messages) {
        const place = /^(.*?):(\d+):(\d+): /.exec(message.text);
        if (place === null) continue;
        message.file = place[1];
        message.line = Number(place[2]);
        message.column = Number(place[3]);
      }
    }
    return this.#report;
  }

  // The axis by index or name, as an index.
  axis(axis) {
    const { axes } = this.report;
    const index =
      typeof axis === "number" ? axis : axes.findIndex((a) => a.name === axis);
    if (axes[index] === undefined) throw new Error(`there is no axis ${axis}`);
    return index;
  }

  #numbers(count, Type, call) {
    const size = count * Type.BYTES_PER_ELEMENT;
    const at = this.#planner.alloc(size);
    const done = call(at);
    const numbers = done
      ? new Type(this.#planner.memory, at, count).slice()
      : null;
    this.#planner.wasm.release(at);
    return numbers;
  }

  keys(axis) {
    const index = this.axis(axis);
    return this.#numbers(KEY * this.report.axes[index].keys, Float64Array, (at) =>
      this.#planner.wasm.studio_plan_keys(this.handle, index, at),
    );
  }

  // `former`: { plan, samples } of the same view and of axes of the same names, of which
  // columns that did not change are taken over.
  samples(axis, from, to, columns, former = null) {
    const part = this.changedSamples(axis, from, to, columns, former?.plan ?? null);
    if (former === null || part === null) return part?.samples ?? null;
    const samples = former.samples.slice();
    samples.set(part.samples, COLUMN * part.first);
    return samples;
  }

  // Only the columns that are not as in a former plan (null: all), in one piece:
  // { first: of them, samples }.
  changedSamples(axis, from, to, columns, former) {
    const index = this.axis(axis);
    const [first, end] = former === null ? [0, columns] : this.#changed(former, index, from, to, columns);
    const samples = this.#numbers(COLUMN * (end - first), Float64Array, (at) =>
      this.#planner.wasm.studio_plan_samples(
        this.handle, index, from, to, columns, first, end - first, at,
      ),
    );
    return samples === null ? null : { first, samples };
  }

  // As samples, of the curve at an index of report.others.
  otherSamples(index, from, to, columns) {
    return this.#numbers(COLUMN * columns, Float64Array, (at) =>
      this.#planner.wasm.studio_plan_other_samples(this.handle, index, from, to, columns, at),
    );
  }

  // The columns that are not as in the other plan, with one beside them for what is
  // rounded: [first, end].
  #changed(other, index, from, to, columns) {
    const span = this.#numbers(2, Float64Array, (at) =>
      this.#planner.wasm.studio_plan_changed(this.handle, other.handle, index, at),
    );
    if (span === null) return [0, columns];
    const column = (t) => ((t - from) * columns) / (to - from);
    const inside = (value) => Math.min(Math.max(value, 0), columns);
    const first = inside(Math.floor(column(span[0])) - 1);
    return [first, Math.max(first, inside(Math.ceil(column(span[1])) + 1))];
  }

  violations() {
    return this.#numbers(VIOLATION * this.report.violations, Float64Array, (at) => {
      this.#planner.wasm.studio_plan_violations(this.handle, at);
      return true;
    });
  }

  at(axis, t) {
    const index = this.axis(axis);
    return this.#numbers(4, Float64Array, (at) =>
      this.#planner.wasm.studio_plan_at(this.handle, index, t, at),
    );
  }

  rows(axis, first, count, rate) {
    const index = this.axis(axis);
    return this.#numbers(4 * count, BigInt64Array, (at) =>
      this.#planner.wasm.studio_plan_rows(
        this.handle, index, first, count, rate, at,
      ),
    );
  }

  poses(from, to, count) {
    return this.#numbers(POSE * count, Float64Array, (at) =>
      this.#planner.wasm.studio_plan_poses(this.handle, from, to, count, at),
    );
  }

  // As the service goes there, from where each axis stands: { seconds: of each axis,
  // poses: null without kinematics }; null where that cannot be planned.
  approach(from, t, count) {
    const { axes } = this.report;
    const at = this.#planner.bytesIn(new Uint8Array(Float64Array.from(from).buffer));
    const numbers = this.#numbers(axes.length + POSE * count, Float64Array, (out) =>
      this.#planner.wasm.studio_plan_approach(this.handle, at, t, count, out),
    );
    this.#planner.wasm.release(at);
    if (numbers === null) return null;
    const poses = numbers.slice(axes.length);
    return {
      seconds: numbers.slice(0, axes.length),
      poses: Number.isNaN(poses[0]) ? null : poses,
    };
  }

  // The rig at a time, in lines of points: [{ isRail, points: [x, y, z, ...] }].
  body(t) {
    const most = 512;
    let count = 0;
    const numbers = this.#numbers(SUBJECT * most, Float64Array, (at) => {
      count = this.#planner.wasm.studio_plan_body(this.handle, t, most, at);
      return true;
    });
    const lines = [];
    for (let at = 0; at < SUBJECT * count; at += SUBJECT)
      if (Number.isNaN(numbers[at])) lines.push({ isRail: numbers[at + 1] === 0, points: [] });
      else lines.at(-1).points.push(...numbers.subarray(at, at + SUBJECT));
    return lines;
  }

  subject(from, to, count) {
    return this.#numbers(SUBJECT * count, Float64Array, (at) =>
      this.#planner.wasm.studio_plan_subject(this.handle, from, to, count, at),
    );
  }

  // Offsets of the answer are bytes of the file; a page counts as JavaScript.
  #answer(text) {
    const answer = JSON.parse(text);
    if (!answer.ok) return answer;
    const ends = answer.edits.flatMap((edit) => [edit.from, edit.to]);
    const units = unitsOf(this.#move, ends);
    answer.edits.forEach((edit, i) => {
      edit.from = units[2 * i];
      edit.to = units[2 * i + 1];
    });
    return answer;
  }

  edit(operations) {
    const planner = this.#planner;
    return planner.withTexts([JSON.stringify(operations)], (list) =>
      this.#answer(planner.textAt(planner.wasm.studio_plan_edit(this.handle, list))),
    );
  }

  fit(method, tolerance = "") {
    const planner = this.#planner;
    return planner.withTexts([method, tolerance], (name, within) =>
      this.#answer(
        planner.textAt(planner.wasm.studio_plan_fit(this.handle, name, within)),
      ),
    );
  }

  free() {
    if (this.#handle !== 0) this.#planner.wasm.studio_plan_delete(this.#handle);
    this.#handle = 0;
  }
}

export class Planner {
  static KEY = KEY;
  static POSE = POSE;
  static COLUMN = COLUMN;
  static VIOLATION = VIOLATION;
  static VIOLATIONS = [];
  static CURVES = [];
  static HANDLES = ["free", "aligned", "vector", "auto", "auto-clamped"];
  static INTERPOLATIONS = [
    "constant", "linear", "bezier", "sine", "quad", "cubic", "quart", "quint",
    "expo", "circ", "back", "bounce", "elastic",
  ];
  static EASINGS = ["auto", "in", "out", "in-out"];

  #store;
  #texts = new Map();

  // From an address, or from the bytes of the module.
  static async load(source = "/planner.wasm") {
    const { exports } = await instanceOf(source, { wasi_snapshot_preview1: system });
    return new Planner(exports);
  }

  constructor(exports) {
    this.wasm = exports;
    this.wasm._initialize?.();
    this.#store = this.wasm.store_new();
    if (Planner.CURVES.length > 0) return;
    for (let i = 0, at; (at = this.wasm.curve_name(i)) !== 0; i++)
      Planner.CURVES.push(this.textAt(at));
    this.#readViolations();
  }

  // { kind, order, what } of each kind of them.
  #readViolations() {
    const out = this.alloc(12);
    for (let i = 0; this.wasm.violation_kind(i, out, out + 8); i++) {
      const [kind, what, order] = new Uint32Array(this.memory, out, 3);
      Planner.VIOLATIONS.push({ kind: this.textAt(kind), order, what: this.textAt(what) });
    }
    this.wasm.release(out);
  }

  // It grows, and a view of it does not.
  get memory() {
    return this.wasm.memory.buffer;
  }

  alloc(size) {
    return this.wasm.alloc(size);
  }

  textAt(at) {
    const bytes = new Uint8Array(this.memory);
    return decoder.decode(bytes.subarray(at, bytes.indexOf(0, at)));
  }

  // The bytes, with a 0 after them; to be released.
  bytesIn(bytes) {
    const at = this.alloc(bytes.length + 1);
    new Uint8Array(this.memory, at, bytes.length).set(bytes);
    return at;
  }

  withTexts(texts, call) {
    const at = texts.map((text) => this.bytesIn(encoder.encode(text)));
    try {
      return call(...at);
    } finally {
      at.forEach((block) => this.wasm.release(block));
    }
  }

  put(name, text) {
    const bytes = typeof text === "string" ? encoder.encode(text) : text;
    this.withTexts([name], (at) => {
      const data = bytes === null ? 0 : this.bytesIn(bytes);
      const err = this.wasm.store_put(this.#store, at, data, bytes?.length ?? 0);
      if (data !== 0) this.wasm.release(data);
      if (err < 0) throw new Error(`${name}: the name is too long`);
    });
    if (bytes === null) this.#texts.delete(name);
    else this.#texts.set(name, typeof text === "string" ? text : decoder.decode(bytes));
  }

  plan(rig, move, former = null) {
    const handle = this.withTexts([rig, move], (rigAt, moveAt) =>
      this.wasm.studio_plan_new(this.#store, rigAt, moveAt, former?.handle ?? 0),
    );
    return new Plan(this, handle, this.#texts.get(move) ?? "");
  }

  static apply(text, edits) {
    let out = "";
    let at = 0;
    for (const edit of edits) {
      out += text.slice(at, edit.from) + edit.insert;
      at = edit.to;
    }
    return out + text.slice(at);
  }
}
