// Log of an external stack: changes of its behavior tree, and its log lines, around the shown time.
import { clockText, el, fill } from "./dom.js";
import { newest } from "./series.js";

const SIGNS_OF_STATUS = { success: "✓", failure: "✗", running: "▸", idle: "○", error: "!", warning: "!", info: "·" };
const ROWS_SHOWN = 160, ROWS_AHEAD = 30;

const KINDS = {
  steps: ["steps", (entry) => !entry.minor],
  problems: ["problems", (entry) => entry.problem],
  all: ["all", () => true],
};
const knownEntries = new WeakMap();

/** Return all log entries of the runs, sorted by time. */
export function entriesOf(runs) {
  if (knownEntries.has(runs)) return knownEntries.get(runs);
  const entries = runs.flatMap((run) => run.robots.flatMap((robot) => {
    const source = [run.letter, robot.name].filter(Boolean).join(" ");
    const lines = robot.lines.map(([tick, severity, node, text]) => ({ tick, node, status: severity, said: severity === "info" ? text : `${severity}: ${text}`, problem: severity !== "info" }));
    return [...changesOfTree(robot, run.rate), ...lines].map((entry) => ({ ...entry, run, robot, source, seconds: entry.tick / run.rate, search: `${source} ${entry.node} ${entry.said}`.toLowerCase() }));
  })).sort((a, b) => a.seconds - b.seconds);
  knownEntries.set(runs, entries);
  return entries;
}

/** Return the changes of a behavior tree, with the time that an ending node was running. Several nodes may have the same name.
 *
 * Minor are conditions, which never run, resets to idle, and what a recovery node does before it ends: it becomes idle.
 * A failure is a problem only if the node was running before, because a condition fails without running. */
function changesOfTree(robot, rate) {
  const everRun = new Set(robot.changes.filter(({ status }) => status === "running").map(({ node }) => node));
  const begun = new Map(), halted = new Map();
  const found = [];
  for (const { tick, node, before, status } of robot.changes) {
    const entry = { tick, node, status, said: status, minor: !everRun.has(node) || (status === "idle" && before !== "running") };
    const halt = before === "idle" && status !== "running" ? halted.get(node) : undefined;
    if (status === "running") begun.set(node, [...(begun.get(node) ?? []), tick]);
    if (before === "running") entry.since = begun.get(node)?.pop();
    if (halt?.tick === tick) [entry.since, halt.since, halt.said, halt.minor] = [halt.since, undefined, "idle", true];
    if (before === "running" && status === "idle") entry.said = "halted";
    halted.set(node, entry.said === "halted" ? entry : undefined);
    if (entry.since !== undefined) entry.problem = status === "failure";
    found.push(entry);
  }
  for (const entry of found) if (entry.since !== undefined) entry.took = (entry.tick - entry.since) / rate;
  return found;
}

/** Return the nodes of a behavior tree that run at a tick, in the order in which they started. */
export function runningAt(robot, tick) {
  const running = new Map();
  for (const { tick: when, node, before, status } of robot.changes) {
    if (when > tick) break;
    const number = (running.get(node) ?? 0) + (status === "running") - (before === "running");
    if (number > 0) running.set(node, number);
    else running.delete(node);
  }
  return [...running.keys()];
}

