import assert from "node:assert/strict";
import { test } from "node:test";
import {
  History,
  applyEdits,
  differenceOf,
  invertEdits,
} from "../../../../firmware/studio/web/model/history.js";
import { random } from "./random.mjs";

function randomEdits(draw, text) {
  const edits = [];
  let at = 0;
  for (let i = draw.below(4); i >= 0; i--) {
    const from = at + draw.below(text.length - at + 1);
    const to = from + draw.below(Math.min(text.length - from, 5) + 1);
    edits.push({ from, to, insert: "abcdef\n".slice(0, draw.below(7)) });
    at = to;
  }
  return edits;
}

test("an inverted list of edits takes back exactly what was done", () => {
  const draw = random(1);
  for (let i = 0; i < 2000; i++) {
    const text = "keys: [[0 s, 1 mm], [2 s, 3 mm]]  # note\n".repeat(1 + draw.below(3));
    const edits = randomEdits(draw, text);
    assert.equal(applyEdits(applyEdits(text, edits), invertEdits(text, edits)), text);
  }
});

test("undo without end goes back to the first text, redo to the last", () => {
  const draw = random(2);
  const history = new History("first text of some length");
  const texts = [history.text];
  for (let i = 0; i < 500; i++) {
    history.apply(randomEdits(draw, history.text), `step ${i}`);
    if (history.text.length < 10)
      history.apply([{ from: 0, to: 0, insert: "more of the text" }], "more");
    texts.push(history.text);
  }
  while (history.canUndo) history.undo();
  assert.equal(history.text, texts[0]);
  while (history.canRedo) history.redo();
  assert.equal(history.text, texts.at(-1));
});

test("steps of one group are undone as one, and not with a step of another", () => {
  const history = new History("p: 0");
  for (const value of ["1", "2", "3"])
    history.apply([{ from: 3, to: 4, insert: value }], "Nudge", "nudge");
  history.apply([{ from: 3, to: 4, insert: "9" }], "Set");
  history.undo();
  assert.equal(history.text, "p: 3");
  assert.equal(history.undoLabel, "Nudge");
  history.undo();
  assert.equal(history.text, "p: 0");
  assert.equal(history.canUndo, false);
});

test("what is done after an undo cannot be joined with what was undone", () => {
  const history = new History("0");
  history.apply([{ from: 0, to: 1, insert: "1" }], "Nudge", "nudge");
  history.undo();
  history.redo();
  history.apply([{ from: 0, to: 1, insert: "2" }], "Nudge", "nudge");
  history.undo();
  assert.equal(history.text, "1");
});

test("an edit outside the text is refused", () => {
  assert.throws(() => applyEdits("abc", [{ from: 2, to: 5, insert: "" }]), RangeError);
  assert.throws(
    () =>
      applyEdits("abc", [
        { from: 2, to: 3, insert: "" },
        { from: 1, to: 2, insert: "" },
      ]),
    RangeError,
  );
});

test("the difference of two texts is short and leads from one to the other", () => {
  const before = "a: 1 # one\nb: 2\n";
  const after = "a: 1 # one\nb: 27\n";
  const edits = differenceOf(before, after);
  assert.deepEqual(edits, [{ from: 15, to: 15, insert: "7" }]);
  assert.equal(applyEdits(before, edits), after);
  assert.deepEqual(differenceOf(before, before), []);
  assert.equal(applyEdits("aaa", differenceOf("aaa", "aa")), "aa");
});
