// The machine behind the service, as signals, and what can be asked of it.
import { batch, computed, signal } from "../vendor/ui.js";
import { busLoad } from "./frame.js";
import { Jog } from "./jog.js";
import { Link } from "./link.js";
import { Trail, takeFromCsv, takeToCsv } from "./trail.js";

const leaseSeconds = 5;
const renewMs = 1500;
const statusMs = 500;
const mostTakeBytes = 256 * 2 ** 20;
const loadSeconds = 0.5; // over which a bus load is measured
const loadMs = 120_000; // planning a long move takes as long as it takes

function planWords({ doing, what, share, seconds }) {
  const part = share === undefined ? "" : ` ${Math.round(100 * share)} %`;
  return `The machine is ${doing || "reading"} ${what}${part}, ${seconds.toFixed(0)} s. Stop gives it up.`;
}

function isPlaying(frame) {
  const moves = ["moving", "holding", "stopping"].includes(frame.state);
  return moves && !frame.jogging && !frame.homing && frame.path > 0 && frame.path < frame.end;
}

export class Machine {
  #before = null; // a frame of half a second ago, for bus loads
  #timers = [];
  #isLoading = false; // the machine plans what this page has sent

  constructor(url, say, WebSocketClass) {
    this.say = say;
    this.trail = new Trail();
    this.link = new Link(
      url,
      {
        frame: (frame) => this.#frame(frame),
        event: (event) => this.#event(event),
        state: (state) => this.#linked(state),
      },
      WebSocketClass,
    );
    this.linkState = signal("closed");
    this.hello = signal(null);
    this.frame = signal(null);
    this.status = signal(null);
    this.fault = signal("");
    this.faultCode = signal("");
    this.loads = signal([]); // of buses, 0 to 1
    this.isHolder = signal(false);
    this.isHeld = signal(false); // by whomever
    this.loaded = signal(null); // the text that is the machine's move, if it is ours
    this.takes = signal([]); // of this page, and those that were read from disk
    this.kept = signal([]); // names of those on disk
    this.jogging = signal(null); // name of the axis that this page jogs
    this.loop = signal(false);
    this.pingPong = signal(false);
    this.heardAt = signal(0);
    this.isFresh = computed(() => this.linkState.value === "open" && this.frame.value !== null);
    // What most panels need of a frame, so that they do not follow every one.
    this.state = computed(() => this.frame.value?.state ?? "unknown");
    this.isJogging = computed(() => this.frame.value?.jogging ?? false);
    this.isHoming = computed(() => this.frame.value?.homing ?? false);
    this.isReal = computed(() => this.frame.value?.real ?? this.hello.value?.real);
    this.percent = computed(() => Math.round(100 * (this.frame.value?.override ?? 1)));
    this.machineAt = computed(() => {
      const frame = this.frame.value;
      return this.isFresh.value && frame !== null && isPlaying(frame) ? frame.path : null;
    });
    this.jog = new Jog(
      (command, members) => this.ask(command, members),
      (why) => {
        this.jogging.value = null;
        if (why) this.say(`The jog ended: ${why}`, true);
      },
    );
  }

  start() {
    this.link.open();
    this.#timers = [
      setInterval(() => this.isHolder.value && void this.ask("renew"), renewMs),
      setInterval(() => this.linkState.value === "open" && void this.#askStatus(), statusMs),
    ];
  }

  end() {
    this.#timers.forEach(clearInterval);
    this.jog.release();
    this.link.close();
  }

  async ask(command, members = {}, withinMs = undefined) {
    const answer = await this.link.ask(command, members, withinMs);
    if (!answer.ok && answer.error === "CONTROL") this.isHolder.value = false;
    return answer;
  }

  // As ask, and what is refused is said.
  async order(command, members, withinMs) {
    const answer = await this.ask(command, members, withinMs);
    if (!answer.ok) this.say(`${command}: ${answer.text ?? answer.error}`, true);
    return answer;
  }

