// Panel beside the map: verdicts, the present state, the text of the scenario, and all events.
import { clockText, el, fill } from "./dom.js";
import { isShown, told } from "./lanes.js";
import { ParameterList } from "./parameters.js";
import { StackLog, runningAt } from "./stacklog.js";

const SIGNS = { pass: "✓", fail: "✗", inconclusive: "?", error: "!" };
const WORDS = { pass: "passed", fail: "failed", inconclusive: "undecided", error: "error" };

/** Verdicts at the top, other views in tabs below. A click calls `chosen` with the entry, or `seek` with a time in s. */
export class Panel {
  constructor(runs, chosen, seek) {
    this.runs = runs;
    this.chosen = chosen;
    this.cards = [];
    this.text = viewBox("text", "code");
    this.now = viewBox("now");
    this.list = viewBox("events");
    this.views = { text: ["Scenario", this.text], now: ["Now", this.now], events: ["Events", this.list] };
    const robots = runs.flatMap((run) => run.robots);
    if (robots.some((robot) => robot.changes.length || robot.lines.length)) this.#addLog(seek);
    if (robots.some((robot) => robot.parameters.length)) this.#addParameters();
    this.tabs = Object.entries(this.views).map(([id, [name]]) => this.#tab(id, name));
    const bar = el("div", { role: "tablist", class: "tabs", "aria-label": "Details" }, ...this.tabs);
    this.elements = [el("div", { class: "verdicts" }, ...runs.map((run) => this.#verdicts(run))), bar, ...Object.values(this.views).map(([, view]) => view)];
    this.rows = new Map();
    this.lines = new Map();
    fill(this.list, ...runs.map((run) => this.#events(run)));
    this.#fillText(runs[0]);
    this.show("text");
  }

  #addLog(seek) {
    const view = viewBox("log");
    this.log = new StackLog(this.runs, seek);
    view.append(...this.log.elements);
    this.views.log = ["Log", view];
  }

  #addParameters() {
    const view = viewBox("parameters");
    this.parameters = new ParameterList(this.runs);
    view.append(...this.parameters.elements);
    this.views.parameters = ["Parameters", view];
  }

  /** Show the tab of a view, if there is such a view. */
  show(id) {
    if (!this.views[id]) return;
    for (const tab of this.tabs) {
      const front = tab.dataset.view === id;
      tab.setAttribute("aria-selected", front);
      tab.tabIndex = front ? 0 : -1;
    }
    for (const [name, [, view]] of Object.entries(this.views)) view.hidden = name !== id;
    this.front = id;
    if (id === "parameters") this.parameters.show();
    this.tell(this.seconds ?? 0);
  }

  /** Highlight the card, the row, and the line of the selected verdict or event. */
  select(run, selected, line) {
    for (const { element, run: whose, number } of this.cards) {
      const lit = selected?.kind === "v" && whose === run && number === selected.number;
      element.classList.toggle("lit", lit);
      if (lit) reveal(element, this.elements[0]);
    }
    for (const [key, row] of this.rows) {
      const lit = selected?.kind === "e" && key === `${run?.letter ?? ""}${selected.number}`;
      row.classList.toggle("lit", lit);
      if (lit) reveal(row, this.list);
    }
    if (run && this.shownText !== run) this.#fillText(run);
    for (const [number, row] of this.lines) {
      const lit = number === line;
      row.classList.toggle("lit", lit);
      if (lit) row.setAttribute("aria-current", "true");
      else row.removeAttribute("aria-current");
      if (lit) reveal(row, this.text);
    }
  }

  /** Show the state at a time. */
  tell(seconds) {
    this.seconds = seconds;
    if (this.front === "log") this.log.tell(seconds);
    if (this.front === "now") fill(this.now, ...this.runs.flatMap((run) => run.robots.map((robot) => this.#state(run, robot, run.tick(seconds)))));
  }

  #tab(id, name) {
    return el("button", {
      role: "tab", id: `tab-${id}`, type: "button", "data-view": id, "aria-controls": `view-${id}`,
      onclick: () => (this.show(id), this.chosen(null, null)),
      onkeydown: (event) => {
        const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
        if (!step) return;
        event.preventDefault();
        event.stopPropagation();
        const next = this.tabs[(this.tabs.findIndex((tab) => tab.dataset.view === id) + step + this.tabs.length) % this.tabs.length];
        next.focus();
        next.click();
      },
    }, name);
  }

  #verdicts(run) {
    const bad = run.verdicts.filter((verdict) => verdict.status !== "pass"), good = run.verdicts.filter((verdict) => verdict.status === "pass");
    const missing = run.disturbances.filter((one) => !one.happened);
    const held = good.length ? el("details", { class: "held", open: !bad.length }, el("summary", {}, `${good.length} of ${run.verdicts.length} held`), ...good.map((verdict) => this.#card(run, verdict))) : null;
    return el("section", { class: "of-run", "aria-label": `Verdicts${run.letter ? ` of run ${run.letter}` : ""}` },
      this.runs.length > 1 ? el("h2", {}, el("span", { class: `pill ${run.outcome}` }, run.letter), ` ${run.outcome.replaceAll("-", " ")}`) : null,
      run.error ? el("p", { class: "error-text" }, run.error) : null,
      run.reason ? el("p", { class: "quiet" }, run.reason) : null,
      ...bad.map((verdict) => this.#card(run, verdict)),
      held,
      ...missing.map((one) => el("p", { class: "quiet" }, `${one.name} did not happen: ${one.effect}`)));
  }

  #card(run, verdict) {
    const findings = verdict.status === "pass" ? verdict.findings.filter((_, k) => k === verdict.tightest) : verdict.findings.filter((finding) => finding.status !== "pass");
    const warn = verdict.severity === "warn" && verdict.status !== "pass";
    const element = el("div", { class: `card ${verdict.status}${warn ? " warn" : ""}` }, ...(findings.length ? findings : [null]).map((finding) => this.#finding(run, verdict, finding, warn)));
    this.cards.push({ element, run, number: verdict.number });
    return element;
  }

  #finding(run, verdict, finding, warn) {
    const when = finding && finding.tick !== null ? clockText(finding.tick / run.rate) : "";
    const status = finding?.status ?? verdict.status;
    return el("div", { class: "finding" },
      el("button", { type: "button", class: "go", onclick: () => this.chosen(run, { kind: "v", number: verdict.number }, finding) },
        el("span", { class: "sign", "aria-hidden": "true" }, SIGNS[status]),
        el("span", { class: "unseen" }, `${warn ? "warning, " : ""}${WORDS[status]}: `),
        el("span", { class: "what" }, finding?.what ?? verdict.id),
        when ? el("span", { class: "when" }, when) : null),
      finding && finding.said ? el("p", { class: "said" }, finding.said, finding.margin ? el("span", { class: "margin" }, ` ${finding.margin}`) : null) : null,
      ...(finding && finding.status !== "pass" ? finding.detail.map((text) => el("p", { class: "detail" }, text)) : []));
  }

  #fillText(run) {
    this.shownText = run;
    this.lines = new Map();
    const asked = new Set([...run.verdicts, ...run.events, ...run.disturbances].map((one) => one.line).filter(Boolean));
    const rows = run.text.map((text, k) => {
      const number = k + 1, mark = run.verdicts.filter((verdict) => verdict.line === number);
      const look = mark.some((verdict) => verdict.status !== "pass" && verdict.severity !== "warn") ? " bad" : mark.some((verdict) => verdict.status !== "pass") ? " odd" : mark.length ? " good" : "";
      const row = el("div", { class: `line${asked.has(number) ? " asked" : ""}${look}`, "data-line": number }, el("span", { class: "number", "aria-hidden": "true" }, String(number)), el("code", {}, ...colored(text)));
      this.lines.set(number, row);
      return row;
    });
    fill(this.text, ...(run.text.join("") ? rows : [el("p", { class: "quiet" }, "This log contains no scenario.")]));
  }

  #events(run) {
    const rows = run.events.filter(isShown).map((event) => {
      const row = el("li", {}, el("button", { type: "button", class: `event${event.bad ? " bad" : ""}`, onclick: () => this.chosen(run, { kind: "e", number: event.number }) },
        el("span", { class: "when" }, clockText(event.tick / run.rate)),
        el("span", { class: `dot ${event.lane}`, "aria-hidden": "true" }),
        el("span", {}, el("b", {}, `${event.robot ? `${event.robot}: ` : ""}${told(event)}`), event.text ? el("span", { class: "quiet" }, ` ${event.text}`) : null)));
      this.rows.set(`${run.letter}${event.number}`, row);
      return row;
    });
    return el("section", {}, this.runs.length > 1 ? el("h3", {}, `Run ${run.letter}`) : null, el("ol", { class: "events" }, ...rows));
  }

  #state(run, robot, tick) {
    const pose = robot.truthAt(tick), belief = robot.beliefAt(tick), goal = robot.goalAt(tick);
    const whose = (event) => (event.robot ?? "") === robot.name;
    const value = (name) => {
      const strip = robot.strips.get(name);
      return strip ? `${strip.at(tick).toFixed(2)} ${strip.unit}` : null;
    };
    const names = (lane) => run.going(lane, tick).filter(whose).map((event) => event.name).join(", ");
    const facts = [
      ["goal", goal?.name ?? "none"],
      ["true pose", pose ? poseText(pose) : "not recorded"],
      ["belief", belief ? poseText(belief) : "none"],
      ["localization error", value("localization_error")],
      ["speed", value("speed")],
      ["commanded speed", value("command_speed")],
      ["clearance", value("clearance")],
      ["faults", names("faults")],
      ["recovery", names("recoveries")],
      ["behavior tree", runningAt(robot, tick).join(" · ")],
      ["events", run.going("events", tick).map((event) => event.name).join(", ")],
      ["zones", run.zonesAt(tick).map((zone) => zone.region).join(", ")],
    ];
    const head = [run.letter && `Run ${run.letter}`, robot.name].filter(Boolean).join(", ");
    return el("section", {}, head ? el("h3", {}, head) : null,
      el("dl", {}, ...facts.filter(([, told_]) => told_).flatMap(([name, told_]) => [el("dt", {}, name), el("dd", {}, told_)])));
  }
}

/** Return the element of a view, which its tab shows. */
function viewBox(id, look = "") {
  return el("div", { class: `view ${look}`, id: `view-${id}`, role: "tabpanel", "aria-labelledby": `tab-${id}`, tabindex: "0" });
}

/** Scroll only this box, not the page, so that an element in it is visible. */
function reveal(element, box) {
  const inner = element.getBoundingClientRect(), outer = box.getBoundingClientRect();
  if (inner.top >= outer.top && inner.bottom <= outer.bottom) return;
  box.scrollTop += inner.top - outer.top - Math.max(outer.height - inner.height, 0) / 2;
}

function poseText({ x, y, yaw }) {
  return `${x.toFixed(2)}, ${y.toFixed(2)} m, ${((yaw * 180) / Math.PI).toFixed(0)}°`;
}

/** Return a line of YAML with colors for its comment and its keys. */
function colored(text) {
  const comment = text.search(/(^|\s)#/), plain = comment < 0 ? text : text.slice(0, comment);
  const parts = plain.split(/([\w.-]+:(?=\s|$))/).map((part, k) => (k % 2 ? el("span", { class: "key" }, part) : part));
  return [...parts, comment < 0 ? null : el("span", { class: "comment" }, text.slice(comment))].filter((part) => part !== null && part !== "");
}
