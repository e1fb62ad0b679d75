// Switches of the curve editor.
import { html } from "../vendor/ui.js";
import { act } from "../curve/actions.js";
import { remember } from "../model/session.js";
import { timeText } from "../model/number.js";

const snaps = [
  ["frame", "frames"],
  ["second", "seconds"],
  ["marker", "events"],
  ["playhead", "playhead"],
  ["key", "keys"],
];

function Switch({ isOn, onFlip, title, children }) {
  return html`<button class="switch" aria-pressed=${isOn} title=${title} onClick=${onFlip}>${children}</button>`;
}

function flip(session, name) {
  session[name].value = !session[name].value;
  remember({ [name]: session[name].value });
}

export function Toolbar({ session }) {
  const snapping = session.snapping.value;
  const setSnap = (name) => {
    session.snapping.value = { ...snapping, [name]: !snapping[name] };
    remember({ snapping: session.snapping.value });
  };
  const fps = session.fps.value;
  const playhead = session.playhead.value;
  return html`<div class="toolbar" role="toolbar" aria-label="Curve editor">
    <button onClick=${() => act(session, "to-start")} >To start</button>
    <button onClick=${() => act(session, "preview")} title="Run the playhead here; the machine stays">Preview</button>
    <output class="time" aria-label="Playhead">${timeText(playhead, session.inFrames.value ? fps : null)}</output>
    <button onClick=${() => act(session, "add")}>+ Key</button>
    <${Switch} isOn=${session.isRippling.value} title="All keys after go along" onFlip=${() => act(session, "ripple")}>Ripple<//>
    <${Switch} isOn=${session.isNormalised.value} title="Every axis fills the height" onFlip=${() => flip(session, "isNormalised")}>Normalised<//>
    ${fps ? html`<${Switch} isOn=${session.inFrames.value} title=${`Times in frames at ${fps} per second`} onFlip=${() => flip(session, "inFrames")}>Frames<//>` : null}
    <button onClick=${() => session.showAll()}>Show all</button>
    <span class="group" role="group" aria-label="Snap to">snap:
      ${snaps.map(
        ([name, text]) =>
          html`<${Switch} isOn=${snapping[name]} title=${`Snap to ${text}`} onFlip=${() => setSnap(name)}>${text}<//>`,
      )}
    </span>
  </div>`;
}
