// The bar on top: what is open, undo and save, the connection, and Stop.
import { html } from "../vendor/ui.js";

const linkTexts = {
  open: "connected",
  silent: "silent: what is shown is old",
  closed: "not connected",
};

export function StopButton({ machine }) {
  return html`<button class="stop" onPointerDown=${() => machine.stop()} onKeyDown=${(event) =>
    (event.key === "Enter" || event.key === " ") &&
    machine.stop()} title="Every motion comes to rest along its path. Not a certified emergency stop.">
    Stop
  </button>`;
}

function Connection({ machine }) {
  const state = machine.linkState.value;
  const real = machine.isReal.value;
  const kind = real === undefined ? "" : real ? "REAL DRIVES" : "simulated";
  return html`<span class=${`link ${state}`} role="status">
    <span class=${real ? "kind real" : "kind"}>${kind}</span>, ${linkTexts[state]}
  </span>`;
}

export function Header({ session, machine, onSave, onTour, onHelp }) {
  const studio = session.studio.value;
  return html`<header>
    <h1>slew studio</h1>
    <span class="file" title=${studio?.rig ?? ""}>
      ${session.title.value || studio?.move || "a new move"}${session.isDirty.value ? " •" : ""}
    </span>
    <span class="buttons">
      <button onClick=${() => session.undo()} disabled=${!session.undoLabel.value} title=${`Undo: ${session.undoLabel.value}`}>Undo</button>
      <button onClick=${() => session.redo()} disabled=${!session.redoLabel.value} title=${`Redo: ${session.redoLabel.value}`}>Redo</button>
      <button onClick=${onSave} disabled=${!session.isDirty.value}>Save</button>
    </span>
    <span class="buttons">
      <button onClick=${onTour}>Tour</button>
      <button onClick=${onHelp}>Keys</button>
    </span>
    <${Connection} machine=${machine} />
    <${StopButton} machine=${machine} />
  </header>`;
}
