// The machine: a simulated rig is run, jogged, captured from and watched.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { launch, open, picture, serve, settle, tab, textOf, TICK_MS, until } from "./studio.mjs";

let browser;
before(async () => (browser = await launch()));
after(() => browser.close());

function on(name, body, change, example = "dolly") {
  test(name, { timeout: 120000 }, async () => {
    const studio = await serve(example, change, TICK_MS);
    try {
      const page = await open(browser, studio.url);
      await until(page, "frames", () => globalThis.studio.machine.isFresh.value);
      await body(page, studio);
      assert.deepEqual(page.errors, []);
      await page.context().close();
    } finally {
      await studio.end();
    }
  });
}

const press = (page, name) => page.getByRole("button", { name, exact: true }).click();
const state = (page, wanted) =>
  until(
    page,
    `state ${wanted}`,
    (each) => globalThis.studio.machine.state.value === each,
    wanted,
    30000,
  );
const frame = (page) => page.evaluate(() => globalThis.studio.machine.frame.value);

async function ready(page) {
  await press(page, "Take control");
  await until(page, "control", () => globalThis.studio.machine.isHolder.value);
  await press(page, "Enable");
  await state(page, "ready");
}

// A short move from where the simulated axes stand, so that a run takes seconds.
const short = (rig) => [
  rig,
  `title: Short
fps: 24
axes:
  dolly:
    curve: quintic
    keys:
      - [0 s, 120 mm]
      - [4 s, 220 mm]
      - [8 s, 300 mm]
`,
];

async function atStart(page) {
  await ready(page);
  await press(page, "Load");
  await until(page, "the load", () => globalThis.studio.machine.loaded.value !== null);
}

on(
  "run: load, start, hold, resume, half speed, and stop",
  async (page) => {
    await atStart(page);
    await press(page, "Start");
    await state(page, "moving");
    await until(page, "path time", () => globalThis.studio.machine.frame.value.path > 0.5);
    await picture(page, "running");
    await press(page, "Hold");
    await state(page, "holding");
    await until(page, "rest", () => globalThis.studio.machine.frame.value.rate === 0);
    const held = await frame(page);
    await page.waitForTimeout(300);
    assert.equal((await frame(page)).path, held.path);
    await press(page, "Resume");
    await state(page, "moving");
    await page.getByLabel("Speed", { exact: false }).first().fill("50");
    await until(
      page,
      "half speed",
      () => Math.abs(globalThis.studio.machine.frame.value.rate - 0.5) < 0.01,
    );
    await press(page, "Stop");
    await state(page, "ready");
    const stopped = await frame(page);
    assert.ok(stopped.path > held.path && stopped.path < stopped.end);
    assert.ok(Math.abs(stopped.axes[0].velocity) < 0.5);
    // To a key of the move, where it is held; the planner says where that is.
    const [t, p] = await page.evaluate(() => {
      const { session } = globalThis.studio;
      session.selection.value = new Map([["dolly", new Set([1])]]);
      const key = session.axes.value[0].keys[1];
      return [key.t, key.p];
    });
    await press(page, "Go to key…");
    await page.getByRole("dialog", { name: `To key 2 of dolly, at ${t.toFixed(2)} s` }).waitFor();
    await press(page, "Go");
    await state(page, "holding");
    const there = await frame(page);
    assert.ok(Math.abs(there.axes[0].actual.last - p) < 0.5, `${there.axes[0].actual.last}, ${p}`);
    assert.ok(Math.abs(there.path - t) < 1e-3);
  },
  short,
);

