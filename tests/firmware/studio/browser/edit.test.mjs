// Editing: what one does on the page, and what becomes of the text and the tracks.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { after, before, test } from "node:test";
import {
  drag,
  hashOf,
  keyPoint,
  launch,
  open,
  picture,
  serve,
  settle,
  tab,
  textOf,
  TICK_MS,
} from "./studio.mjs";

let browser;
before(async () => (browser = await launch()));
after(() => browser.close());

// Each test has a studio and a page of its own.
function on(name, example, body, options = {}) {
  test(name, { timeout: 120000 }, async () => {
    const studio = await serve(example, options.change, TICK_MS);
    try {
      const page = await open(browser, studio.url, options);
      await body(page, studio);
      assert.deepEqual(page.errors, []);
      await page.context().close();
    } finally {
      await studio.end();
    }
  });
}

const changedLines = (before_, after_) => {
  const [a, b] = [before_.split("\n"), after_.split("\n")];
  return a.length === b.length ? a.flatMap((line, i) => (line === b[i] ? [] : [i])) : null;
};

on(
  "a dragged key changes its line of the text and the track, and undo takes both back",
  "dolly",
  async (page) => {
    const [text, hash] = [await textOf(page), await hashOf(page)];
    await drag(page, await keyPoint(page, "dolly", 2), 20, 12);
    const after_ = await textOf(page);
    const lines = changedLines(text, after_);
    assert.equal(lines.length, 1);
    assert.match(after_.split("\n")[lines[0]], /^ {6}- \[[\d.]+ s, [\d.]+ mm\]$/);
    assert.notEqual(await hashOf(page), hash);
    await picture(page, "dragged");
    await page.keyboard.press("Control+z");
    await settle(page);
    assert.equal(await textOf(page), text);
    assert.equal(await hashOf(page), hash);
    await page.keyboard.press("Control+Shift+z");
    await settle(page);
    assert.equal(await textOf(page), after_);
  },
);

on("what is drawn while dragging is what is written on release", "dolly", async (page) => {
  let shown;
  await drag(page, await keyPoint(page, "dolly", 3), -15, 20, {
    hold: async () => {
      await page.waitForTimeout(300);
      shown = await hashOf(page);
    },
  });
  assert.equal(await hashOf(page), shown);
});

on("a key that is dragged away and back leaves the text as it is", "dolly", async (page) => {
  const text = await textOf(page);
  const at = await keyPoint(page, "dolly", 3);
  await page.mouse.move(at.x, at.y);
  await page.mouse.down();
  for (const by of [4, 20, 4, 0]) {
    await page.mouse.move(at.x + by, at.y + by);
    await page.waitForTimeout(100);
  }
  await page.mouse.up();
  await settle(page);
  assert.equal(await textOf(page), text);
});

on("Escape calls a drag off", "dolly", async (page) => {
  const [text, hash] = [await textOf(page), await hashOf(page)];
  await drag(page, await keyPoint(page, "dolly", 2), 30, 30, {
    hold: () => page.keyboard.press("Escape"),
  });
  assert.equal(await textOf(page), text);
  assert.equal(await hashOf(page), hash);
});

on("a lock keeps the value, and time goes to whole frames", "dolly", async (page) => {
  await drag(page, await keyPoint(page, "dolly", 2), 25, 40, {
    hold: () => page.keyboard.press("x"),
  });
  const key = await page.evaluate(() => globalThis.studio.session.axes.value[0].keys[2]);
  assert.equal(key.p, 930);
  assert.ok(Math.abs(key.t * 24 - Math.round(key.t * 24)) < 0.03, `${key.t} s is no whole frame`);
  assert.notEqual(key.t, 6.8);
});

