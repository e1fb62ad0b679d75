// What was heard of the axes, for plots: a ring of frames, and the takes in it.
//
// A take is one play of a move, from the frame in which its path time begins to run
// to the one in which it ends; takes are kept whole, the ring forgets.

const ringFrames = 60 * 120; // two minutes
const mostTakes = 8;
const mostTakeFrames = 60 * 3600;

function rowOf(frame) {
  return {
    time: frame.time,
    path: frame.path,
    ticks: frame.ticks,
    axes: frame.axes.map(({ demand, actual, error }) => ({
      demand: demand.last,
      actual: actual.last,
      error: Math.abs(error.high) > Math.abs(error.low) ? error.high : error.low,
    })),
  };
}

export class Trail {
  #ring = [];
  #take = null;

  constructor() {
    this.takes = [];
  }

  get rows() {
    return this.#ring;
  }

  get isTaking() {
    return this.#take !== null;
  }

  // `playing`: a move runs, is held or stops.
  add(frame, playing) {
    const row = rowOf(frame);
    this.#ring.push(row);
    // Dropped in blocks, so that it costs nothing by the frame.
    if (this.#ring.length > ringFrames * 1.25) this.#ring = this.#ring.slice(-ringFrames);
    if (playing && this.#take === null) this.#take = { started: Date.now(), rows: [] };
    if (this.#take !== null && this.#take.rows.length < mostTakeFrames) this.#take.rows.push(row);
    if (!playing && this.#take !== null) this.#finish();
  }

  #finish() {
    const take = this.#take;
    this.#take = null;
    if (take.rows.length < 2) return;
    take.worst = worstOf(take.rows);
    this.takes.push(take);
    if (this.takes.length > mostTakes) this.takes.shift();
  }
}

// Rows of an axis as columns for a plot: [x, demand, actual], x by `of` (a row).
export function columnsOf(rows, axis, of) {
  const x = new Float64Array(rows.length);
  const demand = new Float64Array(rows.length);
  const actual = new Float64Array(rows.length);
  rows.forEach((row, i) => {
    x[i] = of(row);
    demand[i] = row.axes[axis]?.demand ?? NaN;
    actual[i] = row.axes[axis]?.actual ?? NaN;
  });
  return [x, demand, actual];
}

const parts = ["demand", "actual", "error"];

// The following error that was largest, of every axis.
function worstOf(rows) {
  return rows[0].axes.map((_, axis) =>
    rows.reduce((most, row) => Math.max(most, Math.abs(row.axes[axis].error)), 0),
  );
}

// A take that was kept, or a recording of slew run --telemetry, for axes of these names;
// null where it is of others, or neither.
export function takeFromCsv(text, names) {
  const lines = text.trimEnd().split("\n");
  return lines[0].startsWith("t_ns,phase,")
    ? takeFromTelemetry(lines, names)
    : takeFromLines(lines, names);
}

function takeFromLines(lines, names) {
  const head = takeToCsv({ rows: [] }, names).trimEnd();
  if (lines[0] !== head || lines.length < 3) return null;
  const rows = lines.slice(1).map((line) => {
    const [time, path, ...values] = line.split(",").map(Number);
    const axes = names.map((_, axis) =>
      Object.fromEntries(parts.map((part, i) => [part, values[parts.length * axis + i]])),
    );
    return { time, path, axes };
  });
  if (rows.some((row) => row.axes.some((axis) => !Number.isFinite(axis.error)))) return null;
  return { rows, worst: worstOf(rows) };
}

// Of a recording by the tick: as many rows as frames would have been, each with the last
// of its ticks and the largest following error of all.
const telemetryRowNs = 1e9 / 60;
const playedPhases = new Set(["move", "settle", "stop"]);
const telemetryParts = ["demand", "actual", "following"];

function takeFromTelemetry(lines, names) {
  const head = lines[0].split(",");
  const columns = names.map((name) =>
    telemetryParts.map((part) => head.findIndex((each) => each.startsWith(`${name}.${part}_`))),
  );
  if (columns.flat().includes(-1)) return null;
  const rows = [];
  let begun = -Infinity;
  for (const line of lines.slice(1)) {
    const cells = line.split(",");
    if (cells.length !== head.length || !playedPhases.has(cells[1])) continue;
    const axes = columns.map(([demand, actual, error]) => ({
      demand: Number(cells[demand]),
      actual: Number(cells[actual]),
      error: Number(cells[error]),
    }));
    if (axes.some((axis) => !Number.isFinite(axis.actual + axis.error))) return null;
    const t = Number(cells[0]);
    const row = { time: t / 1e9, path: Number(cells[3]) / 1e9, axes };
    if (t - begun >= telemetryRowNs) {
      begun = t;
      rows.push(row);
    } else rows.push(joined(rows.pop(), row));
  }
  return rows.length < 2 ? null : { rows, worst: worstOf(rows) };
}

function joined(before, row) {
  row.axes.forEach((axis, i) => {
    const { error } = before.axes[i];
    if (Math.abs(error) > Math.abs(axis.error)) axis.error = error;
  });
  return row;
}

// A take as text for a spreadsheet.
export function takeToCsv(take, names) {
  const columns = names.flatMap((name) => parts.map((part) => `${name}_${part}`));
  const head = ["t_s", "path_s", ...columns];
  const start = take.rows[0]?.time ?? 0;
  const lines = take.rows.map((row) =>
    [row.time - start, row.path, ...row.axes.flatMap((axis) => parts.map((part) => axis[part]))]
      .map((value) => value.toFixed(6))
      .join(","),
  );
  return `${head.join(",")}\n${lines.join("\n")}\n`;
}