on(
  "a whole run is a take, with plan and actual over it",
  async (page, studio) => {
    await atStart(page);
    await press(page, "Start");
    await state(page, "moving");
    await until(
      page,
      "the end",
      () => globalThis.studio.machine.takes.value.length === 1,
      undefined,
      30000,
    );
    const take = await page.evaluate(() => {
      const { rows, worst } = globalThis.studio.machine.takes.value[0];
      const ticks = rows.reduce((sum, row) => sum + row.ticks, 0);
      return { length: rows.length, worst: worst[0], last: rows.at(-1).path, ticks };
    });
    assert.ok(take.length > 10 && take.ticks > 5000 / TICK_MS, JSON.stringify(take));
    assert.ok(take.worst > 0 && take.worst < 5, `${take.worst} mm`);
    await tab(page, "Plots");
    await page.locator(".takes li").first().waitFor();
    await picture(page, "take");
    // Kept, forgotten by the page, and read again from disk.
    await press(page, "Keep");
    await until(page, "the file", () => globalThis.studio.machine.kept.value.length === 1);
    const [name] = await page.evaluate(() => {
      const { machine } = globalThis.studio;
      machine.trail.takes.length = 0;
      machine.takes.value = [];
      return machine.kept.value;
    });
    await press(page, `Compare ${name}`);
    await until(page, "the take", () => globalThis.studio.machine.takes.value.length === 1);
    const again = await page.evaluate(() => {
      const { rows, worst } = globalThis.studio.machine.takes.value[0];
      return { length: rows.length, worst: worst[0], last: rows.at(-1).path };
    });
    assert.equal(again.length, take.length);
    assert.ok(Math.abs(again.worst - take.worst) < 1e-5);
    // Beside it a recording by the tick, of the same move by the program.
    const file = join(studio.directory, "by-tick.csv");
    execFileSync(process.env.SLEW ?? "build/slew", ["run", studio.directory, "--telemetry", file], {
      stdio: "ignore",
    });
    await page.getByLabel("Open a recording").setInputFiles(file);
    await until(page, "the recording", () => globalThis.studio.machine.takes.value.length === 2);
    const recorded = await page.evaluate(() => {
      const { rows, worst } = globalThis.studio.machine.takes.value[0];
      return { length: rows.length, worst: worst[0], last: rows.at(-1).path };
    });
    assert.ok(recorded.length > 400 && recorded.worst > 0, JSON.stringify(recorded));
    assert.ok(Math.abs(recorded.last - 8) < 0.02, JSON.stringify(recorded));
    await page.locator("select", { hasText: "all of it" }).selectOption("2");
    await page.locator(".scroll").fill("3");
    await page.getByRole("img", { name: "3.0 s to 5.0 s" }).waitFor();
    await picture(page, "take-scrolled");
    await page.getByLabel("Open a recording").setInputFiles(join(studio.directory, "rig.yaml"));
    await until(page, "no recording", () =>
      globalThis.studio.session.notice.value.text.includes("no recording"),
    );
  },
  short,
);

on("where the move begins is shown before anything goes there", async (page) => {
  await ready(page);
  await press(page, "Load");
  await until(page, "the load", () => globalThis.studio.machine.loaded.value !== null);
  await press(page, "Go to start…");
  const dialog = page.getByRole("dialog", { name: "To the start of the move" });
  await dialog.waitFor();
  assert.match(await dialog.innerText(), /pan\s+0 deg\s+-58 deg/);
  await picture(page, "approach");
  assert.equal((await frame(page)).state, "ready");
  await press(page, "Go");
  await state(page, "moving");
  await state(page, "ready");
  assert.ok(Math.abs((await frame(page)).axes[2].actual.last + 58) < 0.5);
});

on(
  "the way of the camera is drawn in space before it goes there",
  async (page) => {
    await ready(page);
    await press(page, "Load");
    await until(page, "the load", () => globalThis.studio.machine.loaded.value !== null);
    await press(page, "Go to start…");
    await page.getByRole("dialog", { name: "To the start of the move" }).waitFor();
    await page.getByRole("tab", { name: "Space", selected: true }).waitFor();
    // Of two who ask for poses, only the later is answered.
    await until(page, "the space view", () => globalThis.studio.session.space?.poses);
    const [first, last, start] = await page.evaluate(async () => {
      const { session } = globalThis.studio;
      const { poses, size } = session.approach.value;
      const move = await session.poses(0, 1, 2);
      const at = (numbers, i) => [...numbers.subarray(i * size, i * size + 3)];
      return [at(poses, 0), at(poses, poses.length / size - 1), at(move.poses, 0)];
    });
    last.forEach((value, k) => assert.ok(Math.abs(value - start[k]) < 1e-3, `${last}, ${start}`));
    assert.ok(
      first.some((value, k) => Math.abs(value - last[k]) > 0.01),
      "there is a way",
    );
    await settle(page);
    await picture(page, "approach-in-space");
    await press(page, "Not now");
    assert.equal(await page.evaluate(() => globalThis.studio.session.approach.value), null);
  },
  undefined,
  "jib",
);

on("a jog lasts as long as the button is held", async (page) => {
  await ready(page);
  await tab(page, "Jog");
  const button = page.getByRole("button", { name: "Jog dolly up while held" });
  const box = await button.boundingBox();
  const before_ = (await frame(page)).axes[0].actual.last;
  await page.mouse.move(box.x + 10, box.y + 10);
  // On a machine so busy that frames stay away for half a second a jog ends by
  // itself, as it should; then the button is pressed again.
  const moved = () =>
    page
      .waitForFunction(
        (from) => globalThis.studio.machine.frame.value.axes[0].actual.last > from + 5,
        before_,
        { timeout: 3000 },
      )
      .then(() => true)
      .catch(() => false);
  let hasMoved = false;
  for (let i = 0; i < 5 && !hasMoved; i++) {
    await page.mouse.up();
    await page.mouse.down();
    hasMoved = await moved();
  }
  assert.ok(hasMoved, "the axis did not move");
  await picture(page, "jogging");
  await page.mouse.up();
  await until(page, "rest", () => !globalThis.studio.machine.frame.value.jogging);
  const rest = (await frame(page)).axes[0].actual.last;
  await page.waitForTimeout(500);
  assert.ok(Math.abs((await frame(page)).axes[0].actual.last - rest) < 0.05);
});

