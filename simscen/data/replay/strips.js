// Plots of signals over time, with the limits that criteria set on them.
import { el } from "./dom.js";
import { extremes, newest } from "./series.js";

export const HEIGHT = 46;
const DASHES = [[], [5, 3], [2, 2], [8, 3, 2, 3]];

/** Return the signals to show first: those with a limit, violated ones before others, and then the usual ones. */
export function firstShown(runs) {
  const bounds = runs.flatMap((run) => run.robots.flatMap((robot) => robot.limits));
  const bound = [...bounds.filter((one) => one.status !== "pass"), ...bounds.filter((one) => one.status === "pass")].map((one) => one.signal);
  const known = new Set(runs.flatMap((run) => run.robots.flatMap((robot) => [...robot.strips.keys()])));
  const counts = new Set(["collision_count", "replan_count", "recovery_count"]);
  const wanted = [...bound.filter((name) => !counts.has(name)), "speed", "clearance", "localization_error"];
  return [...new Set(wanted)].filter((name) => known.has(name)).slice(0, 4);
}

/** Plot of one signal for all robots of all runs. */
export class StripView {
  constructor(name, runs) {
    this.name = name;
    this.lines = runs.flatMap((run) => run.strip(name).map((strip) => ({ run, strip })));
    this.about = this.lines[0].strip;
    this.limits = boundsOf(name, runs);
    this.canvas = el("canvas", { class: "track", "aria-hidden": "true" });
    this.value = el("span", { class: "value" });
    const label = el("span", { class: "gutter", title: this.about.text }, el("span", { class: "name" }, name.replaceAll("_", " ")), this.value);
    this.element = el("div", { class: "row strip" }, label, this.canvas);
    this.#measure();
  }

  /** Return the text of the value of the signal at a time. */
  tell(seconds) {
    const unit = this.about.unit && !this.about.is_boolean ? ` ${this.about.unit}` : "";
    this.value.textContent = this.lines.map(({ run, strip }) => shown(strip, strip.at(run.tick(seconds)))).join(" · ") + unit;
  }

  draw(from, to, width, colors) {
    const dense = globalThis.devicePixelRatio || 1;
    if (this.canvas.width !== Math.round(width * dense)) this.canvas.width = Math.round(width * dense);
    if (this.canvas.height !== Math.round(HEIGHT * dense)) this.canvas.height = Math.round(HEIGHT * dense);
    const c = this.canvas.getContext("2d"), v = (value) => HEIGHT - 5 - ((value - this.least) / (this.most - this.least)) * (HEIGHT - 10);
    c.setTransform(dense, 0, 0, dense, 0, 0);
    c.clearRect(0, 0, width, HEIGHT);
    this.#drawLimits(c, width, v, colors);
    this.lines.forEach((line, k) => this.#drawLine(c, line, k, from, to, width, v, colors));
  }

  #measure() {
    const found = this.lines.map(({ strip }) => finiteExtremes(strip.samples)).filter(Boolean), bounds = this.limits.map((limit) => limit.value);
    const all = [...found.flatMap(({ least, most }) => [least, most]), ...bounds];
    this.least = Math.min(...all, this.about.is_boolean ? 0 : Infinity);
    this.most = Math.max(...all, this.about.is_boolean ? 1 : -Infinity);
    if (this.least > 0 && this.least < this.most / 2) this.least = 0;
    if (this.most - this.least < 1e-9) [this.least, this.most] = [this.least - 0.5, this.most + 0.5];
  }

  #drawLimits(c, width, v, colors) {
    for (const limit of this.limits) {
      const y = v(limit.value), bad = limit.status !== "pass";
      c.fillStyle = bad ? colors.bad : colors.faint;
      c.globalAlpha = bad ? 0.14 : 0.1;
      if (limit.is_minimum) c.fillRect(0, y, width, HEIGHT - y);
      else c.fillRect(0, 0, width, y);
      c.globalAlpha = 1;
      c.strokeStyle = bad ? colors.bad : colors.faint;
      c.setLineDash([4, 3]);
      c.lineWidth = 1;
      c.beginPath();
      c.moveTo(0, y);
      c.lineTo(width, y);
      c.stroke();
      c.setLineDash([]);
      c.fillStyle = c.strokeStyle;
      c.font = "10px system-ui, sans-serif";
      c.textAlign = "right";
      c.textBaseline = y < HEIGHT / 2 ? "top" : "bottom";
      c.fillText(`${limit.is_minimum ? "≥" : "≤"} ${Number(limit.value.toPrecision(3))}`, width - 3, y + (y < HEIGHT / 2 ? 2 : -1));
    }
  }

  #drawLine(c, { run, strip }, number, from, to, width, v, colors) {
    const ticks = strip.clock, values = strip.samples, begin = Math.max(newest(ticks, from * run.rate), 0);
    c.strokeStyle = number ? colors.other : colors.truth;
    c.lineWidth = 1.4;
    c.setLineDash(DASHES[number % DASHES.length]);
    c.beginPath();
    let pen = false;
    const at = (k) => ((ticks[k] / run.rate - from) / (to - from)) * width;
    for (let k = begin; k < ticks.length && at(k) <= width + 1;) {
      const column = Math.floor(at(k));
      let last = k;
      while (last + 1 < ticks.length && Math.floor(at(last + 1)) === column) last++;
      const seen = extremes(values, k, last + 1);
      if (!seen || !Number.isFinite(seen.least) || !Number.isFinite(seen.most)) pen = false;
      else {
        const ends = last > k ? (values[k] <= values[last] ? [seen.least, seen.most] : [seen.most, seen.least]) : [seen.least];
        for (const end of ends) {
          if (pen) c.lineTo(at(k), v(end));
          else c.moveTo(at(k), v(end));
          pen = true;
        }
      }
      k = last + 1;
    }
    c.stroke();
    c.setLineDash([]);
  }
}

/** Return the different limits of a signal; a limit is violated if it is violated in any run. */
function boundsOf(name, runs) {
  const found = new Map();
  for (const limit of runs.flatMap((run) => run.robots.flatMap((robot) => robot.limits))) {
    const key = `${limit.value} ${limit.is_minimum}`;
    if (limit.signal === name && (!found.has(key) || limit.status !== "pass")) found.set(key, limit);
  }
  return [...found.values()];
}

function finiteExtremes(values) {
  return extremes(values.filter(Number.isFinite), 0, values.filter(Number.isFinite).length);
}

function shown(strip, value) {
  if (strip.is_boolean) return value ? "yes" : "no";
  if (!Number.isFinite(value)) return value > 0 ? "far" : "–";
  const digits = Math.abs(value) >= 100 ? 0 : Number.isInteger(value) && !strip.unit ? 0 : 2;
  return value.toFixed(digits);
}
