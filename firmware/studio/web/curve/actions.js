// What the keyboard and the buttons do to the keys.
import { emptySelection, select } from "../model/keys.js";
import { roundFor, withUnit } from "../model/number.js";
import {
  copyKeys,
  mirrorTime,
  mirrorValue,
  moveKeys,
  pasteKeys,
  removeKeys,
  rippleKeys,
  scaleKeys,
  setHandles,
  timeRange,
} from "../model/operations.js";
import { positionRange } from "./layout.js";

const finest = { time: (t) => roundFor(t, 1e-6), value: (p) => roundFor(p, 1e-6) };

export function frameOf(session) {
  return session.fps.value ? 1 / session.fps.value : 0.1;
}

function keyedAxes(session) {
  return session.axes.value.filter((axis) => axis.isKeyed && !session.hidden.value.has(axis.name));
}

// --- nudges: those that follow each other are undone as one

function nudgeTime(session, frames) {
  const picked = session.picked.value;
  const wanted = frames * frameOf(session);
  if (picked.length === 0) return;
  const from = Math.min(...picked.map((each) => each.at.t));
  const axes = session.tracks.value.filter((axis) =>
    picked.some((each) => each.axis === axis.name),
  );
  if (session.isRippling.value) {
    void session.edit(rippleKeys(axes, from, wanted, finest), "Ripple", "nudge-time");
    return;
  }
  const [low, high] = timeRange(axes, picked);
  const dt = Math.min(Math.max(wanted, low), high);
  if (dt !== 0) void session.edit(moveKeys(picked, dt, 0, finest), "Nudge", "nudge-time");
}

function nudgeValue(session, hundredths) {
  const operations = [];
  for (const axis of session.tracks.value) {
    const [low, high] = positionRange(axis);
    const step = 10 ** Math.floor(Math.log10((high - low) / 50));
    const picked = session.picked.value.filter((each) => each.axis === axis.name);
    operations.push(...moveKeys(picked, 0, hundredths * step, finest));
  }
  void session.edit(operations, "Nudge", "nudge-value");
}

// --- selecting

function selectStep(session, step) {
  const axis = session.activeAxis.value;
  if (!axis || axis.keys.length === 0) return;
  const now = session.selection.value.get(axis.name);
  const from = now
    ? step > 0
      ? Math.max(...now)
      : Math.min(...now)
    : step > 0
      ? -1
      : axis.keys.length;
  const key = Math.min(Math.max(from + step, 0), axis.keys.length - 1);
  session.selection.value = select(emptySelection(), [{ axis: axis.name, key }], "set");
  const { p, t } = axis.keys[key];
  session.say(
    `${axis.name}, key ${key + 1} of ${axis.keys.length}: ${t.toFixed(3)} s, ${withUnit(p, axis.unit)}`,
  );
  keepInView(session, t);
}

function keepInView(session, t) {
  const { from, to } = session.view.value;
  if (t >= from && t <= to) return;
  const half = (to - from) / 2;
  void session.look({ from: t - half, to: t + half });
}

function selectAxis(session, step) {
  const names = session.axes.value
    .filter((axis) => !session.hidden.value.has(axis.name))
    .map((axis) => axis.name);
  const at = names.indexOf(session.activeAxis.value?.name);
  if (names.length > 0) session.active.value = names[(at + step + names.length) % names.length];
}

function selectAll(session) {
  const all = keyedAxes(session).flatMap((axis) =>
    axis.keys.map((_, key) => ({ axis: axis.name, key })),
  );
  session.selection.value = select(emptySelection(), all, "set");
}

// --- keys

// Of what is sampled: null where the view does not reach.
function sampleAt(session, axis, t) {
  const { from, to } = session.sampled.value;
  const column = Math.floor((((t - from) / (to - from)) * (axis.samples?.length ?? 0)) / 8);
  return axis.samples?.[8 * column] ?? null;
}

async function addAtPlayhead(session) {
  const axis = session.activeAxis.value;
  if (!axis?.isKeyed) return;
  const t = session.playhead.value;
  const { values } = (await session.valuesAt(t)) ?? {};
  if (!values) return;
  const p = axis.isOther ? sampleAt(session, axis, t) : values[axis.index][0];
  if (p === null) return;
  await session.edit(
    [{ op: "add", axis: axis.name, t: finest.time(t), p: roundFor(p, 1e-4) }],
    "Add a key",
  );
}

function copy(session) {
  session.clipboard = copyKeys(session.picked.value) ?? session.clipboard;
  if (session.clipboard) session.say(`${session.clipboard.length} keys copied`);
}

