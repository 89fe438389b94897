// The page: connects the data, the views, the keyboard, and the address.
import { Camera } from "./camera.js";
import { Deck } from "./deck.js";
import { clockText, el, fill } from "./dom.js";
import { helpWindow } from "./help.js";
import { icon } from "./icons.js";
import { LAYERS, colorsNow, layerOf } from "./layers.js";
import { isShown, told } from "./lanes.js";
import { fromHash, toHash } from "./link.js";
import { MapView } from "./mapview.js";
import { Panel } from "./panel.js";
import { unpack } from "./payload.js";
import { Player } from "./player.js";
import { Run } from "./run.js";

const root = document.documentElement;

async function start() {
  const { about, column } = await unpack(document.getElementById("data").textContent);
  const runs = about.runs.map((data, number) => new Run(data, column, about.runs.length > 1 ? "AB"[number] : ""));
  const page = new Page(runs, about.leftOut);
  page.open();
  globalThis.simscen = { page, runs };
  root.dataset.ready = performance.now().toFixed(0);
}

class Page {
  constructor(runs, leftOut) {
    this.runs = runs;
    this.leftOut = leftOut;
    this.camera = new Camera();
    this.layers = new Set(LAYERS.filter((layer) => !layer.off).map((layer) => layer.id));
    this.selected = null;
    this.follows = false;
    this.player = new Player(Math.max(...runs.map((run) => run.seconds)), () => this.#changed());
    this.maps = runs.map((run) => new MapView(run, this.camera, (what) => (what === "fit" ? this.fit() : this.#changed())));
    this.panel = new Panel(runs, (run, selected, finding) => run && this.choose(run, selected, finding), (seconds) => (this.player.pause(), this.player.seek(seconds)));
    this.deck = new Deck(runs, this.player, this.#actions());
    this.help = helpWindow();
  }

  open() {
    fill(document.getElementById("head"), ...this.#head());
    fill(document.getElementById("stage"), el("div", { class: "maps" }, ...this.maps.map((map) => map.element)), this.#tools());
    fill(document.getElementById("deck"), ...this.deck.elements);
    fill(document.getElementById("panel"), ...this.panel.elements);
    document.body.append(this.help);
    addEventListener("keydown", (event) => this.#key(event));
    addEventListener("hashchange", () => this.#goTo(fromHash(location.hash)));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.laidOut());
    new ResizeObserver(() => this.laidOut()).observe(document.getElementById("main"));
    this.laidOut();
    this.fit();
    const asked = fromHash(location.hash);
    if (asked.time === null && !asked.selected) this.#openAtFailure();
    else this.#goTo(asked);
  }

  /** Select a verdict or an event, and show its time. */
  choose(run, selected, finding = null) {
    const one = selected.kind === "v" ? run.verdicts[selected.number] : run.events[selected.number];
    if (!one) return;
    this.selected = { ...selected, run, one, finding: finding ?? worst(one) };
    const tick = selected.kind === "v" ? this.selected.finding?.tick : one.tick;
    this.player.pause();
    if (one.line && selected.kind === "v") this.panel.show("text");
    this.laidOut();
    this.panel.select(run, selected, one.line);
    if (tick !== null && tick !== undefined) this.player.seek(tick / run.rate);
    this.#say(selected.kind === "v" ? `${this.selected.finding?.what ?? one.id}: ${this.selected.finding?.said ?? one.status}` : told(one));
  }

  /** Draw everything again. */
  laidOut() {
    this.colors = colorsNow();
    this.theme = `${root.dataset.theme ?? ""}${matchMedia("(prefers-color-scheme: dark)").matches}`;
    this.deck.layOut(this.colors, this.selected);
    this.#changed();
  }

  /** Zoom out to the complete map. */
  fit() {
    const [width, height] = this.maps[0].size, bounds = this.maps.map((map) => map.bounds());
    const all = [0, 1, 2, 3].map((k) => (k < 2 ? Math.min : Math.max)(...bounds.map((one) => one[k])));
    this.follows = false;
    this.camera.fit(all, width, height);
    this.#changed();
  }

  #openAtFailure() {
    const run = this.runs.find((one) => one.failures.length), failure = run?.failures.find(({ finding }) => finding.tick !== null) ?? run?.failures[0];
    if (failure) this.choose(run, { kind: "v", number: failure.verdict.number }, failure.finding);
    else this.player.seek(0);
  }

  #goTo({ time, selected }) {
    const run = this.selected?.run ?? this.runs[0];
    if (selected) this.choose(run, selected);
    if (time !== null && Math.abs(time - this.player.time) > 0.0006) this.player.seek(time);
  }

  #changed() {
    if (this.due) return;
    this.due = true;
    requestAnimationFrame(() => {
      this.due = false;
      this.#draw();
    });
  }

  #draw() {
    const { time, playing } = this.player;
    if (this.follows) {
      const pose = this.runs[0].robots[0].placeAt(this.runs[0].tick(time));
      [this.camera.x, this.camera.y] = [pose.x, pose.y];
    }
    for (const map of this.maps) {
      const mine = this.selected?.run === map.run ? this.selected : null;
      map.draw(map.run.tick(time), { ...this, marked: mine?.finding?.place ?? (mine?.kind === "e" ? mine.one.place : null) });
    }
    this.deck.tell();
    this.panel.tell(time);
    if (!playing) this.#address(toHash(time, this.selected));
  }

  #address(hash) {
    if (hash === location.hash) return;
    clearTimeout(this.addressing);
    this.addressing = setTimeout(() => history.replaceState(null, "", hash), 120); // browsers allow only few changes per second
  }

  #say(text) {
    document.getElementById("live").textContent = `${text}, at ${clockText(this.player.time)}`;
  }

  #head() {
    const [run, other] = this.runs, [first] = run.failures;
    const told_ = (one) => [`seed ${one.seed}`, one.stack && `stack ${one.stack}`, clockText(one.seconds), one.complete ? one.ended : "truncated log"].filter(Boolean).join(" · ");
    const heading = (one) => [el("span", { class: `pill ${one.outcome}` }, one.letter ? `${one.letter} ${one.outcome}` : one.outcome.replaceAll("-", " ")), el("h1", {}, one.title), el("span", { class: "quiet" }, told_(one))];
    const why = !other && first ? el("span", { class: "why" }, `${first.finding.what}: ${first.finding.said}`) : null;
    return [...heading(run), ...(other ? heading(other) : [why]), el("span", { class: "push" }),
      el("button", { type: "button", onclick: () => this.#theme(), title: "Dark or light theme (d)", "aria-label": "Dark or light theme" }, icon("theme")),
      el("button", { type: "button", onclick: () => this.help.showModal(), title: "Keys (?)", "aria-label": "Keys" }, "?")];
  }

  #tools() {
    this.boxes = new Map();
    const boxes = LAYERS.filter((layer) => !["global", "near"].includes(layer.id) || this.runs.some((run) => run.robots.some((robot) => robot.costmaps.some((costmap) => layerOf(costmap) === layer.id)))).map((layer) => {
      const box = el("input", { type: "checkbox", checked: this.layers.has(layer.id), onchange: () => this.#layer(layer.id, box.checked) });
      this.boxes.set(layer.id, box);
      return el("label", { title: `Alt+${layer.key}` }, box, el("span", { class: `swatch ${layer.sign ?? ""} ${layer.id}`, "aria-hidden": "true" }), layer.name);
    });
    const tool = (name, sign, act) => el("button", { type: "button", "aria-label": name, title: name, onclick: act }, sign);
    this.follow = el("button", { type: "button", "aria-pressed": "false", title: "Keep the robot in view (c)", onclick: () => this.#follow() }, "Follow");
    return el("div", { class: "tools" }, tool("Zoom in (+)", "+", () => this.maps[0].zoom(1.4)), tool("Zoom out (−)", "−", () => this.maps[0].zoom(1 / 1.4)), tool("Fit all (0)", "Fit", () => this.fit()), this.follow,
      el("details", { class: "menu" }, el("summary", {}, "Layers"), el("div", { class: "choice" }, ...boxes, this.#missing())));
  }

  /** Return a note on the data that was omitted to limit the size of the page. */
  #missing() {
    return this.leftOut.length ? el("p", { class: "quiet left-out" }, "The log is long, so this page contains only a part of: ", ...this.leftOut.flatMap((text) => [text, el("br")])) : null;
  }

  #follow() {
    this.follows = !this.follows;
    this.follow.setAttribute("aria-pressed", this.follows);
    this.#changed();
  }

  #layer(id, on) {
    if (on) this.layers.add(id);
    else this.layers.delete(id);
    this.#changed();
  }

  #theme() {
    const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    root.dataset.theme = dark ? "light" : "dark";
    this.laidOut();
  }

  #actions() {
    const step = (seconds) => () => (this.player.pause(), this.player.seek(this.player.time + seconds));
    return {
      choose: (run, selected) => this.choose(run, selected), laidOut: () => this.laidOut(),
      showLog: (seconds) => (this.player.pause(), this.player.seek(seconds), this.panel.show("log")),
      play: () => this.player.toggle(), begin: () => this.player.seek(0), end: () => this.player.seek(this.player.end),
      back: step(-0.1), on: step(0.1), previous: () => this.#event(-1), next: () => this.#event(1), failure: () => this.#failure(),
      slower: () => this.player.pace(-1), faster: () => this.player.pace(1),
    };
  }

  /** Return the sorted times of events and violations, between which keys jump. */
  #stops() {
    const events = this.runs.flatMap((run) => run.events.filter(isShown).map((event) => ({ time: event.tick / run.rate, run, kind: "e", number: event.number })));
    const failures = this.runs.flatMap((run) => run.failures.filter(({ finding }) => finding.tick !== null).map(({ verdict, finding }) => ({ time: finding.tick / run.rate, run, kind: "v", number: verdict.number, finding })));
    return [...events, ...failures].sort((a, b) => a.time - b.time);
  }

  #event(step) {
    const stops = this.#stops(), { time } = this.player;
    const at = this.selected && stops.findIndex((stop) => stop.run === this.selected.run && stop.kind === this.selected.kind && stop.number === this.selected.number && Math.abs(stop.time - time) < 0.01);
    const next = at !== null && at >= 0 ? stops[at + step] : step > 0 ? stops.find((stop) => stop.time > time + 1e-6) : stops.findLast((stop) => stop.time < time - 1e-6);
    if (next) this.choose(next.run, { kind: next.kind, number: next.number }, next.finding);
  }

  #failure() {
    const failures = this.#stops().filter((stop) => stop.kind === "v"), next = failures.find((stop) => stop.time > this.player.time + 1e-6) ?? failures[0];
    if (next) this.choose(next.run, { kind: "v", number: next.number }, next.finding);
    else this.#openAtFailure();
  }

  #sample(step) {
    const { ticks } = this.runs[0].robots[0].truth, tick = this.runs[0].tick(this.player.time);
    const next = step > 0 ? ticks.find((one) => one > tick + 1e-6) : ticks.findLast((one) => one < tick - 1e-6);
    if (next !== undefined) this.player.seek(next / this.runs[0].rate);
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || this.help.open || event.target.matches?.("input:not([type=range]):not([type=checkbox]), select, textarea")) return;
    const act = this.#actions(), layer = event.altKey && LAYERS.find((one) => event.code === `Digit${one.key}` || event.code === `Key${one.key.toUpperCase()}`);
    if (layer) {
      event.preventDefault();
      this.#layer(layer.id, !this.layers.has(layer.id));
      const box = this.boxes.get(layer.id);
      if (box) box.checked = this.layers.has(layer.id);
      return;
    }
    const longer = event.shiftKey ? 10 : 1, seek = (seconds) => () => (this.player.pause(), this.player.seek(this.player.time + seconds));
    const keys = {
      " ": act.play, ArrowLeft: seek(-0.1 * longer), ArrowRight: seek(0.1 * longer), ",": () => this.#sample(-1), ".": () => this.#sample(1), p: act.previous, n: act.next, f: act.failure,
      Home: act.begin, End: act.end, "<": act.slower, ">": act.faster, "+": () => this.maps[0].zoom(1.25), "=": () => this.maps[0].zoom(1.25), "-": () => this.maps[0].zoom(0.8), 0: () => this.fit(),
      c: () => this.#follow(), "[": () => this.deck.zoom(0.7), "]": () => this.deck.zoom(1 / 0.7), "\\": () => this.deck.zoomAll(), d: () => this.#theme(), "?": () => this.help.showModal(),
      s: () => this.panel.show("text"), w: () => (this.panel.show("now"), this.#changed()), e: () => this.panel.show("events"), l: () => this.panel.show("log"), m: () => this.panel.show("parameters"),
    };
    if (!keys[event.key] || event.altKey || (event.key === " " && event.target.matches?.("button, summary, input[type=checkbox]"))) return;
    if (event.key.startsWith("Arrow") && event.target.closest?.("[role=tablist], .view")) return;
    event.preventDefault();
    keys[event.key]();
  }
}

/** Return the finding of a selected verdict to show: a violated one, if possible with a time; null for an event. */
function worst(one) {
  return one.findings?.find((finding) => finding.status !== "pass" && finding.tick !== null) ?? one.findings?.find((finding) => finding.status !== "pass") ?? one.findings?.[0] ?? null;
}

start().catch((error) => {
  document.getElementById("main").replaceChildren(el("p", { class: "broken" }, `This page cannot be read: ${error.message}`));
  throw error;
});
