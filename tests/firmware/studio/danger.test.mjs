// tests/firmware/studio/danger.test.mjs - what may go wrong beside a tick, judged by
// what the machine itself records.  SLEW: the program.
//
// A tick that waited for anybody would be late.  How late it was says nothing on a
// machine that does other work, but the system counts how often a thread gave the
// processor away by itself: the tick sleeps until its time, once a tick, and whoever
// makes it wait makes it sleep again.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import fs from "node:fs";
import net from "node:net";
import os from "node:os";
import path from "node:path";
import readline from "node:readline";
import { after, before, test } from "node:test";
import { setTimeout as sleep } from "node:timers/promises";
import { Socket, remember } from "./websocket.mjs";

const slew = process.env.SLEW ?? "build/slew";
const port = 10000 + (process.pid % 10000); // below what connections are given
const home = fs.mkdtempSync(path.join(os.tmpdir(), "danger-"));
const deadMan = 0.25; // s
let helper;
let answers;
let tick; // /proc of its thread
let service; // its own socket, which no page is in the way of

async function until(what, look) {
  for (const start = Date.now(); Date.now() - start < 60000; await sleep(20)) {
    const found = await look();
    if (found) return found;
  }
  throw new Error(`${what}: not within a minute`);
}

async function tell(line) {
  helper.stdin.write(`${line}\n`);
  const { value } = await answers.next();
  assert.equal(value, line.split(" ")[0]);
}

// Answers by id; events and streams are passed over.
class Lines {
  #waiting = new Map();
  #ids = 0;

  constructor(send, source) {
    this.send = send;
    source.on("line", (line) => {
      const object = typeof line === "string" ? JSON.parse(line) : line;
      this.#waiting.get(object.id)?.(object);
      this.#waiting.delete(object.id);
    });
  }

  ask(command, members = {}) {
    const id = ++this.#ids;
    this.send(JSON.stringify({ id, command, ...members }));
    return new Promise((resolve) => this.#waiting.set(id, resolve));
  }
}

const page = (socket) => new Lines((text) => socket.send(text), socket);

// null: it has ended meanwhile.
function nameOf(thread) {
  try {
    return fs.readFileSync(`${thread}/comm`, "utf8");
  } catch {
    return null;
  }
}

before(async () => {
  fs.cpSync("examples/dolly", `${home}/dolly`, { recursive: true });
  const words = [slew, "studio", "--no-browser", "--port", `${port}`, `${home}/dolly`];
  helper = spawn("python3", ["-B", "tests/firmware/studio/hold_thread.py", ...words], {
    env: { ...process.env, SLEW_RUN_DIR: home },
  });
  answers = readline.createInterface({ input: helper.stdout })[Symbol.asyncIterator]();
  let said = "";
  helper.stderr.on("data", (data) => (said += data));
  const [, id] = (await answers.next()).value.split(" ");
  const name = await until("a socket", () => /socket (\S+)/.exec(said)?.[1]);
  remember(said);
  const file = net.connect(name);
  service = new Lines(
    (text) => file.write(`${text}\n`),
    readline.createInterface({ input: file }),
  );
  tick = await until("the thread of the tick", () =>
    fs
      .readdirSync(`/proc/${id}/task`)
      .map((thread) => `/proc/${id}/task/${thread}`)
      .find((thread) => nameOf(thread) === "slew-tick\n"),
  );
});

after(async () => {
  const ended = once(helper, "exit");
  helper.stdin.end();
  const [code] = await ended;
  fs.rmSync(home, { recursive: true });
  assert.equal(code, 0);
});

const sleeps = () =>
  Number(/^voluntary_ctxt_switches:\s+(\d+)/m.exec(fs.readFileSync(`${tick}/status`, "utf8"))[1]);

// Runs what is dangerous; meanwhile the tick sleeps once a tick at most.
async function undisturbed(danger) {
  const from = (await service.ask("status")).tick.ticks; // a few more on either side
  const first = sleeps();
  await danger();
  const last = sleeps();
  const to = (await service.ask("status")).tick.ticks;
  assert.ok(last - first > 0, "the tick went on");
  assert.ok(last - first <= to - from + 2, `${last - first} sleeps in ${to - from} ticks`);
}

async function standing() {
  const { state, axes } = await service.ask("status");
  return state === "ready" && axes.every((axis) => axis.velocity === 0);
}

async function moving() {
  const { jogging, axes } = await service.ask("status");
  return jogging && axes[0].velocity !== 0;
}

// A page that has control of a machine with torque.
async function driver() {
  const socket = await Socket.open(port);
  const lines = page(socket);
  await until("control", async () => (await lines.ask("take", { lease: 60 })).ok);
  await until("torque", async () => {
    await lines.ask("enable");
    return standing();
  });
  return { socket, lines };
}

const jog = { axis: "dolly", speed: 20, for: deadMan };

// As a held button does; says no more once one was refused.
function hold(lines) {
  const held = { refused: null, timer: null };
  const send = async () => {
    const answer = await lines.ask("jog", jog);
    if (!answer.ok) held.refused ??= answer.error;
  };
  held.timer = setInterval(send, 100);
  void send();
  return held;
}

test("the server stands still while a page jogs: the axis stands, and does not go on", async () => {
  const { socket, lines } = await driver();
  await undisturbed(async () => {
    const held = hold(lines);
    await until("moves", moving);
    await tell("hold slew-page");
    await until("stands", standing);
    const { axes } = await service.ask("status");
    await sleep(2000); // the button is still held
    clearInterval(held.timer);
    await tell("let");
    await until("refused", () => held.refused);
    assert.equal(held.refused, "LATE");
    assert.ok(await standing());
    const now = (await service.ask("status")).axes[0].demand;
    assert.equal(now, axes[0].demand, "nothing has moved by itself");
  });
  socket.cut();
});

test("the socket dies while a page jogs: the axis stands within the dead man's time", async () => {
  const { socket, lines } = await driver();
  const frames = [];
  const watch = await Socket.open(port);
  watch.on("frame", (frame) => {
    // Those that were run, which a busy machine may leave out.
    const tick = Number(frame.readBigUInt64LE(16)) - frame.readUInt32LE(64);
    frames.push({ tick, jogs: (frame[81] & 4) !== 0 });
  });
  let taken; // a tick after the one that took the last jog
  await undisturbed(async () => {
    await until("a jog that is seen", async () => {
      await lines.ask("jog", jog);
      return frames.at(-1)?.jogs;
    });
    const { tick } = await service.ask("status");
    taken = tick.ticks - tick.ticks_lost;
    socket.cut();
    await until("stands", standing);
    await until("its frame", () => frames.at(-1).tick > taken && !frames.at(-1).jogs);
  });
  // At a tick of 1 ms: the dead man's time, and from its speed to rest.
  const last = frames.findLast((frame) => frame.jogs).tick;
  assert.ok(last <= taken + 1000 * (deadMan + 0.25), `${last - taken} ticks`);
  watch.cut();
});

test("a flood and a reader that sleeps are nothing to the tick", async () => {
  const slow = await Socket.open(port);
  const flood = await Socket.open(port);
  await undisturbed(async () => {
    slow.pause();
    for (let i = 0; i < 2000; i++) flood.send('{"command": "status"}');
    await until("the flood is cut off", () => flood.end !== null);
    for (let i = 0; i < 50; i++) slow.send('{"command": "status"}'), await sleep(10);
  });
  for (const socket of [slow, flood]) socket.cut();
});
