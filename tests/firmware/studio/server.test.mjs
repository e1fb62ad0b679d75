// tests/firmware/studio/server.test.mjs - slew studio as a browser meets it: its
// files, its WebSocket, and what goes wrong.  SLEW: the program.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import fs from "node:fs";
import http from "node:http";
import os from "node:os";
import path from "node:path";
import { after, before, test } from "node:test";
import { setTimeout as sleep } from "node:timers/promises";
import { slowly } from "./slowly.mjs";
import { Socket, cookieOf, linkOf, remember } from "./websocket.mjs";

const slew = process.env.SLEW ?? "build/slew";
const port = 20000 + (process.pid % 10000);
const home = fs.mkdtempSync(path.join(os.tmpdir(), "studio-"));
const TICK_MS = 4; // ten are 40 ms
const HEAD = 88;
const AXIS = 104;
let child;
let said = "";

before(async () => {
  fs.cpSync("examples/dolly", `${home}/dolly`, { recursive: true });
  const rig = `${home}/dolly/rig.yaml`;
  fs.writeFileSync(rig, slowly(fs.readFileSync(rig, "utf8"), TICK_MS));
  fs.mkdirSync(`${home}/run`);
  child = spawn(slew, ["studio", "--no-browser", "--port", `${port}`, `${home}/dolly`], {
    env: { ...process.env, SLEW_RUN_DIR: `${home}/run` },
  });
  child.stdout.on("data", (data) => (said += data));
  child.stderr.on("data", (data) => (said += data));
  for (let i = 0; i < 200 && !said.includes("socket "); i++) await sleep(50);
  assert.match(said, /socket /, said);
  remember(said);
});

after(async () => {
  child.kill("SIGTERM");
  const code = await new Promise((resolve) => child.on("exit", resolve));
  fs.rmSync(home, { recursive: true });
  assert.equal(code, 0, said);
});

function ask(method, where, { headers = {}, body } = {}) {
  return new Promise((resolve, reject) => {
    const request = http.request(
      { port, host: "127.0.0.1", method, path: where, headers: { ...cookieOf(port), ...headers } },
      (answer) => {
        const parts = [];
        answer.on("data", (part) => parts.push(part));
        answer.on("end", () =>
          resolve({
            status: answer.statusCode,
            headers: answer.headers,
            text: Buffer.concat(parts).toString(),
          }),
        );
      },
    );
    request.on("error", reject);
    request.end(body);
  });
}

// The answer to a command, by its id.
let ids = 0;
function command(socket, name, members = {}) {
  const id = ++ids;
  return new Promise((resolve, reject) => {
    const timer = setTimeout(() => reject(new Error(`${name}: no answer`)), 10000);
    const look = (line) => {
      if (line.id !== id) return;
      clearTimeout(timer);
      socket.off("line", look);
      resolve(line);
    };
    socket.on("line", look);
    socket.send(JSON.stringify({ id, command: name, ...members }));
  });
}

async function until(what, look, ms = 20000) {
  for (const start = Date.now(); Date.now() - start < ms; ) {
    const found = await look();
    if (found) return found;
    await sleep(20);
  }
  throw new Error(`${what}: not within ${ms} ms; the program said: ${said.slice(-1000)}`);
}

const frameOf = (b) => ({
  number: b.readUInt32LE(8),
  ticks: b.readUInt32LE(12),
  tick: b.readBigUInt64LE(16),
  lost: b.readUInt32LE(64),
  state: b[80],
  bits: b[81],
  joined: b.readUInt32LE(84),
  axes: Array.from({ length: b.readUInt16LE(4) }, (_, i) => {
    const at = HEAD + AXIS * i;
    const range = (k) => ({
      last: b.readBigInt64LE(at + 24 * k),
      low: b.readBigInt64LE(at + 24 * k + 8),
      high: b.readBigInt64LE(at + 24 * k + 16),
    });
    return { demand: range(0), actual: range(1), velocity: b.readBigInt64LE(at + 72) };
  }),
});

// No tick is in two frames or in none, but for those that the machine lost.
function allTicks(frames) {
  for (let i = 1; i < frames.length; i++) {
    const [a, b] = [frames[i - 1], frames[i]];
    assert.equal(b.number, a.number + 1);
    assert.equal(Number(b.tick - a.tick), b.ticks + b.lost - a.lost);
  }
}

