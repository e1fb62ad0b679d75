// Asks the planner's worker.  Of what follows the pointer only the latest counts:
// while one is under way, a newer one takes the place of the one that waits.

export class PlannerClient {
  #worker;
  #next = 1;
  #waiting = new Map();
  #latest = new Map(); // by kind: { busy, queued }

  constructor(worker) {
    this.#worker = worker;
    worker.onmessage = ({ data }) => {
      const resolve = this.#waiting.get(data.id);
      this.#waiting.delete(data.id);
      resolve?.(data);
    };
  }

  get isIdle() {
    return this.#waiting.size === 0;
  }

  ask(kind, members = {}) {
    const id = this.#next++;
    return new Promise((resolve) => {
      this.#waiting.set(id, resolve);
      this.#worker.postMessage({ id, kind, ...members });
    });
  }

  // As ask; null where a newer question of this kind took its place.
  askLatest(kind, members = {}) {
    const slot = this.#latest.get(kind) ?? { busy: false, queued: null };
    this.#latest.set(kind, slot);
    if (slot.busy) {
      slot.queued?.resolve(null);
      return new Promise((resolve) => {
        slot.queued = { members, resolve };
      });
    }
    slot.busy = true;
    return this.#run(kind, members, slot);
  }

  async #run(kind, members, slot) {
    const answer = await this.ask(kind, members);
    slot.busy = false;
    const { queued } = slot;
    slot.queued = null;
    if (queued !== null) {
      slot.busy = true;
      void this.#run(kind, queued.members, slot).then(queued.resolve);
    }
    return answer;
  }

  // What waits is not asked any more.
  drop(kind) {
    const slot = this.#latest.get(kind);
    slot?.queued?.resolve(null);
    if (slot) slot.queued = null;
  }
}
