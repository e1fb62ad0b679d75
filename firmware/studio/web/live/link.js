// The connection to the service: commands with numbers, events, frames.  It comes
// back by itself, and what it says is old the moment it is gone.
//
// Nothing that was asked before a connection broke is asked again after it: a
// command that was not answered has failed.
import { readFrame } from "./frame.js";

const answerMs = 5000; // planning takes longer: asked with a time of its own
const lookMs = 125;
const silentLooks = 4; // without a frame for so many, what is shown is old
const retryMs = [250, 500, 1000, 2000, 4000];

export class Link {
  #url;
  #socket = null;
  #next = 1;
  #waiting = new Map();
  #tries = 0;
  #retry = null;
  #watch = null;
  #looks = 0; // since the last word
  #WebSocket;

  // on: { frame(frame), event(object), state("open" | "silent" | "closed") }
  constructor(url, on, WebSocketClass = globalThis.WebSocket) {
    this.#url = url;
    this.#WebSocket = WebSocketClass;
    this.on = on;
    this.state = "closed";
  }

  open() {
    const socket = new this.#WebSocket(this.#url, "slew");
    socket.binaryType = "arraybuffer";
    this.#socket = socket;
    socket.onopen = () => {
      this.#tries = 0;
      this.#heard();
    };
    socket.onmessage = ({ data }) => {
      this.#heard();
      if (typeof data === "string") this.#line(data);
      else this.#frame(data);
    };
    socket.onclose = () => this.#closed(socket);
  }

  close() {
    clearTimeout(this.#retry);
    this.#retry = null;
    const socket = this.#socket;
    this.#socket = null;
    socket?.close();
    this.#fail("the page closed the connection");
    this.#say("closed");
  }

  // The answer, also one that says no; never an exception.
  ask(command, members = {}, withinMs = answerMs) {
    const id = this.#next++;
    if (this.#socket?.readyState !== 1)
      return Promise.resolve({ ok: false, error: "LINK", text: "there is no connection to slew" });
    return new Promise((resolve) => {
      const timer = setTimeout(
        () => this.#answer(id, { ok: false, error: "LINK", text: "slew did not answer" }),
        withinMs,
      );
      this.#waiting.set(id, { resolve, timer });
      this.#socket.send(JSON.stringify({ id, command, ...members }));
    });
  }

  #say(state) {
    if (this.state === state) return;
    this.state = state;
    this.on.state(state);
  }

  #heard() {
    this.#looks = 0;
    this.#watch ??= setTimeout(() => this.#look(), lookMs);
    this.#say("open");
  }

  // Now and then, which costs less than a timer that is set again at every word.
  #look() {
    const isSilent = ++this.#looks === silentLooks;
    this.#watch = isSilent ? null : setTimeout(() => this.#look(), lookMs);
    if (isSilent) this.#say("silent");
  }

  #frame(data) {
    const frame = readFrame(data);
    if (frame !== null) this.on.frame(frame);
  }

  #line(text) {
    let object;
    try {
      object = JSON.parse(text);
    } catch {
      return;
    }
    if (typeof object.event === "string") this.on.event(object);
    else this.#answer(object.id, object);
  }

  #answer(id, object) {
    const waiting = this.#waiting.get(id);
    if (waiting === undefined) return;
    this.#waiting.delete(id);
    clearTimeout(waiting.timer);
    waiting.resolve(object);
  }

  #fail(text) {
    for (const id of [...this.#waiting.keys()])
      this.#answer(id, { ok: false, error: "LINK", text });
  }

  #closed(socket) {
    if (this.#socket !== socket) return;
    this.#socket = null;
    clearTimeout(this.#watch);
    this.#watch = null;
    this.#fail("the connection to slew broke");
    this.#say("closed");
    const wait = retryMs[Math.min(this.#tries++, retryMs.length - 1)];
    this.#retry = setTimeout(() => this.open(), wait);
  }
}
