import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { mock, test } from "node:test";
import { adviceFor, advices } from "../../../../firmware/studio/web/live/faults.js";
import { busLoad, readFrame } from "../../../../firmware/studio/web/live/frame.js";
import { Jog, againMs } from "../../../../firmware/studio/web/live/jog.js";
import { Link } from "../../../../firmware/studio/web/live/link.js";
import {
  Trail,
  columnsOf,
  takeFromCsv,
  takeToCsv,
} from "../../../../firmware/studio/web/live/trail.js";
import { Machine } from "../../../../firmware/studio/web/live/machine.js";
import { random } from "./random.mjs";

const q32 = (value) => BigInt(Math.round(value * 2 ** 20)) << 12n;

function frameBytes({ axes = 1, buses = 1, lines = 2, path = 1.5, state = 2 } = {}) {
  const buffer = new ArrayBuffer(88 + 104 * axes + 24 * buses + lines);
  const view = new DataView(buffer);
  view.setUint32(0, 0x31574c53, true);
  view.setUint16(4, axes, true);
  view.setUint8(6, buses);
  view.setUint8(7, lines);
  view.setUint32(8, 77, true);
  view.setBigUint64(16, 123456n, true);
  view.setBigInt64(24, 2_500_000_000n, true);
  view.setBigInt64(32, BigInt(path * 1e9) * 4096n, true);
  view.setBigInt64(48, 1n << 29n, true);
  view.setUint8(80, state);
  view.setUint8(81, 4 | 32);
  for (let i = 0; i < axes; i++) {
    const at = 88 + 104 * i;
    view.setBigInt64(at, q32(-12.5), true);
    view.setBigInt64(at + 8, q32(-13), true);
    view.setBigInt64(at + 24, q32(-12.25), true);
    view.setBigInt64(at + 72, q32(3), true);
    view.setInt32(at + 80, -250, true);
    view.setUint8(at + 89, 1 | 2 | 4 | 16);
  }
  for (let i = 0; i < buses; i++) view.setBigInt64(88 + 104 * axes + 24 * i, 4_000_000n, true);
  for (let i = 0; i < lines; i++) view.setInt8(88 + 104 * axes + 24 * buses + i, i === 0 ? 1 : -1);
  return buffer;
}

test("a frame says what was put into it", () => {
  const frame = readFrame(frameBytes());
  assert.equal(frame.state, "moving");
  assert.equal(frame.path, 1.5);
  assert.equal(frame.rate, 0.5);
  assert.deepEqual([frame.jogging, frame.homing, frame.real], [true, false, true]);
  const [axis] = frame.axes;
  assert.deepEqual([axis.demand.last, axis.demand.low, axis.actual.last], [-12.5, -13, -12.25]);
  assert.deepEqual([axis.velocity, axis.torque, axis.statusword, axis.homed], [3, -25, null, true]);
  assert.deepEqual([axis.switches.low, axis.switches.high], [true, false]);
  assert.deepEqual(frame.lines, [1, -1]);
});

test("what is not a whole frame is none, whatever it is", () => {
  const draw = random(5);
  const whole = frameBytes({ axes: 3 });
  for (let i = 0; i < 500; i++) {
    const length = draw.below(whole.byteLength + 40);
    const bytes = new Uint8Array(length);
    bytes.set(new Uint8Array(whole).subarray(0, Math.min(length, whole.byteLength)));
    for (let n = 0; n < 3; n++) if (length > 0) bytes[draw.below(length)] = draw.below(256);
    const frame = readFrame(bytes.buffer);
    if (frame !== null)
      assert.equal(
        length,
        88 + 104 * frame.axes.length + 24 * frame.buses.length + frame.lines.length,
      );
  }
  assert.equal(readFrame(new ArrayBuffer(0)), null);
});

test("a bus's load is its busy time by the time between frames", () => {
  const before = readFrame(frameBytes());
  const after = {
    ...before,
    time: before.time + 0.02,
    buses: [{ ...before.buses[0], busyNs: 9_000_000 }],
  };
  assert.ok(Math.abs(busLoad(before, after, 0) - 0.25) < 1e-9);
  assert.equal(busLoad(before, before, 0), null);
  assert.equal(busLoad(before, after, 3), null);
});

// --- a jog

