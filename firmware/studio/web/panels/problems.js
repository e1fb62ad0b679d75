// What is wrong, at the key or line that it belongs to, and how it is made to fit.
import { html, useState } from "../vendor/ui.js";
import { select } from "../model/keys.js";
import { withUnit } from "../model/number.js";

function goTo(session, violation) {
  const axis = session.axes.value[violation.axis];
  session.active.value = axis.name;
  session.playhead.value = violation.time_s;
  if (violation.key !== undefined)
    session.selection.value = select(new Map(), [{ axis: axis.name, key: violation.key }], "set");
  const { from, to } = session.view.value;
  const half = Math.min((to - from) / 2, 2);
  void session.look({ from: violation.time_s - half, to: violation.time_s + half });
}

function Violation({ session, violation }) {
  const axis = session.axes.value[violation.axis];
  if (axis === undefined) return null;
  return html`<li>
    <button class="link-like" onClick=${() => goTo(session, violation)}>
      ${axis.name}: ${violation.kind} ${withUnit(violation.value, axis.unit, violation.order)} at
      ${" "}${violation.time_s.toFixed(2)} s, limit ${withUnit(violation.limit, axis.unit, violation.order)}
      ${violation.line ? ` (line ${violation.line})` : ""}
    </button>
  </li>`;
}

function Fit({ session }) {
  const [tolerance, setTolerance] = useState("1 mm, 0.5 deg");
  const busy = session.isPlanning.value;
  return html`<div class="fit">
    <span>Make it fit:</span>
    <button disabled=${busy} onClick=${() => session.fit("local", "")} title="Only the spans that need it become longer">Local stretch</button>
    <button disabled=${busy} onClick=${() => session.fit("stretch", "")} title="All spans become longer by the smallest factor that fits">Stretch all</button>
    <button disabled=${busy} onClick=${() => session.fit("smooth", tolerance)} title="Keys move by so much at most; times stay">Smooth</button>
    <label>by at most <input size="12" value=${tolerance} onInput=${(event) => setTolerance(event.target.value)} /></label>
  </div>`;
}

const most = 50;

export function Problems({ session, onPlace }) {
  const messages = session.report.value?.messages ?? [];
  const violations = session.isBroken.value ? [] : session.violations.value;
  const isFine = messages.length === 0 && violations.length === 0;
  return html`<section class="problems" aria-label="Problems" aria-live="polite">
    <h2>${session.isBroken.value ? "This text cannot be played" : violations.length > 0 ? `${violations.length} limits broken` : isFine ? "Inside all limits" : "Notes"}</h2>
    ${violations.length > 0 ? html`<${Fit} session=${session} />` : null}
    <ul>
      ${messages.map(
        (message) => html`<li class=${message.kind === "error" ? "bad" : "warning"}>
          ${
            message.line
              ? html`<button class="link-like" onClick=${() => onPlace(message)}>${message.text}</button>`
              : message.text
          }
        </li>`,
      )}
      ${violations.slice(0, most).map((violation) => html`<${Violation} session=${session} violation=${violation} />`)}
      ${violations.length > most ? html`<li class="quiet">and ${violations.length - most} more</li>` : null}
    </ul>
  </section>`;
}
