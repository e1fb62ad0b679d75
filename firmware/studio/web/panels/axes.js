// The axes of the move: which are seen, which is edited, by which curve.
import { html, useMemo } from "../vendor/ui.js";
import { Choice } from "./inspector.js";

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
  const compared = session.compared.value;
  const isHere = compared?.axis === axis.name;
  const others = useMemo(
    () => session.curves.filter((curve) => curve !== axis.curve),
    [session.curves, axis.curve],
  );
  return html`<div class="fields">
    <${Choice} label="Curve" value=${axis.curve} names=${session.curves} onChoose=${(curve) =>
      session.edit([{ op: "curve", axis: axis.name, curve }], `Curve: ${curve}`)} />
    <${Choice} label="Compare with" value=${isHere ? compared.curve : ""} names=${others} none="nothing"
      onChoose=${(curve) => session.compare(axis.name, curve)} />
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
    ${axis?.isKeyed && !axis.isOther ? html`<${CurveChoice} session=${session} axis=${axis} />` : null}
  </section>`;
}