function paste(session) {
  if (!session.clipboard) return;
  const onto = session.activeAxis.value?.isKeyed ? session.activeAxis.value.name : null;
  const operations = pasteKeys(session.clipboard, session.playhead.value, onto, finest);
  void session.edit(operations, `Paste ${operations.length} keys`);
}

function remove(session, label = "Remove keys") {
  const operations = removeKeys(session.picked.value);
  if (operations.length === 0) return;
  session.selection.value = emptySelection();
  void session.edit(operations, label);
}

// About the playhead, and each axis about its value there.
export async function scaleAboutPlayhead(session, timeFactor, valueFactor) {
  const about = session.playhead.value;
  const { values } = (await session.valuesAt(about)) ?? {};
  if (!values || !(timeFactor > 0) || !Number.isFinite(valueFactor)) return;
  const at = (name) =>
    values[session.axes.value.find((axis) => axis.name === name)?.index]?.[0] ?? 0;
  const operations = scaleKeys(
    session.picked.value,
    { about, timeFactor, aboutValue: at, valueFactor },
    finest,
  );
  await session.edit(operations, "Scale about the playhead");
}

export function chooseHandles(session, kind) {
  return session.edit(setHandles(session.picked.value, kind), `Handles: ${kind}`);
}

// --- looking

function showSelected(session) {
  const times = session.picked.value.map((each) => each.at.t);
  if (times.length === 0) return;
  const low = Math.min(...times);
  const high = Math.max(...times);
  const margin = Math.max((high - low) * 0.15, 0.25);
  void session.look({ from: low - margin, to: high + margin });
}

function zoom(session, factor) {
  const { from, to } = session.view.value;
  const playhead = session.playhead.value;
  const about = playhead >= from && playhead <= to ? playhead : (from + to) / 2;
  void session.look({ from: about + (from - about) * factor, to: about + (to - about) * factor });
}

function goTo(session, t) {
  session.playhead.value = Math.min(Math.max(t, 0), session.duration.value);
  keepInView(session, session.playhead.value);
}

// The playhead runs here by itself; no machine moves.
export function togglePreview(session) {
  if (session.running) {
    cancelAnimationFrame(session.running);
    session.running = null;
    return;
  }
  if (session.playhead.value >= session.duration.value) session.playhead.value = 0;
  let before = performance.now();
  const step = (now) => {
    const t = session.playhead.value + (now - before) / 1000;
    before = now;
    session.playhead.value = Math.min(t, session.duration.value);
    session.running = t < session.duration.value ? requestAnimationFrame(step) : null;
  };
  session.running = requestAnimationFrame(step);
}

const table = {
  earlier: (session) => nudgeTime(session, -1),
  later: (session) => nudgeTime(session, 1),
  "earlier-fine": (session) => nudgeTime(session, -0.1),
  "later-fine": (session) => nudgeTime(session, 0.1),
  up: (session) => nudgeValue(session, 1),
  down: (session) => nudgeValue(session, -1),
  "up-fine": (session) => nudgeValue(session, 0.1),
  "down-fine": (session) => nudgeValue(session, -0.1),
  next: (session) => selectStep(session, 1),
  previous: (session) => selectStep(session, -1),
  "next-axis": (session) => selectAxis(session, 1),
  "previous-axis": (session) => selectAxis(session, -1),
  all: selectAll,
  none: (session) => (session.selection.value = emptySelection()),
  add: addAtPlayhead,
  remove: (session) => remove(session),
  "mirror-time": (session) =>
    session.edit(mirrorTime(session.picked.value, finest), "Mirror in time"),
  "mirror-value": (session) =>
    session.edit(mirrorValue(session.picked.value, finest), "Mirror in value"),
  ripple: (session) => (session.isRippling.value = !session.isRippling.value),
  "show-all": (session) => session.showAll(),
  "show-selected": showSelected,
  "zoom-in": (session) => zoom(session, 0.8),
  "zoom-out": (session) => zoom(session, 1.25),
  preview: togglePreview,
  "to-start": (session) => goTo(session, 0),
  "to-end": (session) => goTo(session, session.duration.value),
  "step-on": (session) => goTo(session, session.playhead.value + frameOf(session)),
  "step-back": (session) => goTo(session, session.playhead.value - frameOf(session)),
  copy,
  cut(session) {
    copy(session);
    remove(session, "Cut keys");
  },
  paste,
  duplicate(session) {
    copy(session);
    paste(session);
  },
  undo: (session) => session.undo(),
  redo: (session) => session.redo(),
  save: (session) => session.save(),
};

export function act(session, action) {
  return table[action]?.(session);
}
