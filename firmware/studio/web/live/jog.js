// A jog that lasts as long as a button is held.
//
// While it is held the command is sent again and again for a short time ahead
// (the dead man's), so that the axis stops when this page, its machine or the
// line between dies.  It ends for good on release, lost focus, a hidden page, a
// refusal, or a connection that broke: to go on, the button is pressed again.

export const againMs = 100;
export const aheadSeconds = 0.25;

export class Jog {
  #timer = null;
  #ask;
  #clock;

  // ask(command, members) as Link.ask; clock: { every(ms, call), end(timer) }
  constructor(ask, onEnd, clock = ownClock) {
    this.#ask = ask;
    this.#clock = clock;
    this.onEnd = onEnd;
  }

  get isHeld() {
    return this.#timer !== null;
  }

  press(axis, speed) {
    if (this.isHeld) return;
    const send = async () => {
      const answer = await this.#ask("jog", { axis, speed, for: aheadSeconds });
      if (!answer.ok && this.isHeld) this.release(answer.text ?? "");
    };
    this.#timer = this.#clock.every(againMs, send);
    void send();
  }

  // `why` is empty where nothing went wrong.
  release(why = "") {
    if (!this.isHeld) return;
    this.#clock.end(this.#timer);
    this.#timer = null;
    void this.#ask("jog stop", {});
    this.onEnd(why);
  }
}

const ownClock = {
  every: (ms, call) => setInterval(call, ms),
  end: (timer) => clearInterval(timer),
};
