// The text of the move, which is the document; what is wrong stands at its line.
import {
  Decoration,
  EditorState,
  EditorView,
  HighlightStyle,
  StateEffect,
  StateField,
  Transaction,
  bracketMatching,
  defaultKeymap,
  drawSelection,
  highlightActiveLine,
  highlightActiveLineGutter,
  indentOnInput,
  indentWithTab,
  keymap,
  lineNumbers,
  lintGutter,
  setDiagnostics,
  syntaxHighlighting,
  tags,
  yaml,
} from "../vendor/text.js";
import { effect, html, useEffect, useRef } from "../vendor/ui.js";
import { differenceOf } from "../model/history.js";

const colours = HighlightStyle.define([
  { tag: tags.comment, color: "var(--quiet)" },
  { tag: [tags.definition(tags.propertyName), tags.propertyName], color: "var(--accent)" },
]);

const markLines = StateEffect.define();
const marked = StateField.define({
  create: () => Decoration.none,
  update(marks, transaction) {
    for (const each of transaction.effects)
      if (each.is(markLines))
        return Decoration.set(
          each.value
            .filter((line) => line >= 1 && line <= transaction.state.doc.lines)
            .map((line) =>
              Decoration.line({ class: "picked-line" }).range(
                transaction.state.doc.line(line).from,
              ),
            ),
        );
    return marks.map(transaction.changes);
  },
  provide: (field) => EditorView.decorations.from(field),
});

function diagnosticsOf(session, doc) {
  const place = (line, column, text, severity) => {
    if (!(line >= 1 && line <= doc.lines)) return null;
    const at = doc.line(line);
    const from = Math.min(at.from + Math.max((column ?? 1) - 1, 0), at.to);
    return { from, to: at.to, severity, message: text };
  };
  const report = session.report.value;
  const name = session.studio.value?.move;
  return [
    ...(report?.messages ?? [])
      .filter((each) => !each.file || !name || each.file === name || each.file.endsWith(`/${name}`))
      .map((each) =>
        place(each.line, each.column, each.text, each.kind === "error" ? "error" : "warning"),
      ),
    ...(session.isBroken.value ? [] : session.violations.value).map((each) =>
      place(each.line, each.column, each.what ?? each.kind, "warning"),
    ),
  ]
    .filter((each) => each !== null)
    .sort((a, b) => a.from - b.from);
}

// What is typed without a pause is undone as one.
const pauseMs = 1000;
let typing = { group: 0, at: 0 };

function typingGroup() {
  const at = performance.now();
  typing = { group: typing.group + (at - typing.at > pauseMs ? 1 : 0), at };
  return `typing ${typing.group}`;
}

function extensionsOf(session) {
  const ours = keymap.of([
    { key: "Mod-z", run: () => (void session.undo(), true) },
    { key: "Mod-Shift-z", run: () => (void session.redo(), true) },
    { key: "Mod-y", run: () => (void session.redo(), true) },
    { key: "Mod-s", run: () => (void session.save(), true) },
  ]);
  const typed = EditorView.updateListener.of((update) => {
    if (
      !update.docChanged ||
      update.transactions.every((each) => each.annotation(Transaction.remote))
    )
      return;
    const edits = [];
    update.changes.iterChanges((from, to, _fromB, _toB, inserted) =>
      edits.push({ from, to, insert: inserted.toString() }),
    );
    void session.change(edits, "Typing", typingGroup());
  });
  return [
    ours,
    keymap.of([...defaultKeymap, indentWithTab]),
    lineNumbers(),
    lintGutter(),
    drawSelection(),
    highlightActiveLine(),
    highlightActiveLineGutter(),
    bracketMatching(),
    indentOnInput(),
    syntaxHighlighting(colours),
    yaml(),
    marked,
    typed,
    EditorView.lineWrapping,
    EditorView.contentAttributes.of({ "aria-label": "Text of the move" }),
  ];
}

// What was changed elsewhere, as the shortest change.
function follow(view, text) {
  const [edit] = differenceOf(view.state.doc.toString(), text);
  if (edit) view.dispatch({ changes: edit, annotations: Transaction.remote.of(true) });
}

function connect(parent, session) {
  const view = new EditorView({
    parent,
    state: EditorState.create({ doc: session.text.value, extensions: extensionsOf(session) }),
  });
  view.scrollDOM.tabIndex = 0; // scrolled by keys, too
  const stops = [
    effect(() => follow(view, session.text.value)),
    effect(() => {
      const diagnostics = diagnosticsOf(session, view.state.doc);
      view.dispatch(setDiagnostics(view.state, diagnostics));
    }),
    effect(() => {
      const lines = [...new Set(session.picked.value.map((each) => each.at.line))].sort(
        (a, b) => a - b,
      );
      view.dispatch({ effects: markLines.of(lines) });
      if (lines.length > 0 && lines[0] <= view.state.doc.lines && !view.hasFocus)
        view.dispatch({
          effects: EditorView.scrollIntoView(view.state.doc.line(lines[0]).from, { y: "center" }),
        });
    }),
    effect(() => {
      const place = session.place.value;
      if (place === null || place.line > view.state.doc.lines) return;
      const at = view.state.doc.line(place.line).from + (place.column ?? 1) - 1;
      view.dispatch({
        selection: { anchor: Math.min(at, view.state.doc.length) },
        scrollIntoView: true,
      });
      view.focus();
    }),
  ];
  return () => {
    stops.forEach((stop) => stop());
    view.destroy();
  };
}

export function TextPanel({ session }) {
  const box = useRef(null);
  useEffect(() => connect(box.current, session), [session]);
  return html`<section aria-label="Text" class="text-panel" ref=${box}></section>`;
}