test("the page comes with a policy, packed or not, and is not sent twice", async () => {
  const plain = await ask("GET", "/");
  assert.equal(plain.status, 200);
  assert.match(plain.text, /<!doctype html>/);
  assert.match(plain.headers["content-security-policy"], /default-src 'none'/);
  const packed = await ask("GET", "/planner.mjs", { headers: { "accept-encoding": "gzip" } });
  assert.equal(packed.headers["content-encoding"], "gzip");
  const again = await ask("GET", "/", { headers: { "if-none-match": plain.headers.etag } });
  assert.equal(again.status, 304);
});

test("without the token of the link there is nothing, on loopback too", async () => {
  assert.match(said, /http:\/\/127\.0\.0\.1:\d+\/\?token=[\w-]{43}\n/);
  const routes = ["/", "/index.html", "/planner.mjs", "/api/studio", "/api/rig", "/api/move"];
  routes.push("/api/takes", "/api/take?name=a.csv", `/api/file?name=${home}/dolly/rig.yaml`);
  routes.push("/?token=", "/?token=x", "/?token=" + "A".repeat(43), "/none");
  const wrong = [{}, { Cookie: "" }, { Cookie: `slew-${port}=` }];
  wrong.push({ Cookie: cookieOf(port).Cookie.replace(`slew-${port}`, "slew") });
  wrong.push({ Cookie: `${cookieOf(port).Cookie}x` });
  for (const cookie of wrong) {
    const headers = { Cookie: "none", ...cookie };
    for (const route of routes) {
      const answer = await ask("GET", route, { headers });
      assert.equal(answer.status, 401, route);
      assert.match(answer.text, /a token is expected/);
    }
    for (const route of ["/api/rig", "/api/move", "/api/take?name=x.csv"])
      assert.equal((await ask("PUT", route, { headers, body: "x" })).status, 401, route);
    await assert.rejects(Socket.open(port, { headers }), /401/);
  }
  // Nor is one let in that asks for another protocol, or for none.
  for (const cookie of [...wrong, cookieOf(port)])
    for (const protocol of ["http", "none", ""]) {
      const headers = { Cookie: "none", ...cookie, "Sec-WebSocket-Protocol": protocol };
      await assert.rejects(Socket.open(port, { headers }), protocol);
    }
});

test("the link sets a cookie that no script sees, and leads to the page", async () => {
  const { pathname, search } = new URL(linkOf(port));
  const answer = await ask("GET", pathname + search, { headers: { Cookie: "none" } });
  assert.equal(answer.status, 303);
  assert.equal(answer.headers.location, "/");
  assert.equal(answer.headers["referrer-policy"], "no-referrer");
  const [cookie] = answer.headers["set-cookie"];
  assert.match(cookie, new RegExp(`^slew-${port}=[\\w-]{43}; HttpOnly; SameSite=Lax; Path=/$`));
  const headers = { Cookie: cookie.split(";")[0] };
  assert.equal((await ask("GET", "/", { headers })).status, 200);
});

test("the rig's file is not written unless that was asked for", async () => {
  const file = `${home}/dolly/rig.yaml`;
  const was = await ask("GET", "/api/rig");
  const headers = { "if-match": was.headers.etag };
  const put = await ask("PUT", "/api/rig", { headers, body: "axes: {}" });
  assert.equal(put.status, 403);
  assert.match(put.text, /--edit-rig/);
  assert.equal(fs.readFileSync(file, "utf8"), was.text);
  assert.equal(JSON.parse((await ask("GET", "/api/studio")).text).edits_rig, false);
  fs.cpSync("examples/dolly", `${home}/edited`, { recursive: true });
  const words = ["studio", "--no-browser", "--edit-rig", "--port", `${port + 5}`, `${home}/edited`];
  const program = await another(words, "socket ");
  const own = cookieOf(port + 5);
  const url = `http://127.0.0.1:${port + 5}/api/rig`;
  const read = await fetch(url, { headers: own });
  const body = `${await read.text()}# edited\n`;
  const etag = read.headers.get("etag");
  const answer = await fetch(url, { method: "PUT", headers: { ...own, "if-match": etag }, body });
  assert.equal(answer.status, 204);
  assert.equal(fs.readFileSync(`${home}/edited/rig.yaml`, "utf8"), body);
  await end(program);
});

test("another Host and another Origin are refused, also for the socket", async () => {
  assert.equal((await ask("GET", "/", { headers: { host: "evil.example" } })).status, 421);
  const headers = { origin: "http://evil.example" };
  assert.equal((await ask("GET", "/api/move", { headers })).status, 403);
  assert.equal((await ask("PUT", "/api/move", { headers, body: "x" })).status, 403);
  await assert.rejects(Socket.open(port, { headers: { Origin: "http://evil.example" } }));
  await assert.rejects(Socket.open(port, { headers: { Host: "evil.example" } }));
});