  // Works for whoever looks, and is never asked about.  Gives up what is being planned, too.
  stop() {
    this.jog.release();
    const stopped = this.order("stop");
    if (this.#isLoading) void this.ask("cancel");
    return stopped;
  }

  async take() {
    const answer = await this.order("take", { lease: leaseSeconds });
    this.isHolder.value = answer.ok;
  }

  async release() {
    this.jog.release();
    const answer = await this.order("release");
    if (answer.ok) this.isHolder.value = false;
  }

  async load(text) {
    this.#isLoading = true;
    const answer = await this.order("load", { text }, loadMs);
    this.#isLoading = false;
    if (answer.ok) {
      this.loaded.value = text;
      this.say(
        `The machine has the move now: ${answer.title ?? ""} ${Number(answer.duration ?? 0).toFixed(2)} s`,
      );
    }
    return answer.ok;
  }

  play() {
    return this.order("start", { times: this.loop.value ? 0 : 1, ping_pong: this.pingPong.value });
  }

  pressJog(axis, speed) {
    this.jogging.value = axis;
    this.jog.press(axis, speed);
  }

  get axisNames() {
    return (this.hello.value?.axes ?? []).map((axis) => axis.name);
  }

  async listTakes() {
    const answer = await fetch("/api/takes").catch(() => null);
    if (answer?.ok) this.kept.value = (await answer.json()).takes.map((take) => take.name);
  }

  // Beside the move, by when it was.
  async keepTake(take) {
    const name = `${new Date(take.started).toISOString().replace(/[:.]/g, "-")}.csv`;
    const body = takeToCsv(take, this.axisNames);
    const answer = await fetch(`/api/take?name=${name}`, { method: "PUT", body }).catch(() => null);
    if (answer?.status === 204 || answer?.status === 412) take.name = name;
    else this.say("The take could not be written.", true);
    await this.listTakes();
  }

  // One of disk among those of this page, before them: they are compared by age.
  async readTake(name) {
    if (this.takes.value.some((take) => take.name === name)) return;
    const answer = await fetch(`/api/take?name=${name}`).catch(() => null);
    this.#addTake(name, answer?.ok ? await answer.text() : "");
  }

  // A file of this computer: a take, or what slew run --telemetry has written.
  async openTake(file) {
    if (file.size > mostTakeBytes)
      this.say(`${file.name} is larger than 256 MiB, expected a shorter recording.`, true);
    else this.#addTake(file.name, await file.text());
  }

  #addTake(name, text) {
    const take = takeFromCsv(text, this.axisNames);
    if (take === null) {
      this.say(
        `${name} is no recording of the axes of this rig, expected CSV of a take or of slew run --telemetry.`,
        true,
      );
      return;
    }
    this.trail.takes.unshift({ ...take, name });
    this.takes.value = [...this.trail.takes];
  }

  // Positions of all axes where the machine stands, or null.
  async capture() {
    const answer = await this.order("capture");
    return answer.ok ? answer.axes : null;
  }

  #linked(state) {
    batch(() => {
      this.linkState.value = state;
      if (state === "open") return;
      this.jog.release(state === "closed" ? "the connection is gone" : "slew is silent");
      if (state === "closed") {
        this.isHolder.value = false;
        this.#before = null;
      }
    });
  }

  #frame(frame) {
    batch(() => {
      this.#before ??= frame;
      if (frame.time - this.#before.time >= loadSeconds) {
        this.loads.value = frame.buses.map((_, i) => busLoad(this.#before, frame, i));
        this.#before = frame;
      }
      this.frame.value = frame;
      this.heardAt.value = Date.now();
      if (frame.state !== "fault") this.fault.value = "";
      const playing = isPlaying(frame);
      const wasTaking = this.trail.isTaking;
      this.trail.add(frame, playing);
      if (wasTaking && !this.trail.isTaking) this.takes.value = [...this.trail.takes];
    });
  }

  #event(event) {
    if (event.event === "hello") this.hello.value = event;
    if (event.event === "fault")
      batch(() => {
        this.fault.value = event.text;
        this.faultCode.value = event.code;
      });
    if (event.event === "control") {
      this.isHeld.value = event.held;
      if (!event.held && this.isHolder.value) {
        this.isHolder.value = false;
        this.say(`Control is given up: ${event.why}`, event.why !== "released");
      }
    }
    if (event.event === "plan" && this.#isLoading) this.say(planWords(event));
    if (event.event === "homing")
      this.say(event.done ? "Homed." : `Homing failed: ${event.text}`, !event.done);
    if (["warning", "drive", "bus"].includes(event.event)) this.say(`Warning: ${event.text}`, true);
    if (event.event === "ticks lost")
      this.say(
        event.count === 1
          ? "1 tick was lost since the start"
          : `${event.count} ticks were lost since the start`,
        true,
      );
  }

  async #askStatus() {
    const answer = await this.link.ask("status");
    if (!answer.ok) return;
    batch(() => {
      this.status.value = answer;
      this.isHeld.value = answer.held;
      this.isHolder.value = answer.holder;
      this.fault.value = answer.fault ?? "";
      this.faultCode.value = answer.fault_code ?? "";
    });
  }
}

// Where every axis of the move stands, in its order; null where that is not known.
export function standsOf(axes, frame, hello) {
  const from = axes.map((axis) => {
    const at = hello.axes.findIndex((each) => each.name === axis.name);
    const seen = frame.axes[at];
    return seen?.known ? seen.actual.last : NaN;
  });
  return from.some(Number.isNaN) ? null : from;
}

// What the buttons may do now; the service says no as well.
export function allowed(state, { isHolder, isFresh, jogging, homing }) {
  const rests = isHolder && isFresh && !jogging && !homing;
  return {
    enable: rests && state === "off",
    off: isHolder && isFresh && ["ready", "holding"].includes(state),
    reset: rests && state === "fault",
    home: rests && state === "ready",
    load: rests && ["off", "ready"].includes(state),
    approach: rests && state === "ready",
    start: rests && state === "ready",
    go: rests && ["ready", "holding"].includes(state),
    hold: isHolder && isFresh && state === "moving" && !jogging && !homing,
    resume: isHolder && isFresh && state === "holding",
    jog: isHolder && isFresh && state === "ready",
    capture: isHolder && isFresh && state !== "unknown",
    override: isHolder && isFresh,
  };
}