for (const [what, lose] of [
  ["focus is lost", (page) => page.evaluate(() => window.dispatchEvent(new Event("blur")))],
  ["the page is gone", (page) => page.context().close()],
  [
    "the page hangs",
    (page) =>
      void page
        .evaluate(() => {
          const end = performance.now() + 3000;
          while (performance.now() < end);
        })
        .catch(() => {}),
  ],
])
  on(`a jog ends when ${what}`, async (page, studio) => {
    const watcher = await open(browser, studio.url);
    await until(watcher, "frames", () => globalThis.studio.machine.isFresh.value);
    await ready(page);
    await tab(page, "Jog");
    const box = await page.getByRole("button", { name: "Jog dolly up while held" }).boundingBox();
    await page.mouse.move(box.x + 10, box.y + 10);
    await page.mouse.down();
    await until(watcher, "the jog", () => globalThis.studio.machine.frame.value.jogging);
    await page.waitForTimeout(500);
    await lose(page);
    const begin = Date.now();
    await until(
      watcher,
      "rest",
      () => Math.abs(globalThis.studio.machine.frame.value.axes[0].velocity) < 0.1,
    );
    const took = Date.now() - begin;
    // The dead man's 250 ms, the ramp at 100 mm/s2 from 15 mm/s, and a loaded machine.
    assert.ok(took < 1500, `${took} ms`);
    await watcher.context().close();
  });

on(
  "a key from where the machine stands",
  async (page) => {
    await ready(page);
    await page.evaluate(() => (globalThis.studio.session.playhead.value = 3));
    await press(page, "Key from machine");
    await page.waitForFunction(() => globalThis.studio.session.isDirty.value);
    await settle(page);
    const keys = await page.evaluate(() =>
      globalThis.studio.session.axes.value[0].keys.map(({ t, p }) => [t, p]),
    );
    const added = keys.find(([t]) => t === 3);
    assert.ok(added && Math.abs(added[1] - 120) < 0.5, JSON.stringify(keys));
    assert.match(await textOf(page), /\[3 s, 1(20|19\.\d+|20\.\d+)/);
  },
  short,
);

on(
  "a page that is loaded again in mid-run shows the run",
  async (page) => {
    await atStart(page);
    await press(page, "Start");
    await until(page, "path time", () => globalThis.studio.machine.frame.value.path > 0.5);
    await page.reload();
    await page.waitForFunction(() => globalThis.studio?.machine.isFresh.value);
    await until(page, "the run", () => globalThis.studio.machine.machineAt.value > 0.5);
    await press(page, "Stop");
    await state(page, "ready");
  },
  short,
);

on(
  "of two pages one has control, both may stop",
  async (page, studio) => {
    await atStart(page);
    const other = await open(browser, studio.url);
    await until(other, "frames", () => globalThis.studio.machine.isFresh.value);
    await until(other, "the other's control", () => globalThis.studio.machine.isHeld.value);
    await other.getByRole("button", { name: /Take control/ }).click();
    await until(other, "the refusal", () =>
      /another client has control/.test(globalThis.studio.session.notice.value?.text),
    );
    assert.equal(await other.evaluate(() => globalThis.studio.machine.isHolder.value), false);
    assert.equal(
      await other.getByRole("button", { name: "Start", exact: true }).isDisabled(),
      true,
    );
    await press(page, "Start");
    await state(other, "moving");
    await press(other, "Stop");
    await state(page, "ready");
    await press(page, "Give control back");
    await until(other, "control is free", () => !globalThis.studio.machine.isHeld.value);
    await press(other, "Take control");
    await until(other, "control", () => globalThis.studio.machine.isHolder.value);
    await other.context().close();
  },
  short,
);

on("what is old looks old, and comes back by itself", async (page, studio) => {
  await tab(page, "Drives");
  await page.locator(".drives tbody tr").first().waitFor();
  await picture(page, "drives");
  studio.child.kill("SIGSTOP");
  await until(page, "silence", () => globalThis.studio.machine.linkState.value !== "open");
  await page.locator("section.old").first().waitFor();
  assert.match(await page.locator("header .link").innerText(), /old|not connected/);
  await page.waitForTimeout(1200);
  await picture(page, "old");
  studio.child.kill("SIGCONT");
  await until(page, "the connection", () => globalThis.studio.machine.linkState.value === "open");
});
