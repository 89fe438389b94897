// Icons of buttons, which are drawn, because fonts lack some of the symbols.
import { svg } from "./dom.js";

const PATHS = {
  play: "M4 2.5v11l9-5.5Z",
  pause: "M3.5 2.5h3v11h-3ZM9.5 2.5h3v11h-3Z",
  start: "M2.5 2.5h2v11h-2ZM13.5 2.5v11l-8-5.5Z",
  end: "M11.5 2.5h2v11h-2ZM2.5 2.5v11l8-5.5Z",
  previous: "M8 2.5v11l-6.5-5.5ZM14.5 2.5v11l-6.5-5.5Z",
  next: "M8 2.5v11l6.5-5.5ZM1.5 2.5v11l6.5-5.5Z",
  back: "M11 3v10l-6-5Z",
  on: "M5 3v10l6-5Z",
  failure: "M3.2 1.8 8 6.6l4.8-4.8 1.4 1.4L9.4 8l4.8 4.8-1.4 1.4L8 9.4l-4.8 4.8-1.4-1.4L6.6 8 1.8 3.2Z",
  theme: "M8 1.5a6.5 6.5 0 1 0 0 13a6.5 6.5 0 1 0 0-13ZM8 3.3v9.4a4.7 4.7 0 1 1 0-9.4Z",
};

/** Return an icon of 16 by 16 pixels. */
export function icon(name) {
  return svg("svg", { class: "icon", viewBox: "0 0 16 16", width: 16, height: 16, "aria-hidden": "true", focusable: "false" }, svg("path", { d: PATHS[name], "fill-rule": "evenodd" }));
}
