// Colours of the canvas, as the style sheet has them, so that a dark page and a
// light one differ in one place.
const names = {
  ground: "--ground",
  pane: "--pane",
  line: "--line",
  faint: "--faint",
  text: "--text",
  quiet: "--quiet",
  accent: "--accent",
  bad: "--bad",
  band: "--band",
};

export function readColours(element) {
  const style = getComputedStyle(element);
  const read = (name) => style.getPropertyValue(name).trim();
  const colours = Object.fromEntries(Object.entries(names).map(([key, name]) => [key, read(name)]));
  colours.axes = Array.from({ length: 8 }, (_, i) => read(`--axis-${i}`));
  return colours;
}