test("a move is written over what was read, and over nothing else", async () => {
  const file = `${home}/dolly/move.yaml`;
  const was = await ask("GET", "/api/move");
  assert.equal(was.text, fs.readFileSync(file, "utf8"));
  const body = `${was.text}# edited\n`;
  assert.equal((await ask("PUT", "/api/move", { body })).status, 428);
  const headers = { "if-match": was.headers.etag };
  const put = await ask("PUT", "/api/move", { headers, body });
  assert.equal(put.status, 204);
  assert.equal(fs.readFileSync(file, "utf8"), body);
  fs.appendFileSync(file, "# by another\n");
  const refused = await ask("PUT", "/api/move", {
    headers: { "if-match": put.headers.etag },
    body: "lost",
  });
  assert.equal(refused.status, 412);
  assert.equal(fs.readFileSync(file, "utf8"), `${body}# by another\n`);
  assert.equal(refused.headers.etag, (await ask("GET", "/api/move")).headers.etag);
  assert.deepEqual(
    fs.readdirSync(`${home}/dolly`).filter((name) => name.endsWith(".partial")),
    [],
  );
});

test("a file beside the rig is given, and no other", async () => {
  const rig = `${home}/dolly/rig.yaml`;
  const name = (text) => `/api/file?name=${encodeURIComponent(text)}`;
  assert.equal((await ask("GET", name(rig))).status, 200);
  for (const other of ["/etc/passwd", `${home}/dolly/../../x.yaml`, `${home}/dolly/.x.yaml`])
    assert.equal((await ask("GET", name(other))).status, 404);
});

test("takes are kept beside the move, each once, and listed", async () => {
  const take = (name) => `/api/take?name=${encodeURIComponent(name)}`;
  const list = async () => JSON.parse((await ask("GET", "/api/takes")).text).takes;
  assert.deepEqual(await list(), []);
  const put = (name, body) => ask("PUT", take(name), { body });
  assert.equal((await put("b.csv", "second\n")).status, 204);
  assert.equal((await put("a-1_2.csv", "first\n")).status, 204);
  assert.equal((await put("b.csv", "another\n")).status, 412);
  assert.deepEqual(await list(), [
    { name: "a-1_2.csv", bytes: 6 },
    { name: "b.csv", bytes: 7 },
  ]);
  assert.equal((await ask("GET", take("b.csv"))).text, "second\n");
  assert.equal(fs.readFileSync(`${home}/dolly/takes/b.csv`, "utf8"), "second\n");
  for (const name of ["../move.yaml", "x.yaml", ".csv", "a/b.csv", `${"x".repeat(70)}.csv`]) {
    assert.equal((await put(name, "x")).status, 404, name);
    assert.equal((await ask("GET", take(name))).status, 404, name);
  }
});

test("what is too long is refused before it is read", async () => {
  const headers = { "if-match": '"x"', "content-length": 17 * 1024 * 1024 };
  const answer = await ask("PUT", "/api/move", { headers, body: "x" });
  assert.equal(answer.status, 413);
});

test("a browser is a client: hello, commands, one lease, frames at 60 Hz", async () => {
  const one = await Socket.open(port);
  const [hello] = await new Promise((resolve) => one.once("line", (line) => resolve([line])));
  assert.equal(hello.event, "hello");
  const two = await Socket.open(port);
  assert.equal((await command(one, "take", { lease: 30 })).ok, true);
  assert.equal((await command(two, "enable")).error, "CONTROL");
  const frames = [];
  one.on("frame", (frame) => frames.push(frameOf(frame)));
  await until("frames", () => frames.length > 40);
  const last = frames.at(-1);
  const ticks = Number(last.tick - frames[0].tick) / (frames.length - 1);
  assert.ok(ticks * TICK_MS >= 12, `a frame every ${ticks} ticks of ${TICK_MS} ms`);
  assert.equal(last.axes.length, hello.axes.length);
  allTicks(frames);
  assert.equal((await command(one, "enable")).ok, true);
  await until("torque", () => (frames.at(-1).state === 1 && !(frames.at(-1).bits & 1)));
  assert.equal((await command(one, "home")).ok, true);
  await until("homed", async () =>
    (await command(two, "status")).axes.every((axis) => axis.homed),
  );
  await until("ready", () => frames.at(-1).state === 1 && !(frames.at(-1).bits & 2));
  const from = frames.length;
  const jog = { axis: hello.axes[0].name, speed: 20, for: 0.25 };
  assert.equal((await command(one, "jog", jog)).ok, true);
  await until("moved", () => frames.slice(from).some((f) => f.axes[0].velocity !== 0n));
  await until("rest", () => frames.at(-1).state === 1);
  const moved = frames.slice(from);
  assert.ok(moved.every((f) => f.axes.every((a) => a.actual.low <= a.actual.high)));
  one.cut();
  two.cut();
});

