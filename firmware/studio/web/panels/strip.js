// Plan against actual over time, live, and takes over path time beside earlier ones.
import { html, useEffect, useMemo, useRef, useState } from "../vendor/ui.js";
import { columnsOf, takeToCsv } from "../live/trail.js";
import { UPlot } from "../vendor/strip.js";

// Its style comes with it, so that the page's first picture does not wait for that.
const style = document.createElement("link");
style.rel = "stylesheet";
style.href = new URL("../vendor/strip.css", import.meta.url).href;
document.head.append(style);

const seen = 60 * 15; // frames of the live plot
const height = 180; // px

function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

function optionsOf(width, label, names) {
  const strokes = ["--accent", "--bad", "--axis-2", "--axis-3", "--axis-4", "--axis-5"];
  const axis = { stroke: colour("--quiet"), grid: { stroke: colour("--faint") } };
  return {
    width,
    height,
    axes: [
      { ...axis, label: "s" },
      { ...axis, label },
    ],
    scales: { x: { time: false } },
    series: [
      { label: "s" },
      ...names.map((name, i) => ({
        label: name,
        stroke: colour(strokes[i % strokes.length]),
        width: 1.5,
        spanGaps: true,
      })),
    ],
  };
}

function Plot({ label, names, data }) {
  const box = useRef(null);
  const plot = useRef(null);
  const shape = names.join();
  useEffect(() => {
    const parent = box.current;
    const width = () => parent.clientWidth || 300;
    plot.current = new UPlot(optionsOf(width(), label, names), data, parent);
    const sizes = new ResizeObserver(() => plot.current.setSize({ width: width(), height }));
    sizes.observe(parent);
    return () => {
      sizes.disconnect();
      plot.current.destroy();
    };
  }, [shape, label]);
  useEffect(() => plot.current?.setData(data), [data]); // else what was zoomed stays
  return html`<div class="plot" ref=${box} role="img" aria-label=${`${label}: ${names.join(", ")}`}></div>`;
}

function download(name, text) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// The latest take's plan, and where the axis was in each, at the times of the latest.
export function takesToColumns(takes, axis) {
  const latest = takes.at(-1);
  const [x, demand] = columnsOf(latest.rows, axis, (row) => row.path);
  const actuals = takes.map((take) => {
    const [at, , actual] = columnsOf(take.rows, axis, (row) => row.path);
    let i = 0;
    return Float64Array.from(x, (t) => {
      while (i + 1 < at.length && at[i + 1] <= t) i++;
      if (at.length === 0 || t < at[0] || t > at.at(-1) + 0.05) return NaN;
      const next = Math.min(i + 1, at.length - 1);
      const share = at[next] > at[i] ? (t - at[i]) / (at[next] - at[i]) : 0;
      return actual[i] + share * (actual[next] - actual[i]);
    });
  });
  return [x, demand, ...actuals];
}

function labelOf(take) {
  return take.name?.replace(/\.csv$/, "") ?? new Date(take.started).toLocaleTimeString();
}

function Take({ machine, take, index, unit }) {
  return html`<li>
    ${labelOf(take)}: worst following error ${take.worst[index]?.toFixed(3)} ${unit}
    <button onClick=${() => download("take.csv", takeToCsv(take, machine.axisNames))}>Save as CSV</button>
    ${take.name === undefined ? html`<button onClick=${() => machine.keepTake(take)}>Keep</button>` : null}
  </li>`;
}

// Those on disk that are not shown yet.
function Kept({ machine }) {
  useEffect(() => void machine.listTakes(), [machine]);
  const shown = new Set(machine.takes.value.map((take) => take.name));
  const others = machine.kept.value.filter((name) => !shown.has(name)).reverse();
  if (others.length === 0) return null;
  return html`<h3>Kept beside the move</h3>
    <ul class="kept">
      ${others.map(
        (name) =>
          html`<li>${labelOf({ name })} <button aria-label=${`Compare ${name}`} onClick=${() => machine.readTake(name)}>Compare</button></li>`,
      )}
    </ul>`;
}

function TakesPlot({ machine, axes, index }) {
  const takes = machine.takes.value;
  const [chosen, setChosen] = useState(3);
  const shown = takes.slice(-chosen);
  const data = useMemo(
    () => (takes.length === 0 ? null : takesToColumns(takes.slice(-chosen), index)),
    [takes, chosen, index],
  );
  if (data === null) return html`<p class="quiet">No take yet: start the move.</p>`;
  const names = ["plan", ...shown.map(labelOf)];
  const unit = axes[index]?.unit ?? "";
  return html`<${Plot} label=${`${axes[index]?.name ?? ""}, ${unit}`} names=${names} data=${data} />
    <ul class="takes">
      ${takes.map((take) => html`<${Take} machine=${machine} take=${take} index=${index} unit=${unit} />`)}
    </ul>
    <label>Compare the last <input type="number" min="1" max="5" value=${chosen} onInput=${(event) => setChosen(Number(event.target.value) || 1)} /></label>`;
}

function Takes(props) {
  return html`<${TakesPlot} ...${props} /><${Kept} machine=${props.machine} />`;
}

// The last rows, or, while paused, those that the slider has scrolled to.
function useWindow(machine) {
  const [isPaused, setPaused] = useState(false);
  const [back, setBack] = useState(0);
  const [now, tick] = useState(0);
  const kept = useRef([]);
  useEffect(() => {
    if (isPaused) return undefined;
    const timer = setInterval(() => tick((n) => n + 1), 100);
    return () => clearInterval(timer);
  }, [isPaused]);
  if (!isPaused) kept.current = machine.trail.rows;
  const end = Math.max(kept.current.length - back, 0);
  const flip = () => {
    kept.current = [...machine.trail.rows];
    setBack(0);
    setPaused(!isPaused);
  };
  return {
    rows: kept.current.slice(Math.max(end - seen, 0), end),
    most: Math.max(kept.current.length - seen, 0),
    stamp: `${now} ${back}`,
    isPaused,
    flip,
    back,
    setBack,
  };
}

export function Strip({ machine }) {
  const [index, setIndex] = useState(0);
  const seenNow = useWindow(machine);
  const axes = machine.hello.value?.axes ?? [];
  const { rows } = seenNow;
  const last = rows.at(-1)?.time ?? 0;
  const data = useMemo(
    () => columnsOf(rows, index, (row) => row.time - last),
    [seenNow.stamp, index],
  );
  return html`<section
    aria-label="Plan against actual"
    class=${machine.isFresh.value || seenNow.isPaused ? "" : "old"}
  >
    <h2>Plan against actual</h2>
    <div class="buttons">
      <label>Axis <select value=${index} onChange=${(event) => setIndex(Number(event.target.value))}>
        ${axes.map((axis, i) => html`<option value=${i}>${axis.name}</option>`)}
      </select></label>
      <button class="switch" aria-pressed=${seenNow.isPaused} onClick=${seenNow.flip}>Pause</button>
      <label>Scroll back
        <input type="range" min="0" max=${seenNow.most} value=${seenNow.back}
          disabled=${!seenNow.isPaused || seenNow.most === 0}
          onInput=${(event) => seenNow.setBack(Number(event.target.value))} />
      </label>
    </div>
    <${Plot} label=${`${axes[index]?.name ?? ""}, ${axes[index]?.unit ?? ""}`} names=${["plan", "actual"]} data=${data} />
    <h3>Takes</h3>
    <${Takes} machine=${machine} axes=${axes} index=${index} />
  </section>`;
}
