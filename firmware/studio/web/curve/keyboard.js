// Which key does what on the curve editor; the list of the help is this table.

export const shortcuts = [
  ["ArrowLeft", "earlier", "Nudge earlier: one frame, or 0.1 s"],
  ["ArrowRight", "later", "Nudge later"],
  ["ArrowUp", "up", "Nudge up: a hundredth of the axis's span"],
  ["ArrowDown", "down", "Nudge down"],
  ["Shift+ArrowLeft", "earlier-fine", "The same in tenths: earlier"],
  ["Shift+ArrowRight", "later-fine", "later"],
  ["Shift+ArrowUp", "up-fine", "up"],
  ["Shift+ArrowDown", "down-fine", "down"],
  [".", "next", "Select the next key"],
  [",", "previous", "Select the key before"],
  ["]", "next-axis", "Edit the next axis"],
  ["[", "previous-axis", "Edit the axis before"],
  ["A", "all", "Select all keys of the axes that are shown"],
  ["Escape", "none", "Select nothing, or call a drag off"],
  ["K", "add", "Add a key at the playhead, on the curve"],
  ["Delete", "remove", "Remove the selected keys"],
  ["Backspace", "remove", "The same"],
  ["M", "mirror-time", "Mirror in time"],
  ["Shift+M", "mirror-value", "Mirror in value"],
  ["R", "ripple", "Ripple: all keys after go along, on or off"],
  ["X", "lock-time", "While dragging: in time only"],
  ["Y", "lock-value", "While dragging: in value only"],
  ["F", "show-all", "Show all of the move"],
  ["Shift+F", "show-selected", "Show what is selected"],
  ["+", "zoom-in", "Zoom in about the playhead"],
  ["-", "zoom-out", "Zoom out"],
  ["Space", "preview", "Run the playhead here, not on the machine"],
  ["Home", "to-start", "Playhead to the start"],
  ["End", "to-end", "Playhead to the end"],
  ["PageDown", "step-on", "Playhead one frame on, or 0.1 s"],
  ["PageUp", "step-back", "Playhead one frame back"],
  ["Ctrl+C", "copy", "Copy"],
  ["Ctrl+X", "cut", "Cut"],
  ["Ctrl+V", "paste", "Paste at the playhead"],
  ["Ctrl+D", "duplicate", "Copy and paste at the playhead"],
  ["?", "help", "This list"],
];

// Everywhere on the page, but where one types.
export const everywhere = [
  ["Ctrl+Z", "undo", "Undo"],
  ["Ctrl+Shift+Z", "redo", "Redo"],
  ["Ctrl+Y", "redo", "Redo"],
  ["Ctrl+S", "save", "Save"],
];

function spelling(event) {
  let name = event.key === " " ? "Space" : event.key;
  const isLetter = /^[a-z]$/i.test(name);
  if (isLetter) name = name.toUpperCase();
  const isNamed = isLetter || name.length > 1;
  const shift = event.shiftKey && isNamed ? "Shift+" : "";
  return (event.ctrlKey || event.metaKey ? "Ctrl+" : "") + shift + name;
}

// The action of an event of the keyboard, or null.
export function actionFor(event, table = shortcuts) {
  if (event.altKey) return null;
  const name = spelling(event);
  return table.find(([keys]) => keys === name)?.[1] ?? null;
}
