import assert from "node:assert/strict";
import { test } from "node:test";
import * as operations from "../../../../firmware/studio/web/model/operations.js";
import { select, selectTimes, selectedKeys } from "../../../../firmware/studio/web/model/keys.js";
import {
  clamp,
  decimalsFor,
  roundFor,
  shortNumber,
  withUnit,
} from "../../../../firmware/studio/web/model/number.js";
import { dragOf, toggleLock } from "../../../../firmware/studio/web/curve/drag.js";
import { actionFor } from "../../../../firmware/studio/web/curve/keyboard.js";

const none = { v: null, a: null, left: null, right: null, interpolation: null };
const axis = (name, ...points) => ({ name, keys: points.map(([t, p]) => ({ t, p, ...none })) });
const axes = [axis("pan", [0, 0], [1, 10], [3, 40], [6, 20]), axis("tilt", [0, 5], [2, 6])];
const plain = { time: (t) => t, value: (p) => p };
const pickedOf = (...keys) =>
  selectedKeys(
    axes,
    select(
      new Map(),
      keys.map(([name, key]) => ({ axis: name, key })),
      "set",
    ),
  );

test("selecting sets, adds and toggles", () => {
  let selection = select(new Map(), [{ axis: "pan", key: 1 }], "set");
  selection = select(selection, [{ axis: "tilt", key: 0 }], "add");
  assert.equal(selectedKeys(axes, selection).length, 2);
  selection = select(selection, [{ axis: "pan", key: 1 }], "toggle");
  assert.deepEqual([...selection.keys()], ["tilt"]);
});

test("a selection is found again by time when keys have changed places", () => {
  const after = [axis("pan", [0, 0], [1, 10], [2, 20], [3.5, 40])];
  assert.deepEqual([...selectTimes(after, [{ axis: "pan", t: 3.5 }]).get("pan")], [3]);
  assert.equal(selectTimes(after, [{ axis: "pan", t: 9 }]).size, 0);
});

test("keys that move together stop before one that stays, and at the start", () => {
  assert.deepEqual(
    operations.timeRange(axes, pickedOf(["pan", 1])).map((t) => Math.round(t * 1000)),
    [-999, 1999],
  );
  assert.deepEqual(operations.timeRange(axes, pickedOf(["pan", 2], ["pan", 3]))[1], Infinity);
  assert.equal(operations.timeRange(axes, pickedOf(["pan", 0]))[0], 0);
});

test("only what changes is said", () => {
  assert.deepEqual(operations.moveKeys(pickedOf(["pan", 1]), 0, 5, plain), [
    { op: "key", axis: "pan", key: 1, p: 15 },
  ]);
  assert.deepEqual(operations.moveKeys(pickedOf(["pan", 1]), 0.5, 0, plain), [
    { op: "key", axis: "pan", key: 1, t: 1.5 },
  ]);
});

test("a ripple takes along every key from there on, and no other", () => {
  const rippled = operations.rippleKeys(axes, 1, 2, plain);
  assert.deepEqual(
    rippled.map(({ axis: name, key, t }) => [name, key, t]),
    [
      ["pan", 1, 3],
      ["pan", 2, 5],
      ["pan", 3, 8],
      ["tilt", 1, 4],
    ],
  );
});

test("scaling in time divides velocities, in value multiplies them, and takes handles along", () => {
  const keys = [{ ...none, t: 2, p: 10, v: 6, a: 8, left: { kind: "free", dt: -0.5, dp: -1 } }];
  const [scaled] = operations.scaleKeys(
    selectedKeys([{ name: "pan", keys }], new Map([["pan", new Set([0])]])),
    { about: 1, timeFactor: 2, aboutValue: () => 4, valueFactor: 3 },
    plain,
  );
  assert.deepEqual(scaled, {
    op: "key",
    axis: "pan",
    key: 0,
    t: 3,
    p: 22,
    v: 9,
    a: 6,
    left: { kind: "free", dt: -1, dp: -3 },
  });
});

test("mirrored in time, times are reversed about the middle, velocities turn, handles change sides", () => {
  const keys = [
    { ...none, t: 1, p: 0, v: 5, right: { kind: "free", dt: 0.25, dp: 2 } },
    { ...none, t: 3, p: 9 },
  ];
  const picked = selectedKeys([{ name: "pan", keys }], new Map([["pan", new Set([0, 1])]]));
  const [first, second] = operations.mirrorTime(picked, plain);
  assert.equal(first.t, 3);
  assert.equal(second.t, 1);
  assert.equal(first.v, -5);
  assert.deepEqual(first.left, { kind: "free", dt: -0.25, dp: 2 });
  assert.equal(first.right, undefined);
  const twice = operations.mirrorValue(
    operations
      .mirrorValue(picked, plain)
      .map((each, i) => ({ ...picked[i], at: { ...picked[i].at, ...each } })),
    plain,
  );
  assert.deepEqual(
    twice.map((each) => each.p),
    [0, 9],
  );
});

test("a dragged automatic handle is aligned, and the other side follows in line", () => {
  const at = {
    ...none,
    t: 1,
    p: 0,
    left: { kind: "auto", dt: -0.4, dp: -1 },
    right: { kind: "auto", dt: 0.2, dp: 0.5 },
  };
  const operation = operations.dragHandle("pan", 1, at, "left", -0.5, -3);
  assert.equal(operation.left.kind, "aligned");
  assert.equal(operation.right.dt, 0.2);
  assert.ok(
    Math.abs(operation.right.dp / operation.right.dt - operation.left.dp / operation.left.dt) <
      1e-12,
  );
});

