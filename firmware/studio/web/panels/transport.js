// Control of the machine: who has it, power, the move, and its speed.
import { html, useState } from "../vendor/ui.js";
import { allowed, wayToStart } from "../live/machine.js";
import { adviceFor } from "../live/faults.js";
import { roundFor, withUnit } from "../model/number.js";

const words = {
  off: "off: no torque",
  ready: "ready: holds with torque",
  moving: "moving",
  holding: "holding on the path",
  stopping: "stopping",
  fault: "fault",
  unknown: "not known",
};

function Control({ machine }) {
  if (machine.isHolder.value)
    return html`<button onClick=${() => machine.release()}>Give control back</button>`;
  return html`<button onClick=${() => machine.take()} disabled=${machine.linkState.value !== "open"}>
    Take control${machine.isHeld.value ? " (another has it)" : ""}
  </button>`;
}

export function Fault({ machine }) {
  const text = machine.fault.value;
  if (!text) return null;
  return html`<div class="fault" role="alert"><strong>${text}</strong> ${adviceFor(text)}</div>`;
}

// The way to the start is shown before anything goes.
function WayToStart({ machine, way, onClose }) {
  const longest = Math.max(0, ...way.map((each) => each.seconds));
  return html`<div class="dialog" role="dialog" aria-label="The way to the start" aria-modal="false">
    <h3>To the start of the move, at a quarter of the limits</h3>
    ${
      way.length === 0
        ? html`<p>The axes stand there already.</p>`
        : html`<table>
          <thead><tr><th>axis</th><th>from</th><th>to</th><th>about</th></tr></thead>
          <tbody>
            ${way.map(
              (each) => html`<tr>
                <td>${each.name}</td><td>${withUnit(each.from, each.unit)}</td>
                <td>${withUnit(each.to, each.unit)}</td><td>${each.seconds.toFixed(1)} s</td>
              </tr>`,
            )}
          </tbody>
        </table>
        <p>Each axis goes straight to its first position; all of it takes about ${longest.toFixed(1)} s. Look that the way is free.</p>`
    }
    <div class="buttons">
      <button class="primary" onClick=${() => {
        onClose();
        void machine.order("approach");
      }}>Go</button>
      <button onClick=${onClose}>Not now</button>
    </div>
  </div>`;
}

function Override({ machine, may }) {
  const now = Math.round(100 * (machine.frame.value?.override ?? 1));
  return html`<label class="override">Speed
    <input type="range" min="0" max="200" step="5" value=${now} disabled=${!may}
      onChange=${(event) => machine.order("override", { percent: Number(event.target.value) })} />
    <output>${now} %</output>
  </label>`;
}

// Where the machine stands becomes a key at the playhead, on every axis with keys.
export async function captureKey(session, machine) {
  const positions = await machine.capture();
  if (positions === null) return;
  const t = roundFor(session.playhead.value, 1e-3);
  const operations = [];
  for (const axis of session.axes.value) {
    if (!axis.isKeyed || positions[axis.name] === undefined) continue;
    const p = roundFor(positions[axis.name], 1e-3);
    const there = axis.keys.findIndex((key) => Math.abs(key.t - t) < 5e-4);
    operations.push(
      there < 0
        ? { op: "add", axis: axis.name, t, p }
        : { op: "key", axis: axis.name, key: there, p },
    );
  }
  if (await session.edit(operations, "Key from the machine"))
    session.say(`A key at ${t.toFixed(2)} s, from where the machine stands.`);
}

function useWay(session, machine) {
  const [way, setWay] = useState(null);
  const show = async () => {
    const { values } = (await session.valuesAt(0)) ?? {};
    const { value: frame } = machine.frame;
    const { value: hello } = machine.hello;
    if (values && frame && hello)
      setWay(
        wayToStart(
          session.axes.value,
          frame,
          hello,
          session.axes.value.map((axis) => values[axis.index][0]),
        ),
      );
  };
  return [way, show, () => setWay(null)];
}

export function Transport({ session, machine }) {
  const [way, showWay, closeWay] = useWay(session, machine);
  const frame = machine.frame.value;
  const state = machine.state.value;
  const may = allowed(state, {
    isHolder: machine.isHolder.value,
    isFresh: machine.isFresh.value,
    jogging: frame?.jogging ?? false,
    homing: frame?.homing ?? false,
  });
  const isLoaded = machine.loaded.value === session.text.value;
  const order = (command, members) => () => machine.order(command, members);
  return html`<section class="transport" aria-label="Machine">
    <span class=${`state ${state}`} role="status">${words[state]}${frame?.homing ? ", homing" : ""}${frame?.jogging ? ", jogging" : ""}</span>
    <${Control} machine=${machine} />
    <span class="buttons">
      <button onClick=${order("enable")} disabled=${!may.enable}>Enable</button>
      <button onClick=${order("off")} disabled=${!may.off}>Torque off</button>
      <button onClick=${order("reset")} disabled=${!may.reset}>Reset</button>
      <button onClick=${order("home")} disabled=${!may.home}>Home</button>
    </span>
    <span class="buttons">
      <button onClick=${() => machine.load(session.text.value)} disabled=${!may.load || session.isBroken.value}
        title=${isLoaded ? "The machine has this move" : "The machine has another move than the page"}>
        Load${isLoaded ? " ✓" : ""}
      </button>
      <button onClick=${showWay} disabled=${!may.approach || machine.loaded.value === null}>Go to start…</button>
      <button class="primary" onClick=${() => machine.play()} disabled=${!may.start || machine.loaded.value === null}>Start</button>
      <button onClick=${order("hold")} disabled=${!may.hold}>Hold</button>
      <button onClick=${order("resume")} disabled=${!may.resume}>Resume</button>
      <button onClick=${order("reverse", { back: true })} disabled=${!may.resume}>Back</button>
    </span>
    <button class="switch" aria-pressed=${machine.loop.value} onClick=${() => (machine.loop.value = !machine.loop.value)}>Loop</button>
    <button class="switch" aria-pressed=${machine.pingPong.value} onClick=${() => (machine.pingPong.value = !machine.pingPong.value)}>Forth and back</button>
    <${Override} machine=${machine} may=${may.override} />
    <button onClick=${() => captureKey(session, machine)} disabled=${!may.capture}>Key from machine</button>
    ${way ? html`<${WayToStart} machine=${machine} way=${way} onClose=${closeWay} />` : null}
  </section>`;
}
