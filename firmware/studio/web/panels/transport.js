// Control of the machine: who has it, power, the move, and its speed.
import { html, useState } from "../vendor/ui.js";
import { allowed, standsOf } from "../live/machine.js";
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
  return html`<div class="fault" role="alert"><strong>${text}</strong> ${adviceFor(machine.faultCode.value)}</div>`;
}

// The approach is shown before anything goes.
function Approach({ session, machine, approach, onClose }) {
  const longest = Math.max(0, ...approach.axes.map((each) => each.seconds));
  return html`<div class="dialog" role="dialog" aria-label=${approach.title} aria-modal="false">
    <h3>${approach.title}, at a quarter of the limits</h3>
    ${
      approach.axes.length === 0
        ? html`<p>The axes stand there already.</p>`
        : html`<table>
          <thead><tr><th>axis</th><th>from</th><th>to</th><th>in</th></tr></thead>
          <tbody>
            ${approach.axes.map(
              (each) => html`<tr>
                <td>${each.name}</td><td>${withUnit(each.from, each.unit)}</td>
                <td>${withUnit(each.to, each.unit)}</td><td>${each.seconds.toFixed(1)} s</td>
              </tr>`,
            )}
          </tbody>
        </table>
        <p>Each axis goes straight there; all of it takes ${longest.toFixed(1)} s.
        ${session.approach.value?.poses ? " The dashed line in Space is the path of the camera." : ""} Check that nothing is in the way.</p>`
    }
    <div class="buttons">
      <button class="primary" onClick=${() => {
        onClose();
        void machine.order(approach.command, approach.members);
      }}>Go</button>
      <button onClick=${onClose}>Not now</button>
    </div>
  </div>`;
}

function Override({ machine, may }) {
  const now = machine.percent.value;
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

const approachPoses = 120;

// To a time of the move: what is asked before the machine goes there.
function useApproach(session, machine) {
  const [approach, setApproach] = useState(null);
  const show = async (t, title, command, members) => {
    const { value: frame } = machine.frame;
    const { value: hello } = machine.hello;
    const axes = session.axes.value;
    const from = frame && hello ? standsOf(axes, frame, hello) : null;
    if (from === null) return session.say("Where the axes stand is not known.", true);
    const planned = await session.planApproach(from, t, approachPoses);
    const { values } = (await session.valuesAt(t)) ?? {};
    if (!planned.seconds || !values) return session.say("The approach cannot be planned.", true);
    session.approach.value = planned;
    if (planned.poses) session.tab.value = "Space";
    setApproach({
      title,
      command,
      members,
      axes: axes
        .map(({ name, unit, index }) => {
          const to = values[index][0];
          return { name, unit, from: from[index], to, seconds: planned.seconds[index] };
        })
        .filter((each) => Math.abs(each.to - each.from) > 1e-3),
    });
    return null;
  };
  const close = () => {
    session.approach.value = null;
    setApproach(null);
  };
  return [approach, show, close];
}

// Of one key that is selected, or of the playhead.
function useTarget(session) {
  const picked = session.picked.value;
  const [only] = picked;
  if (picked.length === 1)
    return {
      label: "Go to key…",
      t: only.at.t,
      title: `To key ${only.key + 1} of ${only.axis}, at ${only.at.t.toFixed(2)} s`,
      members: { axis: only.axis, key: only.key + 1 },
    };
  const t = session.playhead.value;
  return {
    label: "Go to playhead…",
    t,
    title: `To ${t.toFixed(2)} s of the move`,
    members: { to: t },
  };
}

export function Transport({ session, machine }) {
  const [approach, showApproach, closeApproach] = useApproach(session, machine);
  const target = useTarget(session);
  const state = machine.state.value;
  const jogging = machine.isJogging.value;
  const homing = machine.isHoming.value;
  const may = allowed(state, {
    isHolder: machine.isHolder.value,
    isFresh: machine.isFresh.value,
    jogging,
    homing,
  });
  const isLoaded = machine.loaded.value === session.text.value;
  const order = (command, members) => () => machine.order(command, members);
  return html`<section class="transport" aria-label="Machine">
    <span class=${`state ${state}`} role="status">${words[state]}${homing ? ", homing" : ""}${jogging ? ", jogging" : ""}</span>
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
      <button onClick=${() => showApproach(0, "To the start of the move", "approach", {})} disabled=${!may.approach || machine.loaded.value === null}>Go to start…</button>
      <button onClick=${() => showApproach(target.t, target.title, "go", target.members)} disabled=${!may.go || !isLoaded}
        title="It is held there; Resume plays on from there">${target.label}</button>
      <button class="primary" onClick=${() => machine.play()} disabled=${!may.start || machine.loaded.value === null}>Start</button>
      <button onClick=${order("hold")} disabled=${!may.hold}>Hold</button>
      <button onClick=${order("resume")} disabled=${!may.resume}>Resume</button>
      <button onClick=${order("reverse", { back: true })} disabled=${!may.resume}>Back</button>
    </span>
    <button class="switch" aria-pressed=${machine.loop.value} onClick=${() => (machine.loop.value = !machine.loop.value)}>Loop</button>
    <button class="switch" aria-pressed=${machine.pingPong.value} onClick=${() => (machine.pingPong.value = !machine.pingPong.value)}>Forth and back</button>
    <${Override} machine=${machine} may=${may.override} />
    <button onClick=${() => captureKey(session, machine)} disabled=${!may.capture}>Key from machine</button>
    ${approach ? html`<${Approach} session=${session} machine=${machine} approach=${approach} onClose=${closeApproach} />` : null}
  </section>`;
}