on("a key that is too fast is named at once, and fitted", "dolly", async (page) => {
  await drag(page, await keyPoint(page, "dolly", 2), 0, -90, {
    hold: async () => {
      await page.waitForTimeout(300);
      const during = await page.evaluate(() => globalThis.studio.session.violations.value.length);
      assert.ok(during > 0, "no violation while dragging");
      await picture(page, "violation");
    },
  });
  const problems = page.getByRole("region", { name: "Problems" });
  assert.match(await problems.innerText(), /dolly: (velocity|acceleration|jerk)/);
  await page.getByRole("button", { name: "Local stretch" }).click();
  await page.waitForFunction(() => globalThis.studio.session.violations.value.length === 0);
  await settle(page);
  assert.match(await problems.innerText(), /Inside all limits/);
  await picture(page, "fitted");
});

on("a box selects, and all of it moves together", "dolly", async (page) => {
  await page.evaluate(
    () => (globalThis.studio.session.hidden.value = new Set(["pan", "tilt", "focus"])),
  );
  await settle(page);
  const first = await keyPoint(page, "dolly", 1);
  const last = await keyPoint(page, "dolly", 2);
  await drag(
    page,
    { x: first.x - 12, y: Math.max(first.y, last.y) + 12 },
    last.x - first.x + 24,
    -Math.abs(first.y - last.y) - 24,
  );
  assert.equal(await page.evaluate(() => globalThis.studio.session.picked.value.length), 2);
  const gap = () =>
    page.evaluate(() => {
      const { keys } = globalThis.studio.session.axes.value[0];
      return [keys[2].t - keys[1].t, keys[2].p - keys[1].p].map(
        (each) => Math.round(each * 50) / 50,
      );
    });
  const before_ = await gap();
  await drag(page, await keyPoint(page, "dolly", 2), 0, -10, {
    hold: () => page.keyboard.press("y"),
  });
  assert.deepEqual(await gap(), before_);
  assert.equal(await page.evaluate(() => globalThis.studio.session.picked.value.length), 2);
});

on("without a pointer: select, nudge, add, copy, paste, mirror, remove", "dolly", async (page) => {
  const count = () => page.evaluate(() => globalThis.studio.session.axes.value[0].keys.length);
  const press = async (...keys) => {
    for (const key of keys) {
      await page.keyboard.press(key);
      await settle(page);
    }
  };
  await page.locator(".curve-canvas").focus();
  await press(".", ".", "ArrowRight", "ArrowRight");
  const key = await page.evaluate(() => globalThis.studio.session.axes.value[0].keys[1].t);
  assert.ok(Math.abs(key - (3.6 + 2 / 24)) < 1e-5, `${key}`);
  await press("Control+z");
  assert.equal(await page.evaluate(() => globalThis.studio.session.axes.value[0].keys[1].t), 3.6);
  await press("Home", "PageDown", "PageDown", "k");
  assert.equal(await count(), 8);
  await press("Delete");
  assert.equal(await count(), 7);
  await press(".", "Control+c", "End", "PageUp", "Control+v");
  assert.equal(await count(), 8);
  const text = await textOf(page);
  await press("a", "m", "m");
  assert.equal(await page.evaluate(() => globalThis.studio.session.report.value.status), "ok");
  await press("Control+z", "Control+z");
  assert.equal(await textOf(page), text);
});

on("exact numbers take units, and what is wrong is said", "dolly", async (page) => {
  await page.locator(".curve-canvas").focus();
  await page.keyboard.press(".");
  await page.keyboard.press(".");
  const field = page.getByLabel("Position");
  await field.fill("0.42 m");
  await field.press("Enter");
  await settle(page);
  assert.match(await textOf(page), /\[3\.6 s, 0\.42 m\]/);
  assert.equal(await page.evaluate(() => globalThis.studio.session.axes.value[0].keys[1].p), 420);
  const text = await textOf(page);
  await field.fill("12 deg");
  await field.press("Enter");
  await settle(page);
  const broken = await page.getByRole("region", { name: "Problems" }).innerText();
  const said = await page.locator("#notice").innerText();
  assert.match(broken + said, /deg/);
  await page.keyboard.press("Escape");
  await page.evaluate(() => globalThis.studio.session.undo());
  await settle(page);
  assert.ok([text, await textOf(page)].includes(text));
});

