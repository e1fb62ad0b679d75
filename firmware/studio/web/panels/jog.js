// Jog: an axis goes while a button is held, and at no other time.
import { html, useEffect, useState } from "../vendor/ui.js";
import { allowed } from "../live/machine.js";
import { shortNumber, withUnit } from "../model/number.js";

const shares = [1, 5, 20, 50]; // % of the velocity limit

// However the hold ends, the jog does.
function useRelease(machine) {
  useEffect(() => {
    const release = () => machine.jog.release();
    const hidden = () => document.hidden && machine.jog.release();
    const named = ["pointerup", "pointercancel", "blur", "keyup", "pagehide"];
    named.forEach((name) => window.addEventListener(name, release));
    document.addEventListener("visibilitychange", hidden);
    return () => {
      named.forEach((name) => window.removeEventListener(name, release));
      document.removeEventListener("visibilitychange", hidden);
      release();
    };
  }, [machine]);
}

function HoldButton({ machine, axis, speed, may, children, label }) {
  const press = (event) => {
    if (event.button > 0 || event.repeat) return;
    event.preventDefault();
    event.currentTarget.focus();
    machine.pressJog(axis.name, speed);
  };
  return html`<button class="jog" aria-label=${label} disabled=${!may}
    onPointerDown=${press}
    onPointerLeave=${() => machine.jog.release()}
    onContextMenu=${(event) => event.preventDefault()}
    onBlur=${() => machine.jog.release()}
    onKeyDown=${(event) => (event.key === " " || event.key === "Enter") && press(event)}
  >${children}</button>`;
}

function Row({ machine, axis, index, share, may }) {
  const at = machine.frame.value?.axes[index];
  const speed = (axis.velocity * share) / 100;
  const now = machine.jogging.value === axis.name;
  return html`<tr class=${now ? "active" : ""}>
    <th scope="row">${axis.name}</th>
    <td><${HoldButton} machine=${machine} axis=${axis} speed=${-speed} may=${may} label=${`Jog ${axis.name} down while held`}>−<//></td>
    <td class="number">${at ? `${shortNumber(at.actual.last, 2)} ${axis.unit}` : "not known"}</td>
    <td><${HoldButton} machine=${machine} axis=${axis} speed=${speed} may=${may} label=${`Jog ${axis.name} up while held`}>+<//></td>
    <td class="quiet">${withUnit(speed, axis.unit, 1)}</td>
  </tr>`;
}

export function JogPanel({ machine }) {
  const [share, setShare] = useState(5);
  useRelease(machine);
  const frame = machine.frame.value;
  const may =
    allowed(machine.state.value, {
      isHolder: machine.isHolder.value,
      isFresh: machine.isFresh.value,
    }).jog || machine.jogging.value !== null;
  const axes = machine.hello.value?.axes ?? [];
  return html`<section aria-label="Jog" class=${machine.isFresh.value ? "" : "old"}>
    <h2>Jog while held</h2>
    <div class="buttons" role="group" aria-label="Speed, of the limit">
      ${shares.map(
        (each) =>
          html`<button class="switch" aria-pressed=${each === share} onClick=${() => setShare(each)}>${each} %</button>`,
      )}
    </div>
    <table class="jog-table"><tbody>
      ${axes.map(
        (
          axis,
          index,
        ) => html`<${Row} key=${axis.name} machine=${machine} axis=${axis} index=${index} share=${share}
          may=${may && frame !== null} />`,
      )}
    </tbody></table>
    ${may ? null : html`<p class="quiet">Take control and enable the drives first.</p>`}
  </section>`;
}
