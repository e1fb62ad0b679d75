// The planner, off the page's thread: planning never holds up a pointer.
//
// `base` is the plan of the document; a drag plans what its operations make of the
// base, from the plan of the step before, so that only spans that changed are
// planned.
import { Planner } from "/planner.mjs";
import { applyEdits } from "../model/history.js";

const rigName = () => names.rig;
const moveName = () => names.move;
// Fetched at once, while the page still asks which rig it is.
const loading = Planner.load("/planner.wasm");
loading.catch(() => {}); // said by whoever waits for it
let planner = null;
let names = { rig: "rig.yaml", move: "move.yaml" };
let base = null;
let baseText = "";
let latest = null; // of a drag; base while there is none
let toWarm = 0; // rounds that are left of warming up

function words() {
  return {
    size: Planner.KEY,
    violation: Planner.VIOLATION,
    violations: Planner.VIOLATIONS,
    curves: Planner.CURVES,
    handles: Planner.HANDLES,
    interpolations: Planner.INTERPOLATIONS,
    easings: Planner.EASINGS,
  };
}

// Files that the rig or the move names are fetched once, and planned with.
async function planWith(former) {
  for (let round = 0; round < 8; round++) {
    const plan = planner.plan(rigName(), moveName(), former);
    const missing = plan.report.missing ?? [];
    if (missing.length === 0) return plan;
    let brought = 0;
    for (const name of missing) brought += (await bring(name)) ? 1 : 0;
    if (brought === 0) return plan;
    plan.free();
  }
  return planner.plan(rigName(), moveName(), former);
}

const brought = new Set();
async function bring(name) {
  if (brought.has(name)) return false;
  brought.add(name);
  const answer = await fetch(`/api/file?name=${encodeURIComponent(name)}`);
  if (!answer.ok) return false;
  planner.put(name, new Uint8Array(await answer.arrayBuffer()));
  return true;
}

// Keys that are as they were sent last are not sent again while one drags.
const sent = new Map(); // hashes by the names of axes

function keysOf(plan, axis, index, isDrag) {
  if (!axis.keys) return null;
  const isSame = isDrag && sent.get(axis.name) === axis.hash;
  sent.set(axis.name, axis.hash);
  return isSame ? "same" : plan.keys(index);
}

// `former`: a plan of the same axes, which need not be what was shown last.
function pictureOf(plan, view, former) {
  const { report } = plan;
  if (report.status !== "ok") return { report, keys: [], samples: [] };
  return {
    report,
    serial: ++serial,
    view,
    keys: report.axes.map((axis, index) => keysOf(plan, axis, index, former !== null)),
    violations: plan.violations(),
    samples: report.axes.map((axis, index) => shownOf(plan, view, index, former)),
    otherSamples: otherOf(plan, view),
  };
}

// What of an axis was sent last: of the next step of a drag only the columns that change
// are sampled and sent.  The page can tell by the serial whether it has what was sent
// before.
const shown = new Map(); // by name: { plan, view }
let serial = 0;

function shownOf(plan, view, index, former) {
  const { name } = plan.report.axes[index];
  const last = shown.get(name);
  const isSame =
    former !== null &&
    last?.plan === former &&
    ["from", "to", "columns"].every((each) => last.view[each] === view[each]);
  shown.set(name, { plan, view });
  return plan.changedSamples(index, view.from, view.to, view.columns, isSame ? former : null);
}

function otherOf(plan, view) {
  return view.other < 0 ? null : plan.otherSamples(view.other, view.from, view.to, view.columns);
}

function samplesOf(plan, view, axes) {
  return axes.map((axis) => plan.samples(axis, view.from, view.to, view.columns));
}

function release(plan) {
  if (plan !== null && plan !== base) plan.free();
}

// The first plans of a module are slow, before the browser has compiled for speed
// what runs often: so it runs while nobody waits, and not in somebody's hand.
const warmRounds = 24;
const warmRestMs = 20;

async function warmOnce() {
  const { report } = base;
  const axis = report.status === "ok" ? report.axes.findIndex((each) => each.keys > 2) : -1;
  if (axis < 0) return false;
  const key = report.axes[axis].keys >> 1;
  const p = base.keys(axis)[key * Planner.KEY + 1] + 1e-3 * toWarm;
  const { name } = report.axes[axis];
  const picture = await previewOf([{ op: "key", axis: name, key, p }], warmView);
  return picture.error === undefined;
}

const warmView = { from: 0, to: 10, columns: 200, other: -1 };

