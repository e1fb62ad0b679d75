import assert from "node:assert/strict";
import { test } from "node:test";
import * as scale from "../../../../firmware/studio/web/view/scale.js";
import { boxOf, firstAtOrAfter, inBox, nearest } from "../../../../firmware/studio/web/view/hit.js";
import { snapTime, snapValue } from "../../../../firmware/studio/web/view/snap.js";
import { random } from "./random.mjs";

const view = { from: 2, to: 12, low: -50, high: 150, left: 60, top: 20, width: 800, height: 400 };

test("pixels and values are each other's inverse", () => {
  const draw = random(3);
  for (let i = 0; i < 200; i++) {
    const t = draw.unit() * 40 - 10;
    const value = draw.unit() * 1000 - 500;
    assert.ok(Math.abs(scale.xToTime(view, scale.timeToX(view, t)) - t) < 1e-9);
    assert.ok(Math.abs(scale.yToValue(view, scale.valueToY(view, value)) - value) < 1e-9);
  }
  assert.equal(scale.timeToX(view, 2), 60);
  assert.equal(scale.valueToY(view, 150), 20);
});

test("what is under the pointer stays there when one zooms", () => {
  const x = 333;
  const t = scale.xToTime(view, x);
  const zoomed = scale.zoomTime(view, 0.25, x);
  assert.ok(Math.abs(scale.xToTime(zoomed, x) - t) < 1e-9);
  assert.ok(Math.abs(zoomed.to - zoomed.from - 2.5) < 1e-9);
  const y = 111;
  assert.ok(
    Math.abs(scale.yToValue(scale.zoomValue(view, 3, y), y) - scale.yToValue(view, y)) < 1e-9,
  );
});

test("a zoom ends before numbers do", () => {
  let close = view;
  for (let i = 0; i < 500; i++) close = scale.zoomTime(close, 0.5, 400);
  assert.ok(close.to - close.from >= 0.9e-3);
  let far = view;
  for (let i = 0; i < 500; i++) far = scale.zoomValue(far, 4, 200);
  assert.ok(Number.isFinite(far.low) && Number.isFinite(far.high));
});

test("a pan takes along what is under the pointer", () => {
  const moved = scale.pan(view, 80, -40);
  assert.ok(Math.abs(scale.timeToX(moved, 5) - scale.timeToX(view, 5) - 80) < 1e-9);
  assert.ok(Math.abs(scale.valueToY(moved, 5) - scale.valueToY(view, 5) + 40) < 1e-9);
});

test("ticks are round, inside, and not too many", () => {
  const draw = random(4);
  for (let i = 0; i < 300; i++) {
    const low = draw.unit() * 200 - 100;
    const high = low + 10 ** (draw.unit() * 8 - 4);
    const { step, values } = scale.ticks(low, high, 8);
    assert.ok(
      values.length <= 9 && values.length >= 2,
      `${values.length} ticks from ${low} to ${high}`,
    );
    const digit = Number(step.toExponential(6).split("e")[0]);
    assert.ok(
      [1, 2, 5, 10].some((each) => Math.abs(digit - each) < 1e-6),
      `step ${step}`,
    );
    for (const value of values)
      assert.ok(value >= low - step * 1e-6 && value <= high + step * 1e-6);
  }
  assert.deepEqual(scale.ticks(1, 1, 5).values, []);
});

test("with a frame rate ticks stand at whole frames", () => {
  for (const t of scale.timeTicks(0.1, 1.3, 20, 24).values)
    assert.ok(Math.abs(t * 24 - Math.round(t * 24)) < 1e-9);
});

test("the nearest is taken, and of equals the one on top", () => {
  const targets = [
    { x: 10, y: 10, n: 0 },
    { x: 14, y: 10, n: 1 },
    { x: 14, y: 10, n: 2 },
  ];
  assert.equal(nearest(targets, 13, 10, 9).n, 2);
  assert.equal(nearest(targets, 10, 11, 9).n, 0);
  assert.equal(nearest(targets, 40, 40, 9), null);
});

test("a box drawn in any direction holds the same", () => {
  const targets = [
    { x: 1, y: 1 },
    { x: 5, y: 5 },
    { x: 9, y: 9 },
  ];
  const box = boxOf({ x: 6, y: 2 }, { x: 0, y: 6 });
  assert.deepEqual(box, boxOf({ x: 0, y: 6 }, { x: 6, y: 2 }));
  assert.deepEqual(inBox(targets, box), [{ x: 5, y: 5 }]);
});

test("the first key at or after a time", () => {
  const keys = [0, 1, 1, 4].map((t) => ({ t }));
  assert.deepEqual(
    [-1, 0, 0.5, 1, 2, 4, 5].map((t) => firstAtOrAfter(keys, t)),
    [0, 0, 1, 1, 3, 3, 4],
  );
});

test("things win over grids, the nearer over the farther, nothing beyond reach", () => {
  const targets = { fps: 24, seconds: true, playhead: 3.02, markers: [2.99], keys: [7] };
  assert.deepEqual(snapTime(3.0, targets, 0.05), { t: 2.99, to: "marker" });
  assert.deepEqual(snapTime(3.015, targets, 0.05), { t: 3.02, to: "playhead" });
  assert.equal(snapTime(5.01, targets, 0.02).t, 5);
  assert.equal(snapTime(5.3, { seconds: true }, 0.02).to, null);
  assert.equal(snapTime(5.3, {}, 1).t, 5.3);
});

test("values cling to those of other keys within reach", () => {
  assert.equal(snapValue(101, [0, 100, 250], 2), 100);
  assert.equal(snapValue(110, [0, 100, 250], 2), 110);
});
