// The keys, and the window that lists them.
import { el } from "./dom.js";

export const KEYS = [
  ["space", "play, pause"],
  ["← →", "0.1 s back, on; with Shift 1 s; on the map: move it"],
  [", .", "one sample back, on"],
  ["p n", "previous, next event"],
  ["f", "next failure"],
  ["Home End", "start, end"],
  ["< >", "slower, faster"],
  ["+ − 0", "map nearer, further, all of it"],
  ["c", "map follows the robot"],
  ["[ ] \\", "timeline: shorter stretch, longer, all"],
  ["1 … 9 0 l with Alt", "layers on the map"],
  ["s w e", "scenario, now, events"],
  ["d", "dark, light"],
  ["?", "this list"],
];

/** A dialog with all keys. */
export function helpWindow() {
  const rows = KEYS.map(([keys, does]) => el("tr", {}, el("th", { scope: "row" }, ...keys.split(" ").flatMap((key) => [el("kbd", {}, key), " "])), el("td", {}, does)));
  const dialog = el("dialog", { class: "help", "aria-labelledby": "help-title" },
    el("h2", { id: "help-title" }, "Keys"), el("table", {}, el("tbody", {}, ...rows)),
    el("p", { class: "quiet" }, "Wheel or pinch zooms the map, dragging moves it. The wheel over the timeline zooms time. The address of this page names the moment that is shown."),
    el("form", { method: "dialog" }, el("button", {}, "Close")));
  dialog.querySelector("form").addEventListener("submit", (event) => {
    event.preventDefault();
    dialog.close();
  });
  return dialog;
}
