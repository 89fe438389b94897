// Keyboard shortcuts, and the dialog that lists them.
import { el } from "./dom.js";

export const KEYS = [
  ["space", "play, pause"],
  ["← →", "0.1 s back, forward; with Shift 1 s; on the map: move it"],
  [", .", "one sample back, forward"],
  ["p n", "previous, next event"],
  ["f", "next failure"],
  ["Home End", "start, end"],
  ["< >", "slower, faster"],
  ["+ − 0", "zoom in, zoom out, show the whole map"],
  ["c", "keep the robot in view"],
  ["[ ] \\", "timeline: zoom in, zoom out, show all"],
  ["1 … 9 0 l with Alt", "toggle map layers"],
  ["s w e", "scenario, current values, events"],
  ["l m", "log and parameters of an external stack, if there are any"],
  ["d", "dark or light theme"],
  ["?", "this list"],
];

/** Return a dialog with all keyboard shortcuts. */
export function helpWindow() {
  const rows = KEYS.map(([keys, does]) => el("tr", {}, el("th", { scope: "row" }, ...keys.split(" ").flatMap((key) => [el("kbd", {}, key), " "])), el("td", {}, does)));
  const dialog = el("dialog", { class: "help", "aria-labelledby": "help-title" },
    el("h2", { id: "help-title" }, "Keys"), el("table", {}, el("tbody", {}, ...rows)),
    el("p", { class: "quiet" }, "Scroll or pinch to zoom the map, drag to move it. Scroll over the timeline to zoom in time. The URL of this page contains the displayed time."),
    el("form", { method: "dialog" }, el("button", {}, "Close")));
  dialog.querySelector("form").addEventListener("submit", (event) => {
    event.preventDefault();
    dialog.close();
  });
  return dialog;
}
