// tests/firmware/studio/websocket.mjs - a WebSocket for tests: also one that does
// not read, and one that comes from elsewhere.
import { randomBytes } from "node:crypto";
import { EventEmitter } from "node:events";
import http from "node:http";

// The token of each server that has printed its link, by its port.
const tokens = new Map();

export function remember(said) {
  for (const [, port, token] of said.matchAll(/:(\d+)\/\?token=([\w-]+)/g))
    tokens.set(Number(port), token);
}

export const linkOf = (port) => `http://127.0.0.1:${port}/?token=${tokens.get(port)}`;
export const cookieOf = (port) => ({ Cookie: `slew-${port}=${tokens.get(port)}` });

export class Socket extends EventEmitter {
  #raw;
  #bytes = Buffer.alloc(0);
  // How it has ended: the code of the close frame, or "reset" where there was none.
  end = null;
  isGone = false; // the wire itself has ended

  static open(port, { path = "/ws", headers = {} } = {}) {
    return new Promise((resolve, reject) => {
      const request = http.request({
        port,
        host: "127.0.0.1",
        path,
        headers: {
          Connection: "Upgrade",
          Upgrade: "websocket",
          "Sec-WebSocket-Version": "13",
          "Sec-WebSocket-Key": randomBytes(16).toString("base64"),
          "Sec-WebSocket-Protocol": "slew",
          Origin: `http://127.0.0.1:${port}`,
          ...cookieOf(port),
          ...headers,
        },
      });
      request.on("upgrade", (answer, raw, head) => resolve(new Socket(raw, head)));
      request.on("response", (answer) => {
        answer.resume();
        reject(new Error(`${answer.statusCode}`));
      });
      request.on("error", reject);
      request.end();
    });
  }

  constructor(raw, head) {
    super();
    this.#raw = raw;
    raw.on("data", (data) => this.#take(data));
    raw.on("close", () => this.#gone());
    raw.on("error", () => {});
    if (head.length > 0) setImmediate(() => this.#take(head));
  }

  #gone() {
    this.isGone = true;
    this.end ??= "reset";
    this.emit("gone");
  }

  #take(data) {
    this.#bytes = Buffer.concat([this.#bytes, data]);
    for (;;) {
      const b = this.#bytes;
      if (b.length < 2) return;
      let [length, at] = [b[1] & 127, 2];
      if (length === 126) [length, at] = [b.length < 4 ? Infinity : b.readUInt16BE(2), 4];
      else if (length === 127)
        [length, at] = [b.length < 10 ? Infinity : Number(b.readBigUInt64BE(2)), 10];
      if (b.length < at + length) return;
      const payload = b.subarray(at, at + length);
      this.#bytes = b.subarray(at + length);
      const op = b[0] & 15;
      if (op === 1) this.emit("line", JSON.parse(payload.toString()));
      if (op === 2) this.emit("frame", payload);
      if (op === 8) {
        this.end ??= payload.length >= 2 ? payload.readUInt16BE(0) : 1005;
        this.emit("closed", this.end);
      }
    }
  }

  send(text, opcode = 1) {
    const payload = Buffer.from(text);
    const mask = randomBytes(4);
    const head = Buffer.alloc(payload.length < 126 ? 2 : payload.length < 65536 ? 4 : 10);
    head[0] = 128 | opcode;
    if (payload.length < 126) head[1] = 128 | payload.length;
    else if (payload.length < 65536) {
      head[1] = 254;
      head.writeUInt16BE(payload.length, 2);
    } else {
      head[1] = 255;
      head.writeBigUInt64BE(BigInt(payload.length), 2);
    }
    for (let i = 0; i < payload.length; i++) payload[i] ^= mask[i % 4];
    this.#raw.write(Buffer.concat([head, mask, payload]));
  }

  pause() {
    this.#raw.pause();
  }

  resume() {
    this.#raw.resume();
  }

  // The wire is cut: no close frame.
  cut() {
    this.#raw.destroy();
  }
}