test("the wire is cut while jogging: the axis stands before the time that it was given", async () => {
  const watch = await Socket.open(port);
  const driver = await Socket.open(port);
  const frames = [];
  watch.on("frame", (frame) => frames.push(frameOf(frame)));
  await until("free", async () => (await command(driver, "take", { lease: 30 })).ok);
  await until("torque", async () => {
    await command(driver, "enable");
    return frames.at(-1)?.state === 1;
  });
  const { axes } = await command(driver, "hello");
  const jog = { axis: axes[0].name, speed: 20, for: 2 };
  assert.equal((await command(driver, "jog", jog)).ok, true);
  await until("moves", () => frames.at(-1).axes[0].velocity !== 0n);
  const cut = frames.at(-1);
  driver.cut();
  await until("stands", () => frames.at(-1).state === 1);
  const rest = frames.find((f) => f.tick > cut.tick && f.state === 1);
  const ticks = Number(rest.tick - cut.tick) - (rest.lost - cut.lost);
  assert.ok(ticks < 1500, `it stood after ${ticks} ticks of 1 ms`);
  watch.cut();
});

test("a flood is cut off, and so is what is no line of JSON", async () => {
  const flood = await Socket.open(port);
  for (let i = 0; i < 2000; i++) flood.send('{"command": "hello"}');
  await until("the flood is cut off", () => flood.end !== null);
  assert.equal(flood.end, 1008);
  const large = await Socket.open(port);
  large.send("x".repeat(300000));
  await until("the large is cut off", () => large.end !== null);
  assert.equal(large.end, 1009);
  const binary = await Socket.open(port);
  binary.send("x", 2);
  await until("the binary is cut off", () => binary.end !== null);
  assert.equal(binary.end, 1003);
  for (const socket of [flood, binary]) socket.cut();
  // Whoever does not close is read no longer, and neither is one that goes on.
  const endless = await Socket.open(port);
  for (let i = 0; i < 16; i++) endless.send("x".repeat(300000));
  await Promise.all(
    [large, endless].map((socket) => until("the wire has ended", () => socket.isGone)),
  );
});

test("a reader that sleeps holds nobody up, and misses no tick", async () => {
  const slow = await Socket.open(port);
  const quick = await Socket.open(port);
  const frames = [];
  let last = null;
  let quicks = 0;
  quick.on("frame", (frame) => ((last = frameOf(frame)), quicks++));
  slow.on("frame", (frame) => frames.push(frameOf(frame)));
  await until("frames", () => frames.length > 5);
  slow.pause();
  for (let i = 0; i < 100; i++) slow.send('{"command": "status"}'), await sleep(10);
  const before = quicks;
  await until("another reader is not held up", () => quicks > before + 20);
  slow.resume();
  await until("again", () => frames.at(-1).tick >= last.tick);
  allTicks(frames);
  for (const socket of [slow, quick]) socket.cut();
});

test("17 browsers: one more than there is room for is refused", async () => {
  const sockets = [];
  for (let i = 0; i < 16; i++) sockets.push(await Socket.open(port));
  const gone = await Socket.open(port).then(
    (socket) => new Promise((resolve) => socket.on("gone", () => resolve(true))),
    () => true,
  );
  assert.equal(gone, true);
  for (const socket of sockets) socket.cut();
  await sleep(200);
  const again = await Socket.open(port);
  assert.equal((await command(again, "hello")).ok, true);
  again.cut();
});

// A program of its own beside the first: its process, once it has said `sign`.
async function another(words, sign, environment = {}) {
  const program = spawn(slew, words, {
    env: { ...process.env, SLEW_RUN_DIR: `${home}/run`, ...environment },
  });
  let text = "";
  program.stdout.on("data", (data) => (text += data));
  program.stderr.on("data", (data) => (text += data));
  await until(sign, () => text.includes(sign) || program.exitCode !== null, 60000);
  assert.equal(program.exitCode, null, text);
  remember(text);
  return program;
}

async function end(program) {
  const ended = new Promise((resolve) => program.on("exit", resolve));
  program.kill("SIGTERM");
  assert.equal(await ended, 0);
}

const from = async (where, route) =>
  (await fetch(`http://127.0.0.1:${where}${route}`, { headers: cookieOf(where) })).text();

