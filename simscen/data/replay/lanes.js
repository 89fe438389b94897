// Timeline: lanes with the events of the run, one lane for each kind of event.
import { clockText, el, fill, svg } from "./dom.js";
import { entriesOf } from "./stacklog.js";

export const LANES = [
  { id: "goals", name: "Goals" },
  { id: "events", name: "Events" },
  { id: "faults", name: "Faults" },
  { id: "plans", name: "Plans" },
  { id: "recoveries", name: "Recoveries" },
  { id: "stack", name: "Stack log" },
  { id: "failures", name: "Failures" },
];
const QUIET = new Set(["goal.reached", "goal.passed", "goal.canceled", "recovery.ended", "collision.ended", "fault.ended",
  "fault.took_effect", "event.ended", "object.moved"]);

/** Return the text of an event in a list: the last word of its kind, its name, and its details. */
export function told(event) {
  return [event.kind.replace(".", " ").replace("_", " "), event.name].filter(Boolean).join(" ");
}

/** Return whether an event has a mark of its own. An event that only ends an interval has none. */
export function isShown(event) {
  return !QUIET.has(event.kind);
}

/** Lanes of one run or two. A click on an entry calls `chosen` with it, a click on the log calls `showLog` with the time in s. */
export class Lanes {
  constructor(runs, chosen, showLog) {
    this.runs = runs;
    this.chosen = chosen;
    this.showLog = showLog;
    this.problems = entriesOf(runs).filter((entry) => entry.problem);
    this.groups = runs.flatMap((run) => run.robots.map((robot, number) => ({ run, robot: robot.name, first: number === 0 })));
    this.row = this.groups.length > 1 ? 14 : 18;
    this.rows = LANES.filter((lane) => lane.id === "failures" || (lane.id === "stack" && this.problems.length) || runs.some((run) => run.events.some((event) => event.lane === lane.id && isShown(event))));
    this.tracks = this.rows.map(() => svg("svg", { class: "track", height: this.row * this.groups.length, "aria-hidden": "true" }));
    this.element = el("div", { class: "lanes" }, ...this.rows.map((lane, k) => el("div", { class: "row" }, el("span", { class: "gutter" }, lane.name), runs.length > 1 ? letters(runs) : null, this.tracks[k])));
  }

  /** Draw the lanes again for the time span [from, to] in seconds. */
  layOut(from, to, width, selected) {
    this.tracks.forEach((track, k) => {
      const at = (seconds) => ((seconds - from) / (to - from)) * width;
      const signs = this.groups.flatMap((group, number) => this.#signs(group, this.rows[k].id, at, number * this.row, width, selected));
      fill(track, ...signs);
    });
  }

  /** Return the entries of a robot. Events of the world, which have no robot, are in the row of the first robot. */
  #signs({ run, robot, first }, lane, at, top, width, selected) {
    const mine = (whose) => (whose ?? "") === robot || (first && !whose);
    const events = run.events.filter((event) => event.lane === lane && isShown(event) && mine(event.robot)).map((event) => this.#event(run, event, at, top, width, selected));
    const failures = lane === "failures" ? run.failures.filter(({ verdict }) => mine(verdict.robot)).map((failure) => this.#failure(run, failure, at, top, width, selected)) : [];
    const problems = lane === "stack" ? this.#problems(run, robot, at, top, width) : [];
    return [...events, ...failures, ...problems].filter(Boolean);
  }

  /** Draw the failures of a behavior tree, errors, and warnings; of several at the same pixel, only the first. */
  #problems(run, robot, at, top, width) {
    const places = new Map();
    for (const entry of this.problems) {
      const u = at(entry.seconds), place = `${Math.round(u / 4)} ${entry.status === "warning"}`;
      if (entry.run === run && entry.robot.name === robot && u >= -8 && u <= width + 8) places.set(place, [...(places.get(place) ?? []), entry]);
    }
    return [...places.values()].map((entries) => {
      const u = at(entries[0].seconds), v = top + this.row / 2, isWarning = entries[0].status === "warning";
      const texts = entries.slice(0, 5).map((entry) => `${entry.node} ${entry.said}, ${clockText(entry.seconds)}`);
      const more = entries.length > texts.length ? [`${entries.length - texts.length} more`] : [];
      return svg("g", { class: `sign stack ${isWarning ? "odd" : "bad"}`, onclick: () => this.showLog(entries[0].seconds) }, svg("title", {}, [...texts, ...more].join("\n")), isWarning ? sign({ lane: "stack" }, u, v) : cross(u, v));
    });
  }

  #event(run, event, at, top, width, selected) {
    const lasts = event.until > event.tick, begin = at(event.tick / run.rate), end = lasts ? at(event.until / run.rate) : begin;
    if (end < -8 || begin > width + 8) return null;
    const lit = selected?.kind === "e" && selected.number === event.number && selected.run === run;
    const text = `${told(event)}, ${clockText(event.tick / run.rate)}${lasts ? ` to ${clockText(event.until / run.rate)}` : ""}${event.text ? `\n${event.text}` : ""}`;
    const look = `sign ${event.lane}${event.bad || event.ended === "goal.failed" ? " bad" : ""}${lit ? " lit" : ""}`;
    const choose = () => this.chosen(run, { kind: "e", number: event.number });
    if (!lasts) return svg("g", { class: look, onclick: choose }, svg("title", {}, text), sign(event, begin, top + this.row / 2));
    const wide = Math.max(end - begin, 3), name = event.robot ? `${event.robot}: ${event.name}` : event.name;
    const shown = wide > 8 * name.length * 0.85 + 8 ? svg("text", { x: Math.max(begin, 0) + 6, y: top + this.row / 2 + 4 }, name) : null;
    return svg("g", { class: look, onclick: choose }, svg("title", {}, text), svg("rect", { x: begin, y: top + 2, width: wide, height: this.row - 4, rx: 3 }), shown);
  }

  #failure(run, { verdict, finding }, at, top, width, selected) {
    if (finding.tick === null) return null;
    const u = at(finding.tick / run.rate), lit = selected?.kind === "v" && selected.number === verdict.number && selected.run === run;
    if (u < -8 || u > width + 8) return null;
    const text = `${finding.what}: ${finding.said}, ${clockText(finding.tick / run.rate)}`;
    const look = `sign failures ${verdict.severity === "warn" ? "odd" : "bad"}${lit ? " lit" : ""}`;
    const choose = () => this.chosen(run, { kind: "v", number: verdict.number });
    return svg("g", { class: look, onclick: choose }, svg("title", {}, text), cross(u, top + this.row / 2));
  }
}

/** Return the letters of the runs, which label the rows of a lane. */
function letters(runs) {
  return el("span", { class: "letters", "aria-hidden": "true" }, ...runs.map((run) => el("span", {}, run.letter)));
}

function sign(event, u, v) {
  if (event.bad) return cross(u, v);
  if (event.lane === "plans") return svg("path", { d: `M${u - 4} ${v + 4}L${u} ${v - 5}L${u + 4} ${v + 4}Z` });
  return svg("path", { d: `M${u} ${v - 5}L${u + 5} ${v}L${u} ${v + 5}L${u - 5} ${v}Z` });
}

function cross(u, v) {
  return svg("path", { class: "cross", d: `M${u - 4} ${v - 4}L${u + 4} ${v + 4}M${u - 4} ${v + 4}L${u + 4} ${v - 4}` });
}
