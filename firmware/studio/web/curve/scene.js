// What the canvas shows, put together from the session.
import { isSelected } from "../model/keys.js";
import { commonRange, layOut, viewOf } from "./layout.js";
import { handleTargets, keyTargets, sheetTargets } from "./targets.js";

const nothing = {
  name: "",
  unit: "",
  limits: [
    [0, 1],
    [0, 0],
    [0, 0],
    [0, 0],
  ],
  keys: [],
  samples: null,
};

export function markersOf(report) {
  return (report?.events ?? []).map((event) => event.time_s).filter((t) => t !== undefined);
}

function brokenKeysOf(session) {
  const broken = new Set();
  for (const violation of session.violations.value) {
    const axis = session.axes.value[violation.axis];
    if (axis !== undefined && violation.key !== undefined)
      broken.add(`${axis.name} ${violation.key}`);
  }
  return broken;
}

// Reads every signal that the scene is made of, so that an effect runs again when
// one of them has changed, and puts nothing together.
export function followScene(session, live) {
  const parts = [
    "hidden",
    "axes",
    "active",
    "activeAxis",
    "view",
    "isNormalised",
    "range",
    "sampled",
    "compared",
  ];
  const more = [
    "inFrames",
    "fps",
    "picked",
    "selection",
    "violations",
    "others",
    "report",
    "playhead",
    "dragged",
  ];
  for (const name of [...parts, ...more]) void session[name].value;
  void live?.machineAt.value;
}

export function sceneOf(session, size, colours, live) {
  const hidden = session.hidden.value;
  const others = session.others.value;
  const seen = session.axes.value.filter((axis) => !hidden.has(axis.name));
  const axes = [...seen, ...others.filter((each) => each.name === session.active.value)];
  const active = axes.find((axis) => axis.name === session.activeAxis.value?.name) ?? null;
  const span = session.view.value;
  const rows = [...seen, ...others];
  const layout = layOut(size.width, size.height, rows);
  const common = session.isNormalised.value ? null : commonRange(seen);
  const range = session.range.value;
  const viewFor = (order, axis) =>
    viewOf(layout.panes[order], order, axis, span, range, axis.isOther ? null : common);
  const positions = (axis) => viewFor(0, axis);
  const colourOf = (name) =>
    colours.axes[session.axes.value.find((axis) => axis.name === name)?.colour] ?? colours.quiet;
  return {
    layout,
    axes,
    rows,
    active,
    nothing,
    span,
    colours,
    colourOf,
    viewFor,
    sampled: session.sampled.value,
    compared: session.compared.value,
    fps: session.inFrames.value ? session.fps.value : null,
    keys: keyTargets(axes, positions, session.dragged.value?.moved),
    handles: handleTargets(
      axes,
      session.picked.value.filter((each) => !hidden.has(each.axis)),
      positions,
    ),
    sheetKeys: sheetTargets(rows, layout.rows, span, session.dragged.value?.moved),
    isPicked: (axis, key) => isSelected(session.selection.value, axis, key),
    brokenKeys: brokenKeysOf(session),
    markers: markersOf(session.report.value),
    playhead: session.playhead.value,
    machineAt: live?.machineAt.value ?? null,
    drag: session.dragged.value,
  };
}