test("a handle stays on its own side of the key", () => {
  const at = { ...none, t: 1, p: 0, left: { kind: "free", dt: -0.4, dp: -1 } };
  assert.ok(operations.dragHandle("pan", 1, at, "left", 0.3, 0).left.dt < 0);
});

test("copies keep their distances, and those of one axis go to the one that is edited", () => {
  const clipboard = operations.copyKeys(pickedOf(["pan", 1], ["pan", 2]));
  const pasted = operations.pasteKeys(clipboard, 10, "tilt", plain);
  assert.deepEqual(
    pasted.map(({ axis: name, t, p }) => [name, t, p]),
    [
      ["tilt", 10, 10],
      ["tilt", 12, 40],
    ],
  );
  const both = operations.pasteKeys(
    operations.copyKeys(pickedOf(["pan", 1], ["tilt", 1])),
    0,
    "pan",
    plain,
  );
  assert.deepEqual(
    both.map((each) => each.axis),
    ["pan", "tilt"],
  );
  assert.equal(operations.copyKeys([]), null);
});

test("numbers are written as fine as the screen shows and no finer", () => {
  assert.equal(shortNumber(12.5, 3), "12.5");
  assert.equal(shortNumber(-0.0001, 2), "0");
  assert.equal(decimalsFor(0.2), 1);
  assert.equal(roundFor(137.41873201, 0.08), 137.42);
  assert.equal(withUnit(12.5, "mm", 2), "12.5 mm/s²");
  assert.equal(clamp(5, 0, 3), 3);
});

const view = { from: 0, to: 10, low: 0, high: 100, left: 0, top: 0, width: 1000, height: 500 };
const drag = { dx: 100, dy: -50, lock: null, isFine: false, isSnapping: false };

test("a drag is as long as the pointer's way, a tenth of it with Shift", () => {
  const free = [-Infinity, Infinity];
  assert.deepEqual(dragOf(drag, { t: 2, p: 20 }, view, free, {}), { dt: 1, dp: 10, snapped: null });
  const fine = dragOf({ ...drag, isFine: true }, { t: 2, p: 20 }, view, free, {});
  assert.ok(Math.abs(fine.dt - 0.1) < 1e-12 && Math.abs(fine.dp - 1) < 1e-12);
});

test("a lock leaves one direction alone, and the same key takes it off", () => {
  const locked = dragOf({ ...drag, lock: "time" }, { t: 2, p: 20 }, view, [-9, 9], {});
  assert.equal(locked.dp, 0);
  assert.equal(dragOf({ ...drag, lock: "value" }, { t: 2, p: 20 }, view, [-9, 9], {}).dt, 0);
  assert.equal(toggleLock("time", "time"), null);
  assert.equal(toggleLock("time", "value"), "value");
});

test("a drag clings within eight pixels, and never goes past its range", () => {
  const near = dragOf({ ...drag, isSnapping: true }, { t: 2.05, p: 20 }, view, [-9, 9], {
    seconds: true,
  });
  assert.ok(Math.abs(near.dt - 0.95) < 1e-12);
  assert.equal(near.snapped, "second");
  const held = dragOf({ ...drag, isSnapping: true }, { t: 2.05, p: 20 }, view, [-9, 0.5], {
    seconds: true,
  });
  assert.equal(held.dt, 0.5);
  assert.equal(held.snapped, null);
});

const press = (key, more = {}) => ({
  key,
  ctrlKey: false,
  metaKey: false,
  shiftKey: false,
  altKey: false,
  ...more,
});

test("keys are spelled the same on every keyboard", () => {
  assert.equal(actionFor(press("ArrowLeft")), "earlier");
  assert.equal(actionFor(press("ArrowLeft", { shiftKey: true })), "earlier-fine");
  assert.equal(actionFor(press("c", { metaKey: true })), "copy");
  assert.equal(actionFor(press("M", { shiftKey: true })), "mirror-value");
  assert.equal(actionFor(press("?", { shiftKey: true })), "help");
  assert.equal(actionFor(press(" ")), "preview");
  assert.equal(actionFor(press("x", { altKey: true })), null);
  assert.equal(actionFor(press("q")), null);
});

test("of a point in space only what changes is set", () => {
  const point = { path: ["path", "points", "2"], at: [1, 2, 3], unit: "mm" };
  assert.deepEqual(operations.setPoint(point, { at: [1, 2.5, 3] }), [
    { op: "set", path: ["path", "points", "2", "1"], value: 2.5, unit: "mm" },
  ]);
  assert.deepEqual(operations.setPoint(point, { at: [undefined, undefined, "4 m"] }), [
    { op: "set", path: ["path", "points", "2", "2"], value: "4 m", unit: "mm" },
  ]);
  assert.deepEqual(operations.setPoint(point, { at: [1, 2, 3] }), []);
});

test("a key of a subject has a time, and its point beside it", () => {
  const path = ["camera", "look", "subject", "keys", "1"];
  const key = { path, t: 7, at: [1, 2, 3], unit: "mm" };
  assert.deepEqual(operations.setPoint(key, { t: 6, at: [0] }), [
    { op: "set", path: [...path, "0"], value: 6, unit: "s" },
    { op: "set", path: [...path, "1", "0"], value: 0, unit: "mm" },
  ]);
});
