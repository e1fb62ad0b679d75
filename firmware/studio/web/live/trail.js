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
    take.worst = take.rows[0].axes.map((_, axis) =>
      take.rows.reduce((most, row) => Math.max(most, Math.abs(row.axes[axis].error)), 0),
    );
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

// A take as text for a spreadsheet.
export function takeToCsv(take, names) {
  const head = ["t_s", "path_s", ...names.flatMap((name) => [`${name}_demand`, `${name}_actual`])];
  const start = take.rows[0].time;
  const lines = take.rows.map((row) =>
    [row.time - start, row.path, ...row.axes.flatMap((axis) => [axis.demand, axis.actual])]
      .map((value) => value.toFixed(6))
      .join(","),
  );
  return `${head.join(",")}\n${lines.join("\n")}\n`;
}