on(
  "typing in the text is drawn, a mistake stands at its line, undo is one history",
  "dolly",
  async (page) => {
    const text = await textOf(page);
    await tab(page, "Text");
    await page.locator(".cm-content").waitFor();
    await page.locator(".cm-line", { hasText: "[6.8 s, 930 mm]" }).click();
    await page.keyboard.press("End");
    for (let i = 0; i < 5; i++) await page.keyboard.press("ArrowLeft");
    await page.keyboard.press("Backspace");
    await page.keyboard.type("x");
    await page.waitForFunction(() => globalThis.studio.session.isBroken.value);
    const problems = await page.getByRole("region", { name: "Problems" }).innerText();
    assert.match(problems, /move\.yaml:18:\d+/);
    await picture(page, "mistake");
    await page.keyboard.press("Control+z");
    await settle(page);
    // Where the machine was so busy that there was a pause, there are two steps.
    if ((await textOf(page)) !== text) await page.keyboard.press("Control+z");
    await page.waitForFunction((wanted) => globalThis.studio.session.text.value === wanted, text);
    assert.equal(await page.evaluate(() => globalThis.studio.session.isBroken.value), false);
  },
);

on("another curve is compared without a change, and taken with one", "dolly", async (page) => {
  const text = await textOf(page);
  await page.getByLabel("Compare with").selectOption("c2");
  await page.waitForFunction(() => globalThis.studio.session.compared.value?.samples);
  assert.equal(await textOf(page), text);
  await picture(page, "compared");
  await page
    .locator("label", { hasText: /^Curve/ })
    .locator("select")
    .first()
    .selectOption("c4");
  await settle(page);
  assert.match(await textOf(page), /curve: c4/);
});

const bezier = (rig, move) => [
  rig,
  move
    .replace("curve: quintic      #", "curve: bezier       #")
    .replace("ends: rest          #", "#"),
];

