// Drives, buses and lines in words, and how old what is shown is.
import { html, useEffect, useState } from "../vendor/ui.js";
import { adviceFor } from "../live/faults.js";
import { shortNumber } from "../model/number.js";

// What a drive says, in words, with what to do about it.
function Says({ axis }) {
  const switches = [
    axis.limit_negative ? "lower limit switch" : "",
    axis.limit_positive ? "upper limit switch" : "",
    axis.home_switch ? "home switch" : "",
  ].filter((text) => text !== "");
  const words = [axis.statusword_text ?? "", ...switches].filter((text) => text !== "");
  return html`<tr>
    <td colspan="5" class=${axis.error ? "bad" : "quiet"}>
      ${axis.error ? `${axis.error}. ${adviceFor("DRIVE")} ` : ""}${words.join(", ")}
    </td>
  </tr>`;
}

function DriveRow({ axis, at, unit }) {
  const known = at?.known ?? false;
  const torque = at?.torque ?? null;
  return html`<tr class=${axis.error ? "bad" : ""}>
      <th scope="row">${axis.name}</th>
      <td>${axis.drive}${axis.homed ? "" : ", not homed"}</td>
      <td class="number">${known ? `${shortNumber(at.actual.last, 3)} ${unit}` : "not known"}</td>
      <td class="number">${known ? `${shortNumber(at.error.last, 3)} ${unit}` : ""}</td>
      <td class="number">${torque === null ? "–" : `${shortNumber(torque, 0)} %`}</td>
    </tr>
    <${Says} axis=${axis} />`;
}

function Buses({ status, loads }) {
  return html`<ul class="buses">
    ${(status.buses ?? []).map(
      (bus, i) => html`<li>
        ${bus.name}${bus.state ? `: ${bus.state}` : ""}
        <meter min="0" max="1" high="0.8" value=${loads[i] ?? 0} aria-label=${`Load of ${bus.name}`}></meter>
        ${loads[i] === null || loads[i] === undefined ? "" : `${Math.round(100 * loads[i])} %`}
        ${bus.errors > 0 ? html`<span class="bad"> ${bus.errors} errors</span>` : ""}
        ${(bus.says ?? []).map((text) => html`<div>${text}</div>`)}
      </li>`,
    )}
  </ul>`;
}

function Lines({ status }) {
  const lines = status.lines ?? [];
  if (lines.length === 0) return null;
  const text = (line) =>
    line.active === null ? "cannot be read" : line.active ? "active" : "not active";
  return html`<h3>Inputs and triggers</h3>
    <ul class="lines">
      ${lines.map((line) => html`<li class=${line.active ? "on" : ""}>${line.name} (${line.kind}): ${text(line)}</li>`)}
    </ul>`;
}

function Age({ machine }) {
  const [, tick] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => tick((n) => n + 1), 500);
    return () => clearInterval(timer);
  }, []);
  if (machine.isFresh.value) return null;
  const heard = machine.heardAt.value;
  return html`<p class="bad" role="status">
    ${heard === 0 ? "Nothing was heard of the machine yet." : `Old: last heard ${Math.round((Date.now() - heard) / 1000)} s ago.`}
  </p>`;
}

export function Drives({ machine }) {
  const status = machine.status.value;
  const frame = machine.frame.value;
  const units = machine.hello.value?.axes ?? [];
  return html`<section aria-label="Drives" class=${machine.isFresh.value ? "" : "old"}>
    <h2>Drives</h2>
    <${Age} machine=${machine} />
    ${
      status === null
        ? null
        : html`<table class="drives">
          <thead><tr><th>axis</th><th>drive</th><th>position</th><th>following error</th><th>torque</th></tr></thead>
          <tbody>
            ${status.axes.map(
              (axis, i) =>
                html`<${DriveRow} key=${axis.name} axis=${axis} at=${frame?.axes[i]} unit=${units[i]?.unit ?? ""} />`,
            )}
          </tbody>
        </table>
        <h3>Buses</h3>
        <${Buses} status=${status} loads=${machine.loads.value} />
        <${Lines} status=${status} />
        <p class="quiet">
          Tick: ${frame ? `${frame.ticksLost} lost, latest wake-up ${shortNumber(frame.latestUs, 0)} µs` : ""}
        </p>`
    }
  </section>`;
}
