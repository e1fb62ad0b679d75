// The list of keys, and the tour of the first minutes.
import { html, useEffect, useRef, useState } from "../vendor/ui.js";
import { everywhere, shortcuts } from "../curve/keyboard.js";

function Dialog({ label, onClose, children }) {
  const dialog = useRef(null);
  useEffect(() => dialog.current.showModal(), []);
  return html`<dialog ref=${dialog} aria-label=${label} onClose=${onClose}>${children}
    <form method="dialog"><button class="primary">Close</button></form>
  </dialog>`;
}

export function Help({ onClose }) {
  return html`<${Dialog} label="Keys" onClose=${onClose}>
    <h2>Keys of the curve editor</h2>
    <table class="keys"><tbody>
      ${[...shortcuts, ...everywhere].map(([keys, , text]) => html`<tr><th scope="row"><kbd>${keys}</kbd></th><td>${text}</td></tr>`)}
    </tbody></table>
    <h2>Pointer</h2>
    <ul>
      <li>Drag a key; Shift is fine, Ctrl does not snap, X or Y locks a direction, Escape calls it off.</li>
      <li>Drag on nothing draws a box; Shift adds to what is selected. A double click adds a key.</li>
      <li>Wheel zooms time, Ctrl and wheel zooms values, Shift and wheel goes along; Alt drags the view.</li>
      <li>Fingers: one drags a key or the view, two pinch, a long press draws a box.</li>
    </ul>
  <//>`;
}

const steps = [
  [
    ".curve-canvas",
    "Curves",
    "Every axis over time: position on top, then velocity, acceleration and jerk with their limits. This is what the servo gets, to the bit. Drag a key.",
  ],
  [
    ".problems",
    "Limits",
    "A broken limit is named here, at its key. “Make it fit” finds times that fit.",
  ],
  [
    ".side",
    "Keys and text",
    "Exact numbers with their units, and the text of the move. Every drag changes this text, and nothing else in it.",
  ],
  [
    ".transport",
    "The machine",
    "Take control, enable, load, go to start, start. With a simulated rig nothing real moves.",
  ],
  [
    ".stop",
    "Stop",
    "Always here. Every motion comes to rest along its path. It is no certified emergency stop.",
  ],
];

export function Tour({ onEnd }) {
  const [step, setStep] = useState(0);
  const next = useRef(null);
  const [selector, title, text] = steps[step];
  useEffect(() => {
    const target = document.querySelector(selector);
    target?.classList.add("pointed-at");
    next.current?.focus();
    return () => target?.classList.remove("pointed-at");
  }, [step]);
  const isLast = step === steps.length - 1;
  return html`<aside class="tour" role="dialog" aria-label="Tour" onKeyDown=${(event) => event.key === "Escape" && onEnd()}>
    <p class="quiet">${step + 1} of ${steps.length}</p>
    <h2>${title}</h2>
    <p>${text}</p>
    <div class="buttons">
      <button ref=${next} class="primary" onClick=${() => (isLast ? onEnd() : setStep(step + 1))}>${isLast ? "Begin" : "Next"}</button>
      ${isLast ? null : html`<button onClick=${onEnd}>Skip</button>`}
    </div>
  </aside>`;
}
