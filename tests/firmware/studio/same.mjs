// tests/firmware/studio/same.mjs PLANNER SLEW DIRECTORY... - the planner of the
// browser and the program, on the rig and the move of each directory: the same
// sentences, the same violations, the same hash of all tracks, the same bits of every axis at 500 Hz.
import { execFile } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { promisify } from "node:util";
import { Planner } from "../../../firmware/studio/wasm/planner.mjs";
import { readViolations } from "../../../firmware/studio/web/model/keys.js";

const RATE = 500;
const CHUNK = 4096;
const run = promisify(execFile);
const [wasm, slew, ...directories] = process.argv.slice(2);
const planner = await Planner.load(fs.readFileSync(wasm));

async function native(...words) {
  try {
    const done = await run(slew, words, { maxBuffer: 1 << 30 });
    return { code: 0, ...done };
  } catch (failed) {
    if (typeof failed.code !== "number") throw failed;
    return failed;
  }
}

function putAll(directory) {
  for (const name of fs.readdirSync(directory, { recursive: true })) {
    const file = path.join(directory, name);
    if (fs.statSync(file).isFile()) planner.put(file, fs.readFileSync(file));
  }
}

function sameSentences(plan, check) {
  const said = check.stderr.split("\n").filter((line) => line !== "");
  const ours = plan.report.messages.map((message) => message.text);
  if (said.join("\n") === ours.join("\n")) return null;
  return `slew says ${said.join(" | ")}; the planner ${ours.join(" | ")}`;
}

// What a reader has of a number that slew, with cJSON, has written: 15 digits where
// these are the number but for its last bit.
function written(value) {
  const short = Number(value.toPrecision(15));
  const most = Math.max(Math.abs(short), Math.abs(value));
  return Math.abs(short - value) <= most * Number.EPSILON ? short : value;
}

function sameViolations(plan, check) {
  const slews = JSON.parse(check.stdout).violations;
  const { axes } = plan.report;
  const words = { violation: Planner.VIOLATION, violations: Planner.VIOLATIONS };
  const violations = readViolations(plan.violations(), words);
  const ours = violations.map((v) => {
    const one = { axis: axes[v.axis].name, what: v.what, time_s: written(v.time_s) };
    return { ...one, value: written(v.value), limit: written(v.limit), line: v.line };
  });
  const theirs = slews.map((v) => {
    const one = { axis: v.axis, what: v.what, time_s: v.time_s };
    return { ...one, value: v.value, limit: v.limit, line: v.line };
  });
  const [a, b] = [JSON.stringify(theirs), JSON.stringify(ours)];
  return a === b ? null : `violations: slew ${a}, the planner ${b}`;
}

function sameRows(plan, text) {
  const lines = text.trimEnd().split("\n").slice(1);
  for (let axis = 0; axis < plan.report.axes.length; axis++)
    for (let first = 0; first < lines.length; first += CHUNK) {
      const count = Math.min(CHUNK, lines.length - first);
      const rows = plan.rows(axis, first, count, RATE);
      for (let i = 0; i < count; i++) {
        const cells = lines[first + i].split(",").slice(1 + 3 * axis, 4 + 3 * axis);
        for (let k = 0; k < 3; k++)
          if (BigInt(cells[k]) !== rows[4 * i + k])
            return (
              `axis ${plan.report.axes[axis].name}, sample ${first + i}: ` +
              `${"pva"[k]} is ${cells[k]}, the planner's ${rows[4 * i + k]}`
            );
      }
    }
  return lines.length > 0 ? null : "slew sample gives no rows";
}

const counts = { same: 0, refused: 0, over: 0 };
async function compare(directory) {
  const rig = path.join(directory, "rig.yaml");
  const move = path.join(directory, "move.yaml");
  const check = await native("check", "--json", rig, move);
  const plan = planner.plan(rig, move);
  try {
    const sentences = sameSentences(plan, check);
    if (sentences !== null) return sentences;
    if ((check.code === 2) !== (plan.report.status === "input"))
      return `slew check ends with ${check.code}, the planner ${plan.report.status}`;
    counts.same++;
    if (check.code === 2) {
      counts.refused++;
      return null;
    }
    if (plan.report.violations > 0) counts.over++;
    const violations = sameViolations(plan, check);
    if (violations !== null) return violations;
    const { hash } = JSON.parse(check.stdout);
    if (hash !== plan.report.hash) return `hash: slew ${hash}, the planner ${plan.report.hash}`;
    const sample = ["sample", "--raw", "--rate", `${RATE}`, rig, move];
    return sameRows(plan, (await native(...sample)).stdout);
  } finally {
    plan.free();
  }
}

directories.forEach(putAll);
const queue = [...directories];
let failed = 0;
async function work() {
  for (let directory; (directory = queue.shift()) !== undefined; ) {
    const what = await compare(directory);
    if (what === null) continue;
    failed++;
    console.log(`${directory}: ${what}`);
  }
}
await Promise.all(os.cpus().map(work));
console.log(
  `${directories.length} moves: ${counts.same} say the same, of these ` +
    `${counts.refused} refused and ${counts.over} over limits; ${failed} failed`,
);
process.exit(failed > 0 || counts.same === 0 ? 1 : 0);
