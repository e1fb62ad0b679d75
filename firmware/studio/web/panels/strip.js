// Plan against actual over time, live, and takes over path time beside earlier ones.
import { html, useEffect, useMemo, useRef, useState } from "../vendor/ui.js";
import { columnsOf, takeToCsv } from "../live/trail.js";
import { UPlot } from "../vendor/strip.js";

// Its style comes with it, so that the page's first picture does not wait for that.
const style = document.createElement("link");
style.rel = "stylesheet";
style.href = new URL("../vendor/strip.css", import.meta.url).href;
document.head.append(style);

const liveFrames = 60 * 15; // of the live plot
const height = 180; // px

function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

function optionsOf(width, label, names) {
  const strokes = ["--accent", "--bad", "--axis-2", "--axis-3", "--axis-4", "--axis-5"];
  const axis = { stroke: colour("--quiet"), grid: { stroke: colour("--faint") }, labelGap: 0 };
  return {
    width,
    height,
    axes: [
      { ...axis, label: "s", size: 30, labelSize: 16 },
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

// `span`: what of x is shown, [from, to]; null: all of it.
function Plot({ label, names, data, span = null }) {
  const box = useRef(null);
  const plot = useRef(null);
  const [seen, setSeen] = useState([null, null]); // s, also of what was zoomed
  const shape = names.join();
  useEffect(() => {
    const parent = box.current;
    const width = () => parent.clientWidth || 300;
    const hooks = {
      setScale: [(u, key) => key === "x" && setSeen([u.scales.x.min, u.scales.x.max])],
    };
    plot.current = new UPlot({ ...optionsOf(width(), label, names), hooks }, data, parent);
    const sizes = new ResizeObserver(() => plot.current.setSize({ width: width(), height }));
    sizes.observe(parent);
    return () => {
      sizes.disconnect();
      plot.current.destroy();
    };
  }, [shape, label]);
  useEffect(() => plot.current?.setData(data), [data]); // else what was zoomed stays
  useEffect(() => {
    if (span !== null) plot.current?.setScale("x", { min: span[0], max: span[1] });
    else plot.current?.setData(data);
  }, [span?.[0], span?.[1], data]);
  return html`<div class="plot" ref=${box} role="img"
    aria-label=${`${label}: ${names.join(", ")}${seen[0] === null ? "" : `, ${seen[0].toFixed(1)} s to ${seen[1].toFixed(1)} s`}`}></div>`;
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

const widths = [0.5, 1, 2, 5, 10, 30, 60]; // s

function TakesPlot({ machine, axes, index }) {
  const takes = machine.takes.value;
  const [chosen, setChosen] = useState(3);
  const [wide, setWide] = useState(0); // s that are shown; 0: all
  const [back, setBack] = useState(0); // s after the start
  const shown = takes.slice(-chosen);
  const data = useMemo(
    () => (takes.length === 0 ? null : takesToColumns(takes.slice(-chosen), index)),
    [takes, chosen, index],
  );
  if (data === null) return html`<p class="quiet">No take yet: start the move.</p>`;
  const names = ["plan", ...shown.map(labelOf)];
  const unit = axes[index]?.unit ?? "";
  const [from, to] = [data[0][0], data[0].at(-1)];
  const most = Math.max(to - from - wide, 0);
  const at = from + Math.min(back, most);
  const span = wide === 0 || wide >= to - from ? null : [at, at + wide];
  return html`<${Plot} label=${`${axes[index]?.name ?? ""}, ${unit}`} names=${names} data=${data} span=${span} />
    <div class="buttons">
      <label>Show <select value=${String(wide)} onChange=${(event) => setWide(Number(event.target.value))}>
        <option value="0">all of it</option>
        ${widths.map((each) => html`<option value=${String(each)}>${each} s</option>`)}
      </select></label>
      <label>From
        <input type="range" class="scroll" min="0" max=${most} step="0.01" value=${at - from} disabled=${span === null}
          onInput=${(event) => setBack(Number(event.target.value))} />
        ${span === null ? "" : `${at.toFixed(2)} s`}
      </label>
    </div>
    <ul class="takes">
      ${takes.map((take) => html`<${Take} machine=${machine} take=${take} index=${index} unit=${unit} />`)}
    </ul>
    <label>Compare the last <input type="number" min="1" max="5" value=${chosen} onInput=${(event) => setChosen(Number(event.target.value) || 1)} /></label>`;
}

function Takes(props) {
  const open = async (event) => {
    for (const file of event.target.files) await props.machine.openTake(file);
    event.target.value = "";
  };
  return html`<${TakesPlot} ...${props} />
    <label class="inline">Open a recording (CSV)
      <input type="file" accept=".csv,text/csv" multiple onChange=${open} />
    </label>
    <${Kept} machine=${props.machine} />`;
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
    rows: kept.current.slice(Math.max(end - liveFrames, 0), end),
    most: Math.max(kept.current.length - liveFrames, 0),
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
        ${seenNow.isPaused ? `${(seenNow.back / 60).toFixed(1)} s` : ""}
      </label>
    </div>
    <${Plot} label=${`${axes[index]?.name ?? ""}, ${axes[index]?.unit ?? ""}`} names=${["plan", "actual"]} data=${data} />
    <h3>Takes</h3>
    <${Takes} machine=${machine} axes=${axes} index=${index} />
  </section>`;
}
