// The document: its text, and the edits that undo and redo it, without end.
//
// An edit is { from, to, insert } in units of a JavaScript string; a list of them
// is ascending, does not overlap, and is about one and the same text.

// The text with these edits.
export function applyEdits(text, edits) {
  let result = "";
  let at = 0;
  for (const { from, to, insert } of edits) {
    if (from < at || to < from || to > text.length)
      throw new RangeError(`edit ${from} to ${to} does not fit a text of ${text.length}`);
    result += text.slice(at, from) + insert;
    at = to;
  }
  return result + text.slice(at);
}

// What takes applyEdits(text, edits) back to text.
export function invertEdits(text, edits) {
  let shift = 0;
  return edits.map(({ from, to, insert }) => {
    const start = from + shift;
    shift += insert.length - (to - from);
    return { from: start, to: start + insert.length, insert: text.slice(from, to) };
  });
}

// One edit that makes `after` of `before`, as short as their common ends allow.
export function differenceOf(before, after) {
  if (before === after) return [];
  const shorter = Math.min(before.length, after.length);
  let head = 0;
  while (head < shorter && before[head] === after[head]) head++;
  let tail = 0;
  while (
    tail < shorter - head &&
    before[before.length - 1 - tail] === after[after.length - 1 - tail]
  )
    tail++;
  const insert = after.slice(head, after.length - tail);
  return [{ from: head, to: before.length - tail, insert }];
}

// Every state is reached by edits from its neighbour, so that a long history of a
// long text takes no more memory than what was typed.
export class History {
  #past = [];
  #future = [];

  constructor(text) {
    this.text = text;
  }

  get canUndo() {
    return this.#past.length > 0;
  }

  get canRedo() {
    return this.#future.length > 0;
  }

  get undoLabel() {
    return this.#past.at(-1)?.label ?? "";
  }

  get redoLabel() {
    return this.#future.at(-1)?.label ?? "";
  }

  // What was done since is undone as one where both have the same `group`.
  apply(edits, label, group = null) {
    if (edits.length === 0) return;
    const text = applyEdits(this.text, edits);
    const last = this.#past.at(-1);
    this.#future = [];
    if (group !== null && last?.group === group) {
      const before = applyEdits(this.text, last.undo);
      last.redo = differenceOf(before, text);
      last.undo = invertEdits(before, last.redo);
    } else {
      this.#past.push({ label, group, redo: edits, undo: invertEdits(this.text, edits) });
    }
    this.text = text;
  }

  // The edits that were made, to be shown elsewhere; none where there is nothing.
  undo() {
    return this.#step(this.#past, this.#future, "undo");
  }

  redo() {
    return this.#step(this.#future, this.#past, "redo");
  }

  #step(source, target, direction) {
    const step = source.pop();
    if (step === undefined) return [];
    const edits = step[direction];
    target.push({ ...step, group: null });
    this.text = applyEdits(this.text, edits);
    return edits;
  }
}