function jogOf() {
  const sent = [];
  const clock = {
    call: null,
    every: (ms, call) => ((clock.ms = ms), (clock.call = call), 1),
    end: () => (clock.call = null),
  };
  let answer = { ok: true };
  const ends = [];
  const jog = new Jog(
    (command, members) => (sent.push([command, members]), Promise.resolve(answer)),
    (why) => ends.push(why),
    clock,
  );
  return { jog, sent, clock, ends, refuse: (text) => (answer = { ok: false, text }) };
}

test("a jog is sent again while held, for longer than it takes to be sent again", () => {
  const { jog, sent, clock } = jogOf();
  jog.press("pan", -5);
  clock.call();
  clock.call();
  assert.deepEqual(sent, Array(3).fill(["jog", { axis: "pan", speed: -5, for: 0.25 }]));
  assert.equal(clock.ms, againMs);
  assert.ok(clock.ms < 250);
});

test("release ends it once, and nothing is sent after it", () => {
  const { jog, sent, clock, ends } = jogOf();
  jog.press("pan", 5);
  jog.release();
  jog.release();
  assert.deepEqual(
    sent.map(([command]) => command),
    ["jog", "jog stop"],
  );
  assert.equal(clock.call, null);
  assert.deepEqual(ends, [""]);
});

test("a refusal ends it with its reason", async () => {
  const { jog, clock, ends, refuse } = jogOf();
  refuse("another client has control");
  jog.press("pan", 5);
  await Promise.resolve();
  await Promise.resolve();
  assert.equal(jog.isHeld, false);
  assert.equal(clock.call, null);
  assert.deepEqual(ends, ["another client has control"]);
});

test("a second press while one is held does nothing", () => {
  const { jog, sent } = jogOf();
  jog.press("pan", 5);
  jog.press("tilt", 5);
  assert.deepEqual(
    sent.map(([, members]) => members.axis),
    ["pan"],
  );
});

// --- the connection

class FakeSocket {
  static all = [];
  constructor(url, protocol) {
    Object.assign(this, { url, protocol, readyState: 0, sent: [] });
    FakeSocket.all.push(this);
  }
  opened() {
    this.readyState = 1;
    this.onopen();
  }
  send(text) {
    this.sent.push(JSON.parse(text));
  }
  close() {
    this.readyState = 3;
    this.onclose?.();
  }
}

function linkOf() {
  mock.timers.reset();
  const apis = ["setTimeout"];
  const isOld = process.versions.node.startsWith("18."); // which takes the list itself
  mock.timers.enable(isOld ? apis : { apis });
  FakeSocket.all = [];
  const heard = { states: [], events: [], frames: [] };
  const on = {
    state: (state) => heard.states.push(state),
    event: (event) => heard.events.push(event),
    frame: (frame) => heard.frames.push(frame),
  };
  const link = new Link("ws://127.0.0.1/ws", on, FakeSocket);
  link.open();
  return { link, heard, socket: () => FakeSocket.all.at(-1) };
}

test("answers find their questions, whatever their order", async () => {
  const { link, socket } = linkOf();
  socket().opened();
  const first = link.ask("hold");
  const second = link.ask("status");
  const [a, b] = socket().sent;
  socket().onmessage({ data: JSON.stringify({ id: b.id, ok: true, held: false }) });
  socket().onmessage({ data: JSON.stringify({ id: a.id, ok: false, text: "no" }) });
  assert.equal((await second).held, false);
  assert.equal((await first).text, "no");
});

test("a broken connection fails what was asked, asks nothing again, and comes back", async () => {
  const { link, heard, socket } = linkOf();
  socket().opened();
  const asked = link.ask("start");
  socket().close();
  assert.equal((await asked).error, "LINK");
  assert.equal(heard.states.at(-1), "closed");
  mock.timers.tick(250);
  assert.equal(FakeSocket.all.length, 2);
  socket().opened();
  assert.deepEqual(socket().sent, []);
  assert.equal(heard.states.at(-1), "open");
});

test("silence makes what is shown old, and the next frame makes it new", () => {
  const { heard, socket } = linkOf();
  socket().opened();
  for (let i = 0; i < 3; i++) mock.timers.tick(125);
  assert.equal(heard.states.at(-1), "open");
  mock.timers.tick(125);
  assert.equal(heard.states.at(-1), "silent");
  socket().onmessage({ data: frameBytes() });
  assert.equal(heard.states.at(-1), "open");
  assert.equal(heard.frames.length, 1);
});