on(
  "handles of bezier keys: drawn, dragged, and of another kind",
  "dolly",
  async (page) => {
    await page.locator(".curve-canvas").focus();
    for (let i = 0; i < 4; i++) await page.keyboard.press(".");
    await settle(page);
    const handle = await page.evaluate(() => {
      const target = globalThis.studio.session.scene.handles.find((each) => each.side === "right");
      const box = document.querySelector(".curve-canvas").getBoundingClientRect();
      return { x: box.left + target.x, y: box.top + target.y };
    });
    await drag(page, handle, 15, -25);
    assert.match(await textOf(page), /handles: (aligned|\[)|right: \[/);
    await picture(page, "handles");
    await page.getByLabel("Handles").selectOption("vector");
    await settle(page);
    assert.match(await textOf(page), /vector/);
  },
  { change: bezier },
);

on(
  "saving writes the file; a file that has changed meanwhile is not written over",
  "dolly",
  async (page, studio) => {
    await drag(page, await keyPoint(page, "dolly", 2), 10, 0);
    await page.getByRole("button", { name: "Save" }).click();
    await page.waitForFunction(() => !globalThis.studio.session.isDirty.value);
    assert.equal(readFileSync(studio.movePath, "utf8"), await textOf(page));
    await drag(page, await keyPoint(page, "dolly", 2), 10, 0);
    const other = `${readFileSync(studio.movePath, "utf8")}# of another\n`;
    writeFileSync(studio.movePath, other);
    await page.getByRole("button", { name: "Save" }).click();
    await page.getByRole("dialog", { name: "The file has changed" }).waitFor();
    assert.equal(readFileSync(studio.movePath, "utf8"), other);
    await picture(page, "conflict");
    await page.getByRole("button", { name: "Read the file again" }).click();
    await page.waitForFunction((wanted) => globalThis.studio.session.text.value === wanted, other);
  },
);

on(
  "by touch: a finger drags a key, two pinch",
  "dolly",
  async (page) => {
    const point = await keyPoint(page, "dolly", 3);
    const text = await textOf(page);
    const touch = await page.context().newCDPSession(page);
    const send = (type, ...points) =>
      touch.send("Input.dispatchTouchEvent", { type, touchPoints: points });
    await send("touchStart", point);
    for (let i = 1; i <= 6; i++)
      await send("touchMove", { x: point.x + 4 * i, y: point.y + 3 * i });
    await page.waitForTimeout(100);
    await send("touchEnd");
    await page.waitForFunction(() => globalThis.studio.session.dragged.value === null);
    await settle(page);
    assert.notEqual(await textOf(page), text);
    const span = () =>
      page.evaluate(
        () => globalThis.studio.session.view.value.to - globalThis.studio.session.view.value.from,
      );
    const before_ = await span();
    await send("touchStart", { x: 300, y: 220, id: 0 }, { x: 400, y: 220, id: 1 });
    await send("touchMove", { x: 250, y: 220, id: 0 }, { x: 450, y: 220, id: 1 });
    await send("touchEnd");
    await settle(page);
    assert.ok(Math.abs((await span()) / before_ - 0.5) < 0.05, `${await span()} of ${before_} s`);
  },
  { hasTouch: true },
);

on(
  "the first minutes: the tour leads through the page and is not shown again",
  "dolly",
  async (page) => {
    const tour = page.getByRole("dialog", { name: "Tour" });
    await tour.waitFor();
    await picture(page, "tour");
    for (let i = 0; i < 4; i++) await page.getByRole("button", { name: "Next" }).click();
    await page.getByRole("button", { name: "Begin" }).click();
    await page.reload();
    await page.waitForFunction(() => globalThis.studio?.session.axes.value.length > 0);
    assert.equal(await tour.count(), 0);
  },
  { isFirst: true },
);

// Where a key is in its row.
async function rowPoint(page, name, index) {
  await settle(page);
  return page.evaluate(
    ([row, at]) => {
      const { scene } = globalThis.studio.session;
      const key = scene.sheetKeys.find((each) => each.axis === row && each.key === at);
      const box = document.querySelector(".curve-canvas").getBoundingClientRect();
      return { x: box.left + key.x, y: box.top + key.y, line: key.at.line };
    },
    [name, index],
  );
}

on(
  "keys of poses and of the warp are dragged, in rows and as curves, and typed",
  "poses",
  async (page) => {
    const before = await textOf(page);
    const row = await rowPoint(page, "the warp", 2);
    assert.match(before.split("\n")[row.line - 1], /15 s, 12 s/);
    const hash = await hashOf(page);
    await drag(page, row, 30, 0);
    const later = (await textOf(page)).split("\n");
    assert.match(later[row.line - 1], /- \[15\.\d+ s, 12 s\]/);
    assert.deepEqual(
      later.filter((line, i) => line !== before.split("\n")[i]).length,
      1,
      "another line changed",
    );
    assert.notEqual(await hashOf(page), hash);
    // Its curve is in the pane of positions now, in s, and its keys go up and down.
    const key = await keyPoint(page, "the warp", 2);
    await drag(page, key, 0, -9);
    assert.match((await textOf(page)).split("\n")[row.line - 1], /- \[15\.\d+ s, 13(\.\d+)? s\]/);
    // A weight is in percent, exactly.
    const weight = await rowPoint(page, "pose close", 1);
    await page.mouse.click(weight.x, weight.y);
    await page.getByLabel("Weight").fill("80");
    await page.getByLabel("Weight").press("Enter");
    await settle(page);
    assert.match((await textOf(page)).split("\n")[weight.line - 1], /9 s, 80 %/);
    await picture(page, "poses");
    for (let i = 0; i < 3; i++) await page.getByRole("button", { name: "Undo" }).click();
    await settle(page);
    assert.equal(await textOf(page), before);
  },
);

// Where a point is on the screen, in the space view.
async function spacePoint(page, index) {
  await page.waitForFunction(() => (globalThis.studio.session.space?.places().length ?? 0) > 0);
  await page.waitForTimeout(300);
  return page.evaluate((at) => {
    const { space } = globalThis.studio.session;
    const box = space.canvas.getBoundingClientRect();
    const { x, y } = space.drag.screenOf(space.places()[at].at);
    return { x: box.left + x, y: box.top + y };
  }, index);
}

const pointOf = (page, index) =>
  page.evaluate((at) => globalThis.studio.session.points.value[at], index);

on(
  "points of a path are dragged over the ground and up, typed, and undone",
  "armrail",
  async (page) => {
    const [text, hash] = [await textOf(page), await hashOf(page)];
    await tab(page, "Space");
    await drag(page, await spacePoint(page, 1), 12, 5, {
      hold: async () => {
        await page.waitForFunction(
          (was) => globalThis.studio.session.report.value.hash !== was,
          hash,
        );
        await picture(page, "point-dragged");
      },
    });
    const moved = await pointOf(page, 1);
    assert.notDeepEqual(moved.at.slice(0, 2), [480, -200]);
    assert.equal(moved.at[2], 500);
    const after_ = await textOf(page);
    assert.deepEqual(changedLines(text, after_), [moved.line - 1]);
    assert.match(after_.split("\n")[moved.line - 1], /^ {4}- \[\d+ mm, -\d+ mm, 500 mm\]$/);
    assert.notEqual(await hashOf(page), hash);

    await page.keyboard.down("Shift");
    await drag(page, await spacePoint(page, 1), 0, -6);
    await page.keyboard.up("Shift");
    const raised = await pointOf(page, 1);
    assert.deepEqual(raised.at.slice(0, 2), moved.at.slice(0, 2));
    assert.ok(raised.at[2] > 500, `${raised.at[2]} mm`);

    const z = page.getByRole("textbox", { name: "Z" });
    await z.fill("0.51 m");
    await z.press("Enter");
    await settle(page);
    assert.equal((await pointOf(page, 1)).at[2], 510);
    assert.match((await textOf(page)).split("\n")[moved.line - 1], /, 0\.51 m\]$/);
    for (let i = 0; i < 3; i++) {
      await page.getByRole("button", { name: "Undo" }).click();
      await settle(page);
    }
    assert.equal(await textOf(page), text);
    assert.equal(await hashOf(page), hash);
  },
);

on("a key of a subject is chosen, moved in time and place, and called off", "jib", async (page) => {
  const [text, hash] = [await textOf(page), await hashOf(page)];
  await tab(page, "Space");
  await page.getByRole("combobox", { name: "Point" }).selectOption("Subject at 7 s");
  const time = page.getByRole("textbox", { name: "Time" });
  await time.fill("6.5");
  await time.press("Enter");
  await settle(page);
  const { line, t } = await pointOf(page, 1);
  assert.equal(t, 6.5);
  assert.match(
    (await textOf(page)).split("\n")[line - 1],
    /- \[6\.5 s, \[6 m, -0\.5 m, 1\.7 m\]\]/,
  );
  const edited = await textOf(page);
  await drag(page, await spacePoint(page, 1), 25, 3, { hold: () => page.keyboard.press("Escape") });
  assert.equal(await textOf(page), edited);
  await drag(page, await spacePoint(page, 1), 25, 3);
  assert.deepEqual(changedLines(edited, await textOf(page)), [line - 1]);
  assert.notEqual(await hashOf(page), hash);
  for (let i = 0; i < 2; i++) {
    await page.getByRole("button", { name: "Undo" }).click();
    await settle(page);
  }
  assert.equal(await textOf(page), text);
});