/** List that follows the shown time. A click on an entry calls `seek` with its time in s. */
export class StackLog {
  constructor(runs, seek) {
    this.runs = runs;
    this.seek = seek;
    this.entries = entriesOf(runs);
    this.allTimes = this.entries.map((entry) => entry.seconds);
    this.filter = el("input", { type: "search", placeholder: "Filter: Spin failure", "aria-label": "Filter the log", oninput: () => this.#choose() });
    const kinds = Object.entries(KINDS).map(([value, [name]]) => el("option", { value }, name));
    this.kind = el("select", { "aria-label": "Entries to show", onchange: () => this.#choose() }, ...kinds);
    this.count = el("span", { class: "quiet", role: "status" });
    this.running = el("div", { class: "running-now" });
    this.list = el("ol", { class: "events", onkeydown: (event) => this.#key(event) });
    this.elements = [el("div", { class: "bar" }, this.filter, this.kind, this.count, this.running), this.list];
    this.#pick();
  }

  /** Show the entries around a time. */
  tell(seconds) {
    this.time = seconds;
    this.#tellRunning(seconds);
    const at = newest(this.times, seconds + 1e-9);
    if (at === this.at) return;
    this.at = at;
    const isNear = this.begin !== undefined && at >= this.begin + (this.begin ? ROWS_AHEAD : 0) && at < this.end - (this.end < this.shown.length ? ROWS_AHEAD : 0);
    if (!isNear) this.#show(at);
    this.#mark();
  }

  /** Show which nodes run, if this may have changed. */
  #tellRunning(seconds) {
    const passed = newest(this.allTimes, seconds + 1e-9);
    if (passed === this.passed) return;
    this.passed = passed;
    fill(this.running, ...this.runs.flatMap((run) => run.robots.map((robot) => this.#runningText(run, robot, run.tick(seconds)))));
  }

  #runningText(run, robot, tick) {
    const nodes = runningAt(robot, tick), whose = [run.letter, robot.name].filter(Boolean).join(" ");
    if (!robot.changes.length) return null;
    return el("p", {}, el("span", { class: "quiet" }, whose ? `${whose} running now: ` : "Running now: "), nodes.length ? nodes.join(" · ") : "nothing");
  }

  /** Show the entries that match the filter, around the shown time. */
  #choose() {
    this.#pick();
    [this.at, this.begin] = [undefined, undefined];
    this.tell(this.time ?? 0);
  }

  #pick() {
    const words = this.filter.value.toLowerCase().split(/\s+/).filter(Boolean);
    const [, belongs] = KINDS[this.kind.value];
    const found = this.entries.filter((entry) => belongs(entry) && words.every((word) => entry.search.includes(word)));
    this.shown = joined(found);
    this.times = this.shown.map((entry) => entry.seconds);
    this.count.textContent = `${found.length} of ${this.entries.length}`;
  }

  /** Make the rows around an entry. The focused entry keeps the focus. */
  #show(middle) {
    const focused = this.list.contains(document.activeElement) ? document.activeElement.closest("li").dataset.k : null;
    this.begin = Math.max(0, Math.min(middle - ROWS_SHOWN / 2, this.shown.length - ROWS_SHOWN));
    this.end = Math.min(this.shown.length, this.begin + ROWS_SHOWN);
    const rows = this.shown.slice(this.begin, this.end).map((entry, k) => this.#row(entry, this.begin + k));
    const more = (count, text, to) => (count ? el("li", {}, el("button", { type: "button", class: "event more", onclick: () => this.#focus(to) }, `${count} ${text}`)) : null);
    fill(this.list, more(this.begin, "earlier", this.begin - 1), ...rows, more(this.shown.length - this.end, "later", this.end));
    if (!this.shown.length) fill(this.list, el("li", { class: "quiet" }, "Nothing matches."));
    if (focused !== null) this.list.querySelector(`li[data-k="${focused}"] button`)?.focus({ preventScroll: true });
  }

  #row(entry, k) {
    return el("li", { "data-k": k }, el("button", { type: "button", class: `event of-stack ${entry.status}`, onclick: () => this.seek(entry.seconds) },
      el("span", { class: "when" }, clockText(entry.seconds)),
      el("span", { class: "mark", "aria-hidden": "true" }, SIGNS_OF_STATUS[entry.status] ?? "·"),
      el("span", {}, entry.source ? el("span", { class: "quiet" }, `${entry.source} `) : null, el("b", {}, entry.node), ` ${entry.said}${entry.times > 1 ? ` ×${entry.times}` : ""}`),
      entry.took ? el("span", { class: "took", title: "how long it ran" }, clockText(entry.took)) : null));
  }

  /** Highlight the newest entries, and scroll to them. */
  #mark(scroll = true) {
    const newestTime = this.times[this.at];
    let last = null;
    for (const row of this.list.children) {
      const k = Number(row.dataset.k), lit = k <= this.at && this.times[k] === newestTime;
      row.classList.toggle("lit", lit);
      if (lit) row.setAttribute("aria-current", "true");
      else row.removeAttribute("aria-current");
      if (lit) last = row;
    }
    if (scroll) this.#reveal(last ?? this.list.firstElementChild);
  }

  /** Scroll only the list, not the page, so that a row is visible below the bar. */
  #reveal(row) {
    const box = this.list.parentElement;
    if (!row || !box || box.hidden) return;
    const inner = row.getBoundingClientRect(), outer = box.getBoundingClientRect(), top = outer.top + this.elements[0].offsetHeight;
    if (inner.top >= top && inner.bottom <= outer.bottom) return;
    box.scrollTop += inner.top - top - Math.max(outer.bottom - top - inner.height, 0) / 2;
  }

  /** Move the focus with the up and down keys, also beyond the rows that are shown. */
  #key(event) {
    const step = { ArrowUp: -1, ArrowDown: 1 }[event.key], here = event.target.closest("li")?.dataset.k;
    if (!step || here === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    const next = Number(here) + step;
    if (next < 0 || next >= this.shown.length) return;
    this.#focus(next);
  }

  /** Move the focus to an entry, and make the rows around it if they do not exist. */
  #focus(k) {
    if (k < this.begin || k >= this.end) {
      this.#show(k);
      this.#mark(false);
    }
    const row = this.list.querySelector(`li[data-k="${k}"]`);
    row.firstElementChild.focus({ preventScroll: true });
    this.#reveal(row);
  }
}

/** Return the entries, in which successive equal entries at the same time are joined. */
function joined(entries) {
  const found = [];
  for (const entry of entries) {
    const last = found.at(-1);
    if (last && last.seconds === entry.seconds && last.search === entry.search) found[found.length - 1] = { ...entry, times: last.times + 1 };
    else found.push({ ...entry, times: 1 });
  }
  return found;
}