test("what is no JSON, no answer and no frame is passed over", () => {
  const { heard, socket } = linkOf();
  socket().opened();
  for (const data of ["{", "{}", '{"id": 99, "ok": true}', new ArrayBuffer(3)])
    socket().onmessage({ data });
  assert.deepEqual([heard.events, heard.frames], [[], []]);
});

test("without a connection a question is answered at once", async () => {
  const { link } = linkOf();
  assert.equal((await link.ask("stop")).ok, false);
  mock.timers.reset();
});

// --- takes

test("a take is what was played, from its first frame to its last", () => {
  const trail = new Trail();
  const frame = readFrame(frameBytes());
  for (let i = 0; i < 10; i++) trail.add({ ...frame, time: i, path: i }, i >= 3 && i < 8);
  assert.equal(trail.takes.length, 1);
  const [take] = trail.takes;
  assert.deepEqual(
    take.rows.map((row) => row.time),
    [3, 4, 5, 6, 7, 8],
  );
  const [x, demand, actual] = columnsOf(take.rows, 0, (row) => row.path);
  assert.deepEqual([x[0], demand[0], actual[0]], [3, -12.5, -12.25]);
  const csv = takeToCsv(take, ["pan"]).trim().split("\n");
  assert.equal(csv[0], "t_s,path_s,pan_demand,pan_actual,pan_error");
  assert.equal(csv.length, 7);
  const again = takeFromCsv(`${csv.join("\n")}\n`, ["pan"]);
  assert.equal(again.rows.length, 6);
  assert.ok(Math.abs(again.worst[0] - take.worst[0]) < 1e-6);
  for (const wrong of ["", csv[0], `${csv.join("\n")}\n1,x`, csv.slice(1).join("\n")])
    assert.equal(takeFromCsv(wrong, ["pan"]), null);
  assert.equal(takeFromCsv(csv.join("\n"), ["tilt"]), null);
});

test("a recording of slew run --telemetry is a take, from where the move begins", () => {
  const head =
    "t_ns,phase,state,path_ns,pan.demand_deg,pan.demand_deg_s,pan.actual_deg,pan.actual_deg_s,pan.following_deg,pan.statusword";
  const lines = [`0,approach,moving,0,9,0,9,0,5,39`];
  for (let i = 0; i < 1000; i++)
    lines.push(
      `${(i + 1) * 1000000},move,moving,${i * 1000000},${i / 100},0,${i / 100 - 0.25},0,${i === 500 ? -0.75 : 0.25},39`,
    );
  const take = takeFromCsv(`${[head, ...lines].join("\n")}\n`, ["pan"]);
  assert.ok(take.rows.length > 55 && take.rows.length < 62, `${take.rows.length} rows`);
  assert.deepEqual(take.worst, [0.75]);
  const last = take.rows.at(-1);
  assert.deepEqual([last.path, last.axes[0].demand], [0.999, 9.99]);
  assert.equal(take.rows[0].axes[0].error, 0.25);
  assert.equal(takeFromCsv([head, ...lines].join("\n"), ["pan", "tilt"]), null);
  assert.equal(takeFromCsv(head, ["pan"]), null);
});

test("the ring forgets, takes do not grow without end", () => {
  const trail = new Trail();
  const frame = readFrame(frameBytes({ axes: 1, buses: 0, lines: 0 }));
  for (let i = 0; i < 12000; i++) trail.add({ ...frame, time: i }, i % 100 < 50);
  assert.ok(trail.rows.length <= 9000);
  assert.ok(trail.takes.length <= 8);
});

test("every fault of the controller has its advice, and there are no others", () => {
  const source = readFileSync("firmware/control/controller.h", "utf8");
  const codes = [...source.matchAll(/X\(CONTROLLER_FAULT_(\w+),/g)].map(([, code]) => code);
  assert.ok(codes.length > 10);
  assert.deepEqual(Object.keys(advices).sort(), codes.filter((code) => code !== "NONE").sort());
  assert.match(adviceFor("ESTOP"), /Release/);
});

test("a warning of an axis is said on the page", () => {
  const said = [];
  let socket;
  class Socket {
    constructor() {
      socket = this;
    }
    send() {}
    close() {}
  }
  const machine = new Machine(
    "ws://machine",
    (text, isError) => said.push([text, isError]),
    Socket,
  );
  machine.start();
  const event = { event: "warning", axis: "pan", code: "following_error", text: "pan: close" };
  socket.onmessage({ data: JSON.stringify(event) });
  machine.end();
  assert.deepEqual(said, [["Warning: pan: close", true]]);
});
