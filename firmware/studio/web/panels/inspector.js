// Exact numbers of what is selected, and what can be done to it.
import { html, useMemo, useState } from "../vendor/ui.js";
import { act, chooseHandles, scaleAboutPlayhead } from "../curve/actions.js";
import { shortNumber } from "../model/number.js";

const per = ["", "/s", "/s2"];

// A number is in the axis's unit (a time in s); with a unit it stands as it was typed.
export function typedValue(text) {
  const trimmed = text.trim();
  if (trimmed === "") return null;
  return /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(trimmed) ? Number(trimmed) : trimmed;
}

export function Field({ label, unit, value, placeholder, onSet }) {
  const [draft, setDraft] = useState(null);
  const shown = draft ?? (value === null ? "" : shortNumber(value, 6));
  const set = () => {
    const typed = draft === null ? null : typedValue(draft);
    setDraft(null);
    if (typed !== null && typed !== value) onSet(typed);
  };
  return html`<label>${label}
    <span class="with-unit">
      <input type="text" inputmode="decimal" value=${shown} placeholder=${placeholder}
        onInput=${(event) => setDraft(event.target.value)}
        onBlur=${set}
        onKeyDown=${(event) => {
          if (event.key === "Enter") set();
          if (event.key === "Escape") setDraft(null);
        }} />
      <span class="unit">${unit}</span>
    </span>
  </label>`;
}

// A select of names; those are looked through again only where they changed.
export function Choice({ label, value, names, none, onChoose }) {
  const options = useMemo(
    () =>
      names.map((name) => html`<option value=${name} selected=${name === value}>${name}</option>`),
    [names, value],
  );
  return html`<label>${label}
    <select value=${value} onChange=${(event) => onChoose(event.target.value)}>
      ${none === undefined ? null : html`<option value="">${none}</option>`}
      ${options}
    </select>
  </label>`;
}

const valueNames = { pose: "Weight", fade: "Weight", roll: "Roll", warp: "Time of the move" };

function OfAxis({ session, axis, at, set }) {
  return html`<${Field} label="Velocity" unit=${axis.unit + per[1]} value=${at.v} placeholder=${shortNumber(at.slope, 3)} onSet=${set("v", "the velocity")} />
    <${Field} label="Acceleration" unit=${axis.unit + per[2]} value=${at.a} placeholder="chosen" onSet=${set("a", "the acceleration")} />
    <${Choice} label="Curve from here" value=${at.curve} names=${session.curves} onChoose=${set("curve", "the curve of a span")} />`;
}

function OneKey({ session, picked }) {
  const { axis: name, key, at } = picked;
  const axis = session.tracks.value.find((each) => each.name === name);
  const set = (member, label) => (value) =>
    session.edit([{ op: "key", axis: name, key, [member]: value }], `Set ${label}`);
  return html`<div class="fields">
    <p class="quiet">${name}, key ${key + 1} of ${axis.keys.length}, line ${at.line}</p>
    <${Field} label="Time" unit="s" value=${at.t} onSet=${set("t", "the time")} />
    <${Field} label=${valueNames[axis.kind] ?? "Position"} unit=${axis.unit} value=${at.p} onSet=${set("p", "the value")} />
    ${axis.isOther ? null : html`<${OfAxis} session=${session} axis=${axis} at=${at} set=${set} />`}
  </div>`;
}

function Handles({ session, picked }) {
  if (!picked.some(({ at }) => at.left || at.right)) return null;
  const kind = picked[0].at.right?.kind ?? picked[0].at.left?.kind;
  return html`<div class="fields">
    <${Choice} label="Handles" value=${kind} names=${session.handles} onChoose=${(each) => chooseHandles(session, each)} />
  </div>`;
}

function Scale({ session }) {
  const [time, setTime] = useState("1");
  const [value, setValue] = useState("1");
  return html`<form class="inline" onSubmit=${(event) => {
    event.preventDefault();
    void scaleAboutPlayhead(session, Number(time), Number(value));
  }}>
    <label>Time ×<input size="4" value=${time} onInput=${(event) => setTime(event.target.value)} /></label>
    <label>Value ×<input size="4" value=${value} onInput=${(event) => setValue(event.target.value)} /></label>
    <button>Scale about the playhead</button>
  </form>`;
}

function Button({ session, action, children }) {
  return html`<button onClick=${() => act(session, action)}>${children}</button>`;
}

export function Inspector({ session }) {
  const picked = session.picked.value;
  if (picked.length === 0)
    return html`<section aria-label="Keys">
      <h2>Keys</h2>
      <p class="quiet">None selected. Click a key, draw a box around some, or press a full stop on the curves.</p>
      <div class="buttons"><${Button} session=${session} action="add">Key at the playhead<//>
      <${Button} session=${session} action="paste">Paste<//></div>
    </section>`;
  return html`<section aria-label="Keys">
    <h2>${picked.length === 1 ? "Key" : `${picked.length} keys`}</h2>
    ${picked.length === 1 ? html`<${OneKey} session=${session} picked=${picked[0]} />` : null}
    <${Handles} session=${session} picked=${picked} />
    <div class="buttons">
      <${Button} session=${session} action="copy">Copy<//>
      <${Button} session=${session} action="cut">Cut<//>
      <${Button} session=${session} action="paste">Paste<//>
      <${Button} session=${session} action="mirror-time">Mirror in time<//>
      <${Button} session=${session} action="mirror-value">Mirror in value<//>
      <${Button} session=${session} action="remove">Remove<//>
    </div>
    <${Scale} session=${session} />
  </section>`;
}
