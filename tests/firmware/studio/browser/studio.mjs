// Starts `slew studio` on a copy of an example, and a page of it in Chromium.
import { spawn } from "node:child_process";
import { cpSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { chromium } from "playwright-core";
import { slowly } from "../slowly.mjs";
import { cookieOf, linkOf, remember } from "../websocket.mjs";

const slew = process.env.SLEW ?? "build/slew";
export const pictures = process.env.STUDIO_PICTURES ?? "build/studio/pictures";

const browserArguments = [
  "--no-sandbox",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader",
  // Frames are put together without a graphics processor: SwiftShader in the place of one takes
  // four fifths of a test's time.  make bench-studio measures a browser that has one.
  ...(process.env.BENCH ? [] : ["--disable-gpu-compositing"]),
];

function freePort() {
  return new Promise((resolve) => {
    const server = createServer().listen(0, "127.0.0.1", () => {
      const { port } = server.address();
      server.close(() => resolve(port));
    });
  });
}

async function answers(port, child) {
  let said = "";
  child.stdout.on("data", (data) => (said += data));
  for (let i = 0; i < 400; i++) {
    if (child.exitCode !== null) throw new Error(`slew studio ended with ${child.exitCode}`);
    if (said.includes("socket ")) return remember(said);
    await new Promise((resolve) => setTimeout(resolve, 25));
  }
  throw new Error("slew studio does not answer");
}

// Beside a browser that draws on the processor: ten are a tenth of a second.
export const TICK_MS = 10;

// A rig and a move in a directory of their own, served.  `change` may write them anew
// before: (rig text, move text) => [rig text, move text]; with `tickMs` the rig has
// this tick instead of its own.
export async function serve(example, change = (rig, move) => [rig, move], tickMs = 0) {
  const directory = mkdtempSync(join(tmpdir(), "studio-"));
  cpSync(join("examples", example), directory, { recursive: true });
  const paths = ["rig.yaml", "move.yaml"].map((name) => join(directory, name));
  const texts = change(...paths.map((path) => readFileSync(path, "utf8")));
  if (tickMs) texts[0] = slowly(texts[0], tickMs);
  paths.forEach((path, i) => writeFileSync(path, texts[i]));
  const port = await freePort();
  const arguments_ = ["studio", directory, "--port", String(port), "--no-browser"];
  const environment = { ...process.env, SLEW_RUN_DIR: directory };
  const child = spawn(slew, arguments_, {
    stdio: ["ignore", "pipe", "inherit"],
    env: environment,
  });
  await answers(port, child);
  return {
    url: linkOf(port),
    get: (path) => fetch(`http://127.0.0.1:${port}${path}`, { headers: cookieOf(port) }),
    child,
    directory,
    movePath: paths[1],
    async end() {
      const ended = new Promise((resolve) => child.once("exit", resolve));
      child.kill("SIGTERM");
      await ended;
      rmSync(directory, { recursive: true, force: true });
    },
  };
}

export function launch() {
  return chromium.launch({ executablePath: "/usr/bin/chromium", args: browserArguments });
}

// A page with the move planned and the tour away.  What the page says on its
// console as an error is an error of the test.
export async function open(browser, url, { isFirst = false, viewport, ...more } = {}) {
  const context = await browser.newContext({
    viewport: viewport ?? { width: 1280, height: 800 },
    ...more,
  });
  const page = await context.newPage();
  const errors = [];
  page.on("pageerror", (error) => errors.push(error.stack ?? String(error)));
  page.on("console", (message) => {
    if (message.type() === "error" && /Content Security|Uncaught/.test(message.text()))
      errors.push(message.text());
  });
  page.errors = errors;
  if (!isFirst)
    await page.addInitScript(() =>
      localStorage.setItem("slew.studio", JSON.stringify({ hasToured: true })),
    );
  await page.goto(url);
  await page.waitForFunction(() => globalThis.studio?.session.axes.value.length > 0);
  await settle(page);
  return page;
}

// Until everything that was asked of the planner is answered and drawn.
export function settle(page) {
  return page.evaluate(async () => {
    const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
    for (let quiet = 0; quiet < 3; quiet++) {
      await frame();
      if (!globalThis.studio.planner.isIdle) quiet = 0;
    }
  });
}

export function picture(page, name) {
  mkdirSync(pictures, { recursive: true });
  return page.screenshot({ path: join(pictures, `${name}.png`) });
}

export function tab(page, name) {
  return page.getByRole("tab", { name, exact: true }).click();
}

export function textOf(page) {
  return page.evaluate(() => globalThis.studio.session.text.value);
}

export function hashOf(page) {
  return page.evaluate(() => globalThis.studio.session.report.value.hash);
}

// Where a key is on the screen, in the pane of positions.
export async function keyPoint(page, axis, key) {
  await settle(page);
  return page.evaluate(
    ([name, index]) => {
      const target = globalThis.studio.session.scene.keys.find(
        (each) => each.axis === name && each.key === index,
      );
      const box = document.querySelector(".curve-canvas").getBoundingClientRect();
      return { x: box.left + target.x, y: box.top + target.y };
    },
    [axis, key],
  );
}

// Presses at a point, goes by (dx, dy) in steps, and lets go.
export async function drag(page, from, dx, dy, { steps = 8, hold = null } = {}) {
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
  for (let i = 1; i <= steps; i++) {
    await page.mouse.move(from.x + (dx * i) / steps, from.y + (dy * i) / steps);
    await page.waitForTimeout(16);
  }
  if (hold) await hold();
  await page.mouse.up();
  await page.waitForFunction(() => globalThis.studio.session.dragged.value === null);
  await settle(page);
}

export async function until(page, what, test, argument, timeout = 15000) {
  try {
    await page.waitForFunction(test, argument, { timeout });
  } catch {
    const state = await page.evaluate(() => ({
      state: globalThis.studio.machine.state.value,
      link: globalThis.studio.machine.linkState.value,
      notice: globalThis.studio.session.notice.value,
      fault: globalThis.studio.machine.fault.value,
    }));
    throw new Error(`${what}: not within ${timeout} ms; ${JSON.stringify(state)}`);
  }
}