test("the service serves the page too, to clients of the same lease", async () => {
  fs.cpSync("examples/dolly", `${home}/served`, { recursive: true });
  const words = ["service", "run", "--sim", "--port", `${port + 1}`, `${home}/served`];
  const program = await another(words, "socket ");
  assert.match(await from(port + 1, "/"), /<!doctype html>/);
  assert.equal(JSON.parse(await from(port + 1, "/api/studio")).move, `${home}/served/move.yaml`);
  const socket = await Socket.open(port + 1);
  assert.equal((await command(socket, "take", { lease: 30 })).ok, true);
  assert.equal((await command(socket, "status")).holder, true);
  socket.cut();
  await end(program);
});

test("without a rig it is an example, whose files stay the user's", async () => {
  const words = ["studio", "--no-browser", "--port", `${port + 2}`];
  const data = { XDG_DATA_HOME: `${home}/data` };
  const example = fs.readFileSync("examples/dolly/move.yaml", "utf8");
  const first = await another(words, "socket ", data);
  assert.equal(await from(port + 2, "/api/move"), example);
  await end(first);
  fs.appendFileSync(`${home}/data/slew/example/move.yaml`, "# mine\n");
  const second = await another(words, "socket ", data);
  assert.equal(await from(port + 2, "/api/move"), `${example}# mine\n`);
  await end(second);
});

// Ticks are long, so that a busy machine loses none that count.
const lift = (at) => `title: Lift
tick: 20 ms
buses:
  line: {kind: modbus-tcp, host: 127.0.0.1, port: ${at}, timeout: 2 s}
axes:
  lift:
    unit: rev
    limits: {position: [-500 rev, 500 rev], velocity: 600 rpm, acceleration: 30 rev/s2}
    following_error: {floor: 5 rev, time: 1 s}
    drive: {kind: modbus, bus: line, node: 3, map: lexium-32, counts: {num: 16384, den: 1}}
    sim: {velocity: 100 rev/s, acceleration: 5000 rev/s2}
`;

test("with --real the page moves a servo behind a socket of another process", async () => {
  const rig = `${home}/lift.yaml`;
  fs.writeFileSync(rig, lift(port + 4));
  const servo = await another(["sim", rig], `port ${port + 4}`);
  const words = ["studio", "--real", "--yes", "--no-browser", "--port", `${port + 3}`, rig];
  const program = await another(words, "socket ");
  const socket = await Socket.open(port + 3);
  const frames = [];
  socket.on("frame", (frame) => frames.push(frameOf(frame)));
  await until("a real machine", () => frames.at(-1)?.bits & 32);
  assert.equal((await command(socket, "take", { lease: 60 })).ok, true);
  // A machine that does other work may lose ticks, which is a fault: again then.
  const step = { 0: ["enable"], 1: ["jog", { axis: "lift", speed: 2, for: 1 }], 5: ["reset"] };
  const quarterTurn = 1n << 30n;
  await until(
    "moved",
    async () => {
      const { state, bits, axes } = frames.at(-1);
      if (step[state] && !(bits & 1)) await command(socket, ...step[state]);
      return axes[0].actual.last > quarterTurn;
    },
    60000,
  );
  await until(
    "no torque",
    async () => {
      if (frames.at(-1).state === 1) await command(socket, "off");
      return frames.at(-1).state === 0 || frames.at(-1).state === 5;
    },
    60000,
  );
  socket.cut();
  await end(program);
  servo.kill("SIGKILL");
});

test("a token of a file is nobody else's to read", async () => {
  const token = "abcdefghijklmnopqrst";
  fs.writeFileSync(`${home}/token`, `${token}\n`, { mode: 0o644 });
  const words = ["studio", "--no-browser", "--port", `${port + 6}`, "--address", "0.0.0.0"];
  words.push("--token-file", `${home}/token`, `${home}/dolly`);
  const refused = (() => {
    try {
      execFileSync(slew, words, { stdio: "pipe" });
    } catch (failed) {
      return failed;
    }
    return null;
  })();
  assert.equal(refused?.status, 2);
  assert.match(refused.stderr.toString(), /others can read .* expected chmod 600/);
  fs.chmodSync(`${home}/token`, 0o600);
  const program = await another(["studio", "--socket", `${home}/run/other`, ...words.slice(1)], "socket ");
  assert.equal(linkOf(port + 6), `http://127.0.0.1:${port + 6}/?token=${token}`);
  assert.match(await from(port + 6, "/"), /<!doctype html>/);
  assert.equal((await fetch(`http://127.0.0.1:${port + 6}/`)).status, 401);
  await end(program);
});
