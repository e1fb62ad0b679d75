// The axes of the move: which are seen, which is edited, by which curve.
import { html } from "../vendor/ui.js";

const drivers = {
  path: "by the path",
  camera: "by the camera",
  blend: "by poses",
  timing: "by its timing",
};

function toggleHidden(session, name) {
  const hidden = new Set(session.hidden.value);
  if (!hidden.delete(name)) hidden.add(name);
  session.hidden.value = hidden;
}

function AxisRow({ session, axis }) {
  const isActive = session.activeAxis.value?.name === axis.name;
  const broken = session.violations.value.filter((each) => each.axis === axis.index).length;
  return html`<li class=${isActive ? "axis active" : "axis"}>
    <input type="checkbox" aria-label=${`Show ${axis.name}`} checked=${!session.hidden.value.has(axis.name)}
      onChange=${() => toggleHidden(session, axis.name)} />
    <span class=${`swatch colour-${axis.colour}`} aria-hidden="true"></span>
    <button class="name" aria-pressed=${isActive} onClick=${() => (session.active.value = axis.name)}>
      ${axis.name}
    </button>
    <span class="quiet">${axis.isKeyed ? `${axis.keys.length} keys` : (drivers[axis.driver] ?? axis.driver)}</span>
    ${broken > 0 ? html`<span class="bad" title="limits broken">${broken} ✕</span>` : null}
  </li>`;
}

function CurveChoice({ session, axis }) {
  const curves = session.words?.curves ?? [];
  const compared = session.compared.value;
  const isHere = compared?.axis === axis.name;
  return html`<div class="fields">
    <label>Curve
      <select value=${axis.curve} onChange=${(event) =>
        session.edit(
          [{ op: "curve", axis: axis.name, curve: event.target.value }],
          `Curve: ${event.target.value}`,
        )}>
        ${curves.map((curve) => html`<option value=${curve} selected=${curve === axis.curve}>${curve}</option>`)}
      </select>
    </label>
    <label>Compare with
      <select value=${isHere ? compared.curve : ""} onChange=${(event) => session.compare(axis.name, event.target.value)}>
        <option value="">nothing</option>
        ${curves.filter((curve) => curve !== axis.curve).map((curve) => html`<option value=${curve}>${curve}</option>`)}
      </select>
    </label>
    ${
      isHere
        ? html`<p class=${compared.error ? "bad" : "quiet"}>
          ${compared.error ?? `dashed: ${compared.curve}, ${compared.broken === 0 ? "inside all limits" : `${compared.broken} limits broken`}`}
        </p>`
        : null
    }
  </div>`;
}

export function Axes({ session }) {
  const axis = session.activeAxis.value;
  return html`<section aria-label="Axes">
    <h2>Axes</h2>
    <ul class="axes">
      ${session.axes.value.map((each) => html`<${AxisRow} key=${each.name} session=${session} axis=${each} />`)}
    </ul>
    ${axis?.isKeyed ? html`<${CurveChoice} session=${session} axis=${axis} />` : null}
  </section>`;
}
