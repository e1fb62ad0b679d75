// What the page takes over from the step of a drag before is what it would be told afresh.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { Planner } from "../../../firmware/studio/wasm/planner.mjs";
import { random } from "./page/random.mjs";

const planner = await Planner.load(readFileSync("build/studio/planner.wasm"));
const keys = Array.from({ length: 30 }, (_, i) => `[${i} s, ${1200 + 60 * Math.sin(i)} mm]`);
const moveOf = (curve) =>
  `axes:\n  dolly: {curve: ${curve}, keys: [${keys.join(", ")}]}\n` +
  "  pan: {curve: c2, keys: [[0, 0], [4, 20], [9, 3]]}\n";

function put(move) {
  planner.put("rig.yaml", readFileSync("examples/dolly/rig.yaml"));
  planner.put("move.yaml", move);
}

for (const curve of ["bezier", "quintic", "s-curve", "b-spline"])
  test(`steps of a drag on ${curve} give what a plan afresh gives`, () => {
    const { unit: next } = random(17);
    const move = moveOf(curve);
    put(move);
    const base = planner.plan("rig.yaml", "move.yaml");
    assert.equal(base.report.status, "ok", base.report.messages[0]?.text);
    const view = [-2, 33, 211];
    let last = { plan: base, samples: base.samples("dolly", ...view) };
    let taken = 0;
    for (let step = 0; step < 40; step++) {
      const key = 1 + Math.floor(next() * 28);
      const edited = base.edit([
        { op: "key", axis: "dolly", key, t: key + 0.4 * next(), p: 1100 + 200 * next() },
      ]);
      assert.ok(edited.ok, edited.error);
      planner.put("move.yaml", Planner.apply(move, edited.edits));
      const plan = planner.plan("rig.yaml", "move.yaml", last.plan);
      const fresh = planner.plan("rig.yaml", "move.yaml");
      const samples = plan.samples("dolly", ...view, last);
      assert.deepEqual(samples, fresh.samples("dolly", ...view));
      assert.deepEqual(plan.violations(), fresh.violations());
      assert.deepEqual(plan.keys("dolly"), fresh.keys("dolly"));
      assert.equal(plan.report.hash, fresh.report.hash);
      taken += plan.report.reused;
      fresh.free();
      if (last.plan !== base) last.plan.free();
      last = { plan, samples };
    }
    if (curve !== "b-spline") assert.ok(taken > 0);
    base.free();
  });

test("what did not change is not sampled a second time", () => {
  put(moveOf("quintic"));
  const plan = planner.plan("rig.yaml", "move.yaml");
  const again = planner.plan("rig.yaml", "move.yaml", plan);
  const samples = plan.samples("dolly", 0, 30, 100);
  samples[17] = 12345;
  assert.deepEqual(again.samples("dolly", 0, 30, 100, { plan, samples }), samples);
  plan.free();
  again.free();
});