function warmLater() {
  setTimeout(() => {
    if (toWarm === 0) return;
    turn = turn.then(async () => {
      if (toWarm === 0 || base === null) return;
      toWarm = (await warmOnce()) ? toWarm - 1 : 0;
      forgetDrag();
      warmLater();
    });
  }, warmRestMs);
}

// What operations on the document would make of it; and what was sent of such.
async function previewOf(operations, view) {
  const edited = base.edit(operations);
  if (!edited.ok) return { error: edited.error };
  planner.put(moveName(), applyEdits(baseText, edited.edits));
  const former = latest ?? base;
  const plan = await planWith(former);
  planner.put(moveName(), baseText);
  const picture = pictureOf(plan, view, former);
  if (plan.report.status === "ok") {
    release(latest);
    latest = plan;
  } else plan.free();
  return { edits: edited.edits, ...picture };
}

function forgetDrag() {
  release(latest);
  latest = null;
  sent.clear();
  shown.clear();
}

function brokenOf(plan, axis) {
  const violations = plan.violations();
  let count = 0;
  for (let at = 0; at < violations.length; at += Planner.VIOLATION)
    if (violations[at] === axis) count++;
  return count;
}

const handlers = {
  async load({ rig, move }) {
    planner ??= await loading;
    names = { rig: rig.name, move: move.name };
    planner.put(rig.name, rig.text);
    return { words: words() };
  },

  // The document is this now.
  async plan({ rig, move, view }) {
    if (rig !== undefined) planner.put(rigName(), rig);
    planner.put(moveName(), move);
    const former = base;
    const plan = await planWith(former?.report.status === "ok" ? former : undefined);
    release(latest);
    latest = null;
    base = plan;
    baseText = move;
    if (former === null) {
      toWarm = warmRounds;
      warmLater();
    }
    former?.free();
    return pictureOf(plan, view, null);
  },

  async preview({ operations, view }) {
    toWarm = 0;
    const begin = performance.now();
    const picture = await previewOf(operations, view);
    return { ...picture, ms: performance.now() - begin };
  },

  async samples({ view }) {
    const plan = latest ?? base;
    if (plan?.report.status !== "ok") return { samples: [] };
    return {
      samples: samplesOf(
        plan,
        view,
        plan.report.axes.map((_, index) => index),
      ),
      otherSamples: otherOf(plan, view),
    };
  },

  async edit({ operations }) {
    return base.edit(operations);
  },

  async fit({ method, tolerance }) {
    return base.fit(method, tolerance);
  },

  // One axis as another curve would have it.
  async compare({ axis, curve, view }) {
    const edited = base.edit([{ op: "curve", axis, curve }]);
    if (!edited.ok) return { error: edited.error };
    planner.put(moveName(), applyEdits(baseText, edited.edits));
    const plan = await planWith(base);
    planner.put(moveName(), baseText);
    const { report } = plan;
    const index = report.status === "ok" ? report.axes.findIndex((each) => each.name === axis) : -1;
    const samples = index < 0 ? null : samplesOf(plan, view, [index])[0];
    const error = index < 0 ? (report.messages[0]?.text ?? "it cannot be planned") : null;
    const broken = index < 0 ? 0 : brokenOf(plan, index);
    plan.free();
    return { samples, error, broken };
  },

  // Of what is dragged, while something is.
  async poses({ from, to, count }) {
    const plan = latest ?? base;
    if (plan?.report.status !== "ok") return { poses: null, subject: null };
    return {
      poses: plan.poses(from, to, count),
      subject: plan.subject(from, to, count),
      size: Planner.POSE,
    };
  },

  async approach({ from, t, count }) {
    const approach = base?.report.status === "ok" ? base.approach(from, t, count) : null;
    return { ...approach, size: Planner.POSE };
  },

  async body({ t }) {
    return { lines: base?.report.status === "ok" ? base.body(t) : [] };
  },

  async at({ t }) {
    if (base?.report.status !== "ok") return { values: [] };
    return { values: base.report.axes.map((_, axis) => [...base.at(axis, t)]) };
  },
};

// They are given away, not copied.
function buffersOf({ samples, keys, poses, violations, otherSamples }) {
  return [...(samples ?? []), ...(keys ?? []), poses, violations, otherSamples]
    .map((each) => each?.samples ?? each)
    .filter((each) => each instanceof Float64Array)
    .map((each) => each.buffer);
}

// One after the other: a plan that waits for a file must not meet another text.
let turn = Promise.resolve();
self.onmessage = ({ data: { id, kind, ...members } }) => {
  turn = turn.then(async () => {
    let answer;
    try {
      answer = await handlers[kind](members);
    } catch (error) {
      answer = { failed: String(error?.message ?? error) };
    }
    self.postMessage({ id, ...answer }, buffersOf(answer));
  });
};
