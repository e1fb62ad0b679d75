// The page: opens the rig and the move, and puts the panels together.
import { html, render, useEffect, useState } from "./vendor/ui.js";
import { act } from "./curve/actions.js";
import { CurveEditor } from "./curve/editor.js";
import { actionFor, everywhere } from "./curve/keyboard.js";
import { Machine } from "./live/machine.js";
import { Session, remember } from "./model/session.js";
import { Axes } from "./panels/axes.js";
import { Drives } from "./panels/drives.js";
import { Header } from "./panels/header.js";
import { Help, Tour } from "./panels/help.js";
import { Inspector } from "./panels/inspector.js";
import { JogPanel } from "./panels/jog.js";
import { Problems } from "./panels/problems.js";
import { Toolbar } from "./panels/toolbar.js";
import { Fault, Transport } from "./panels/transport.js";
import { PlannerClient } from "./planner/client.js";

// Panels that bring much code with them are fetched when they are first shown.
const later = {
  Text: () => import("./panels/text.js").then((module) => module.TextPanel),
  Space: () => import("./space/view.js").then((module) => module.Space),
  Plots: () => import("./panels/strip.js").then((module) => module.Strip),
};

function Later({ name, ...props }) {
  const [Panel, setPanel] = useState(null);
  useEffect(() => void later[name]().then((panel) => setPanel(() => panel)), [name]);
  return Panel ? html`<${Panel} ...${props} />` : html`<p class="quiet">Loading…</p>`;
}

const tabs = ["Keys", "Text", "Space", "Jog", "Drives", "Plots"];

function Tab({ name, session, machine }) {
  if (name === "Keys")
    return html`<${Axes} session=${session} /><${Inspector} session=${session} />`;
  if (name === "Jog") return html`<${JogPanel} machine=${machine} />`;
  if (name === "Drives") return html`<${Drives} machine=${machine} />`;
  return html`<${Later} key=${name} name=${name} session=${session} machine=${machine} />`;
}

function Side({ session, machine, tab, setTab }) {
  const onKey = (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    const next = tabs[(tabs.indexOf(tab) + step + tabs.length) % tabs.length];
    setTab(next);
    document.getElementById(`tab-${next}`)?.focus();
  };
  return html`<div class="side">
    <div role="tablist" aria-label="Panels" onKeyDown=${onKey}>
      ${tabs.map(
        (
          name,
        ) => html`<button role="tab" id=${`tab-${name}`} aria-selected=${name === tab} aria-controls="panel"
          tabindex=${name === tab ? 0 : -1} onClick=${() => setTab(name)}>${name}</button>`,
      )}
    </div>
    <div role="tabpanel" id="panel" aria-labelledby=${`tab-${tab}`} tabindex="0">
      <${Tab} name=${tab} session=${session} machine=${machine} />
    </div>
  </div>`;
}

function Conflict({ session, onClose }) {
  return html`<div class="dialog" role="dialog" aria-label="The file has changed">
    <h3>The file has changed on disk since it was opened</h3>
    <p>Nothing was written. Undo brings back what is on the page now, whichever you choose.</p>
    <div class="buttons">
      <button onClick=${() => session.reload().then(onClose)}>Read the file again</button>
      <button onClick=${() => session.save(true).then(onClose)}>Write over it</button>
      <button onClick=${onClose}>Neither</button>
    </div>
  </div>`;
}

function App({ session, machine, isFirst }) {
  const tab = session.tab.value;
  const setTab = (name) => (session.tab.value = name);
  const [shown, setShown] = useState(isFirst ? "tour" : null);
  const save = async () => {
    if (!(await session.save()) && session.notice.value.text.includes("changed on disk"))
      setShown("conflict");
  };
  useEffect(() => {
    const onKey = (event) => {
      const action = actionFor(event, everywhere);
      if (action === null || event.defaultPrevented || event.target.matches("input, textarea"))
        return;
      event.preventDefault();
      if (action === "save") void save();
      else void act(session, action);
    };
    const leave = (event) => session.isDirty.value && event.preventDefault();
    window.addEventListener("keydown", onKey);
    window.addEventListener("beforeunload", leave);
    return () => {
      window.removeEventListener("keydown", onKey);
      window.removeEventListener("beforeunload", leave);
    };
  }, []);
  const notice = session.notice.value;
  const showPlace = (message) => {
    setTab("Text");
    session.place.value = { line: message.line, column: message.column };
  };
  const endTour = () => {
    remember({ hasToured: true });
    setShown(null);
  };
  return html`<${Header} session=${session} machine=${machine} onSave=${save}
      onTour=${() => setShown("tour")} onHelp=${() => setShown("help")} />
    <${Fault} machine=${machine} />
    <main>
      <div class="work">
        <${Toolbar} session=${session} />
        <${CurveEditor} session=${session} live=${machine} onHelp=${() => setShown("help")} />
        <${Problems} session=${session} onPlace=${showPlace} />
      </div>
      <${Side} session=${session} machine=${machine} tab=${tab} setTab=${setTab} />
    </main>
    <footer>
      <${Transport} session=${session} machine=${machine} />
      <p id="notice" class=${notice?.isError ? "bad" : ""} role="status">${notice?.text ?? ""}</p>
    </footer>
    ${shown === "conflict" ? html`<${Conflict} session=${session} onClose=${() => setShown(null)} />` : null}
    ${shown === "help" ? html`<${Help} onClose=${() => setShown(null)} />` : null}
    ${shown === "tour" ? html`<${Tour} onEnd=${endTour} />` : null}`;
}

function hasToured() {
  try {
    return JSON.parse(localStorage.getItem("slew.studio"))?.hasToured ?? false;
  } catch {
    return false;
  }
}

async function start() {
  const worker = new Worker(new URL("./planner/worker.js", import.meta.url), { type: "module" });
  const planner = new PlannerClient(worker);
  const session = new Session(planner);
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  const machine = new Machine(`${scheme}://${location.host}/ws`, (text, isError) =>
    session.say(text, isError),
  );
  const root = document.getElementById("app");
  root.textContent = "";
  render(html`<${App} session=${session} machine=${machine} isFirst=${!hasToured()} />`, root);
  machine.start();
  try {
    await session.open();
  } catch (error) {
    session.say(`The rig and the move could not be opened: ${error.message}`, true);
  }
  // What the page's own tests read.
  window.studio = { session, machine, planner };
}

void start();
