// List of all objects as buttons, grouped by kind.

import { el, fill } from "./dom.js";

const GROUPS = [["Scenario", ["settings"]], ["Robots", ["robot", "estimate"]], ["Goals", ["goal"]], ["People", ["person"]], ["Objects of events", ["spawn", "teleport", "kidnap", "action"]],
  ["Triggers", ["trigger"]], ["Zones", ["keepout", "speed zone"]], ["Events", ["event"]], ["Faults", ["fault"]], ["Criteria", ["criterion"]], ["Places", ["place"]], ["Regions", ["region"]],
  ["Doors", ["door"]], ["Paths", ["path"]], ["Objects of the world", ["object"]], ["Obstacles", ["obstacle"]], ["Ramps", ["ramp"]], ["Walls", ["wall"]]];

/** Return the position of an object for its button, such as " at 3.00, 2.00". */
export function positionText(one) {
  const handle = one.handles[0];
  if (!handle) return one.region ? ` in ${one.region}` : "";
  const turn = handle.yaw === null ? "" : `, ${Math.round((handle.yaw * 180) / Math.PI)}°`;
  return ` at ${handle.x.toFixed(2)}, ${handle.y.toFixed(2)}${turn}`;
}

export class ObjectList {
  constructor(element, select) {
    this.element = element;
    this.select = select;
    this.shown = "";
  }

  show(scene, selected, bad) {
    const groups = GROUPS.map(([title, kinds]) => [title, scene.objects.filter((one) => kinds.includes(one.kind))]).filter(([, found]) => found.length);
    const state = JSON.stringify([groups.map(([title, found]) => [title, found.map((one) => [one.id, one.label, positionText(one), one.editable])]), selected, [...bad]]);
    if (state === this.shown) return;
    this.shown = state;
    const focused = this.element.contains(document.activeElement) ? document.activeElement.dataset.id : null;
    const file = scene.world_file;
    fill(this.element, ...groups.flatMap(([title, found]) => [el("h3", {}, title + (file && !found[0].editable ? ` (in ${file})` : "")), ...found.map((one) => this.button(one, selected, bad, file))]));
    if (focused !== null) this.focus(focused);
  }

  focus(id) {
    [...this.element.querySelectorAll("button")].find((one) => one.dataset.id === id)?.focus();
  }

  button(one, selected, bad, file) {
    const problem = bad.get(one.id), where = one.editable ? "" : `; written in ${file || "another file"}`;
    const name = `${one.label}${positionText(one)}${problem ? `; ${problem}` : ""}${where}`;
    return el("button", { "data-id": one.id, "aria-label": name, "aria-pressed": one.id === selected ? "true" : "false", class: one.editable ? null : "elsewhere", onclick: () => this.select(one.id) },
      problem ? el("span", { class: "bad", "aria-hidden": "true" }, "⚠ ") : null, one.label);
  }
}
