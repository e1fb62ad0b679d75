// What the space view draws of a rig, against the camera that the planner places.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { Planner } from "../../../../firmware/studio/wasm/planner.mjs";

const planner = await Planner.load(readFileSync("build/studio/planner.wasm"));

function planOf(example) {
  for (const name of ["rig.yaml", "move.yaml"])
    planner.put(name, readFileSync(`examples/${example}/${name}`, "utf8"));
  return planner.plan("rig.yaml", "move.yaml");
}

const pointsOf = ({ points }) =>
  Array.from({ length: points.length / 3 }, (_, i) => points.slice(3 * i, 3 * i + 3));
const distance = (a, b) => Math.hypot(...a.map((value, i) => value - b[i]));

function toLine(point, a, b) {
  const along = b.map((value, i) => value - a[i]);
  const square = along.reduce((sum, value) => sum + value * value, 0);
  const share = along.reduce((sum, value, i) => sum + value * (point[i] - a[i]), 0) / square;
  const inside = Math.min(Math.max(share, 0), 1);
  return distance(
    point,
    a.map((value, i) => value + inside * along[i]),
  );
}

test("the head stands on every rail of its rig, and carries the camera", () => {
  for (const example of ["slider", "orbit", "jib", "product", "timelapse", "dollyzoom"]) {
    const plan = planOf(example);
    assert.equal(plan.report.status, "ok", example);
    for (const share of [0, 0.3, 1]) {
      const t = share * plan.report.end_s;
      const lines = plan.body(t);
      const [pivot, pupil] = pointsOf(lines.at(-1));
      const pose = plan.poses(t, t, 1);
      assert.ok(distance(pupil, [...pose.subarray(0, 3)]) < 1e-9, example);
      const rails = lines.filter((line) => line.isRail);
      assert.ok(rails.length > 0, example);
      for (const rail of rails) {
        const points = pointsOf(rail);
        const pairs = points.slice(1).map((point, i) => [points[i], point]);
        const away = Math.min(...pairs.map(([a, b]) => toLine(pivot, a, b)));
        const longest = Math.max(...pairs.map(([a, b]) => distance(a, b)));
        // A chord of a round rail is off by less than an eighth of its length.
        assert.ok(away < Math.max(longest / 8, 1e-6), `${example}: ${away} m beside a rail`);
      }
    }
    plan.free();
  }
});

test("a jib's boom goes from its foot to the head, at its length", () => {
  const plan = planOf("jib");
  const boom = plan.body(0).find((line) => !line.isRail);
  const [ground, foot, head] = pointsOf(boom);
  assert.deepEqual(
    [ground, foot],
    [
      [0, 0, 0],
      [0, 0, 1.3],
    ],
  );
  assert.ok(Math.abs(distance(foot, head) - 2.6) < 0.4, `${distance(foot, head)} m`);
  plan.free();
});

test("a rig without kinematics has no lines", () => {
  const plan = planOf("dolly");
  assert.deepEqual(plan.body(1), []);
  plan.free();
});

test("keys of poses and of the warp come with their places in the text", () => {
  const plan = planOf("poses");
  const { others } = plan.report;
  assert.deepEqual(
    others.map(({ kind, name }) => `${kind} ${name}`),
    ["pose close", "pose window", "warp warp"],
  );
  assert.equal(others[1].unit, "%");
  assert.deepEqual(others[1].keys[1], [12, 50, 28, 11]);
  assert.deepEqual(others[2].keys[2].slice(0, 2), [15, 12]);
  plan.free();
});
