import assert from "node:assert/strict";
import { test } from "node:test";
import { PlannerClient } from "../../../../firmware/studio/web/planner/client.js";
import {
  commonRange,
  layOut,
  positionRange,
  sampleRange,
  viewOf,
} from "../../../../firmware/studio/web/curve/layout.js";
import {
  boundsOf,
  frustumCorners,
  poseAt,
  verticalAngle,
} from "../../../../firmware/studio/web/space/lens.js";

function clientOf() {
  const posted = [];
  const worker = { postMessage: (message) => posted.push(message) };
  const client = new PlannerClient(worker);
  return {
    client,
    posted,
    answer: (members) => worker.onmessage({ data: { id: posted.shift().id, ...members } }),
  };
}

test("of what follows the pointer, one is under way, one waits, and the rest is passed over", async () => {
  const { client, posted, answer } = clientOf();
  const results = [1, 2, 3].map((step) => client.askLatest("preview", { step }));
  assert.deepEqual(
    posted.map((each) => each.step),
    [1],
  );
  answer({ done: 1 });
  assert.equal((await results[0]).done, 1);
  assert.equal(await results[1], null);
  assert.deepEqual(
    posted.map((each) => each.step),
    [3],
  );
  answer({ done: 3 });
  assert.equal((await results[2]).done, 3);
});

test("what was dropped is not asked", async () => {
  const { client, posted, answer } = clientOf();
  const first = client.askLatest("preview", { step: 1 });
  const second = client.askLatest("preview", { step: 2 });
  client.drop("preview");
  assert.equal(await second, null);
  answer({});
  await first;
  assert.deepEqual(posted, []);
});

const axis = {
  name: "pan",
  unit: "deg",
  keys: [
    { t: 0, p: -10 },
    { t: 2, p: 30 },
  ],
  limits: [
    [-170, 170],
    [-30, 30],
    [-10, 10],
    [0, 0],
  ],
  samples: Float64Array.from([-10, 30, -5, 45, -3, 3, -2, 2]),
};

test("panes, ruler and sheet stand below each other and inside the canvas", () => {
  for (const [width, height] of [
    [1200, 800],
    [360, 300],
    [100, 60],
  ]) {
    const layout = layOut(width, height, [axis, { ...axis, name: "tilt" }]);
    let below = layout.ruler.height;
    for (const pane of layout.panes) {
      assert.ok(pane.top >= below && pane.height > 0 && pane.width > 0);
      below = pane.top + pane.height;
    }
    assert.ok(layout.sheet.top >= below);
    assert.ok(layout.sheet.top + layout.sheet.height <= height);
  }
});

test("bands of limits are at one height for all axes, and broken ones are in sight", () => {
  const [pane] = layOut(1000, 600, [axis]).panes;
  const view = viewOf(pane, 1, axis, { from: 0, to: 2 }, { low: 0, high: 1 }, null);
  assert.ok(view.high >= 45 && view.high <= 60 && view.low === -view.high);
  const free = viewOf(pane, 3, axis, { from: 0, to: 2 }, { low: 0, high: 1 }, null);
  assert.ok(free.high > 2);
});

test("positions fill a normalised pane, and share one span otherwise", () => {
  const [pane] = layOut(1000, 600, [axis]).panes;
  const other = {
    ...axis,
    keys: [
      { t: 0, p: 100 },
      { t: 1, p: 500 },
    ],
  };
  assert.deepEqual(positionRange(axis), [-10, 30]);
  assert.deepEqual(commonRange([axis, other]), [-10, 500]);
  const view = viewOf(
    pane,
    0,
    axis,
    { from: 0, to: 2 },
    { low: 0, high: 1 },
    commonRange([axis, other]),
  );
  assert.deepEqual([view.low, view.high], [-10, 500]);
  const still = positionRange({ keys: [{ t: 0, p: 7 }], samples: null });
  assert.ok(still[0] < 7 && still[1] > 7);
});

test("the range of samples is that of all columns", () => {
  assert.deepEqual(
    sampleRange(Float64Array.from([1, 2, 0, 0, 0, 0, 0, 0, -4, 1, 0, 0, 0, 0, 0, 0]), 0),
    [-4, 2],
  );
  assert.equal(sampleRange(new Float64Array(0), 0), null);
});

test("a 36 mm lens on a square picture sees 53 degrees; a longer one sees less", () => {
  assert.ok(Math.abs(verticalAngle(36, 1) - 53.13) < 0.01);
  assert.ok(verticalAngle(85, 16 / 9) < verticalAngle(35, 16 / 9));
  const [corner] = frustumCorners(36, 1, 2);
  assert.deepEqual(
    corner.map((value) => Math.round(value * 1e6) / 1e6),
    [-1, -1, -2],
  );
});

test("a pose is read from its numbers, and a path has bounds", () => {
  const poses = new Float64Array(32).fill(NaN);
  poses.set([1, 2, 3, 0, 1, 0, -1, 0, 0, 0, 0, 1, NaN, NaN, 0], 0);
  poses.set([3, 2, 3, 0, 1, 0, -1, 0, 0, 0, 0, 1, 35, 4, 1, 5], 16);
  assert.equal(poseAt(poses, 16, 0).focal, null);
  const pose = poseAt(poses, 16, 1);
  assert.deepEqual([pose.focal, pose.focus, pose.hasSubject, pose.distance], [35, 4, true, 5]);
  assert.deepEqual(boundsOf(poses, 16), { centre: [2, 2, 3], radius: 1 });
});
