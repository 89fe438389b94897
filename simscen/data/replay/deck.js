// Area below the map: buttons, scrubber, lanes, and signal plots with a common time axis, and a line at the shown time.
import { clockText, el, fill } from "./dom.js";
import { icon } from "./icons.js";
import { Lanes } from "./lanes.js";
import { StripView, firstShown } from "./strips.js";

const SHORTEST = 0.5;

/** `act` contains the functions that the buttons call; see main.js. */
export class Deck {
  constructor(runs, player, act) {
    this.runs = runs;
    this.player = player;
    this.act = act;
    [this.from, this.to] = [0, player.end || 1];
    this.lanes = new Lanes(runs, act.choose, act.showLog);
    this.play = button("Play", icon("play"), act.play, "space");
    this.clock = el("output", { class: "clock", "aria-hidden": "true" });
    this.speed = el("output", { class: "quiet" });
    this.range = el("input", { type: "range", min: 0, max: player.end, step: "any", "aria-label": "Time", oninput: () => player.seek(Number(this.range.value)), onkeydown: ownKeys });
    this.axis = el("div", { class: "axis", "aria-hidden": "true" });
    this.strips = new Map();
    this.stripBox = el("div", { class: "strips" });
    this.cursor = el("div", { class: "cursor", "aria-hidden": "true" });
    this.body = el("div", { class: "tracks", onwheel: (event) => this.#wheel(event), onpointerdown: (event) => this.#scrub(event), onpointermove: (event) => event.buttons && this.#scrub(event), ondblclick: () => this.zoomAll() },
      el("div", { class: "row" }, el("span", { class: "gutter" }), el("div", { class: "track scrub" }, this.range, this.axis)), this.lanes.element, this.stripBox, this.cursor);
    this.elements = [this.#controls(), this.body];
    for (const name of firstShown(runs)) this.#add(name);
  }

  /** Width of the time axis in pixels. */
  get width() {
    return this.axis.clientWidth;
  }

  /** Draw everything again after a change of the size, the shown time span, the colors, or the selection. */
  layOut(colors, selected) {
    this.colors = colors;
    const { width } = this;
    this.lanes.layOut(this.from, this.to, width, selected);
    for (const strip of this.strips.values()) strip.draw(this.from, this.to, width, colors);
    const step = roundSeconds((this.to - this.from) / Math.max(2, width / 90)), marks = [];
    for (let k = Math.ceil(this.from / step - 1e-9); k * step <= this.to + 1e-9; k++) {
      const share = (k * step - this.from) / (this.to - this.from), mark = el("span", {}, `${Number((k * step).toFixed(2))} s`);
      if (share > 0.985) continue;
      mark.style.left = `${share * 100}%`;
      marks.push(mark);
    }
    fill(this.axis, ...marks);
    this.range.min = this.from;
    this.range.max = this.to;
    this.cursor.style.height = `${this.body.scrollHeight - 18}px`;
    this.tell();
  }

  /** Update everything that depends on the shown time. */
  tell() {
    const { time, end, playing, speed } = this.player;
    this.range.value = time;
    this.range.setAttribute("aria-valuetext", `${clockText(time)} of ${clockText(end)}`);
    this.clock.textContent = `${clockText(time)} / ${clockText(end)}`;
    this.speed.textContent = `${speed}×`;
    if (this.showsPlaying !== playing) {
      this.showsPlaying = playing;
      fill(this.play, icon(playing ? "pause" : "play"));
      this.play.setAttribute("aria-label", playing ? "Pause" : "Play");
    }
    const left = this.axis.getBoundingClientRect().left - this.body.getBoundingClientRect().left;
    this.cursor.style.left = `${left + ((time - this.from) / (this.to - this.from)) * this.width}px`;
    this.cursor.hidden = time < this.from || time > this.to;
    for (const strip of this.strips.values()) strip.tell(time);
  }

  zoomAll() {
    [this.from, this.to] = [0, this.player.end || 1];
    this.act.laidOut();
  }

  /** Show a longer or shorter time span. The time at the fraction `share` of the span stays where it is. */
  zoom(factor, share = (this.player.time - this.from) / (this.to - this.from)) {
    const span = Math.min(Math.max((this.to - this.from) * factor, SHORTEST), this.player.end || 1), still = this.from + share * (this.to - this.from);
    this.from = Math.min(Math.max(still - share * span, 0), Math.max((this.player.end || 1) - span, 0));
    this.to = this.from + span;
    this.act.laidOut();
  }

  #controls() {
    const { act } = this, known = [...new Set(this.runs.flatMap((run) => run.robots.flatMap((robot) => [...robot.strips.keys()])))];
    const boxes = known.map((name) => el("label", {}, el("input", { type: "checkbox", checked: firstShown(this.runs).includes(name), onchange: (event) => (event.target.checked ? this.#add(name) : this.#drop(name), act.laidOut()) }), ` ${name.replaceAll("_", " ")}`));
    return el("div", { class: "controls" },
      button("To the start", icon("start"), act.begin, "Home"), button("Previous event", icon("previous"), act.previous, "p"), button("Back 0.1 s", icon("back"), act.back, "←"), this.play,
      button("Forward 0.1 s", icon("on"), act.on, "→"), button("Next event", icon("next"), act.next, "n"), button("To the end", icon("end"), act.end, "End"), this.clock,
      el("span", { class: "push" }), this.runs.some((run) => run.failures.length) ? el("button", { type: "button", class: "to-failure", title: "To the next failure (f)", onclick: act.failure }, icon("failure"), " Failure") : null,
      button("Slower", "−", act.slower, "<"), this.speed, button("Faster", "+", act.faster, ">"),
      el("details", { class: "menu" }, el("summary", {}, "Signals"), el("div", { class: "choice" }, ...boxes)));
  }

  #add(name) {
    const strip = new StripView(name, this.runs);
    this.strips.set(name, strip);
    this.stripBox.append(strip.element);
  }

  #drop(name) {
    this.strips.get(name).element.remove();
    this.strips.delete(name);
  }

  #share(event) {
    const box = this.axis.getBoundingClientRect();
    return (event.clientX - box.left) / Math.max(box.width, 1);
  }

  #wheel(event) {
    const share = this.#share(event);
    if (share < 0 || share > 1 || !(event.ctrlKey || event.shiftKey || event.target.closest(".lanes, .strips"))) return;
    event.preventDefault();
    this.zoom(Math.exp((event.deltaY || event.deltaX) * 0.0015), share);
  }

  #scrub(event) {
    const share = this.#share(event);
    if (event.target === this.range || event.target.closest(".sign") || share < -0.02 || share > 1.02) return;
    this.player.seek(this.from + share * (this.to - this.from));
  }
}

function button(name, sign, act, key) {
  return el("button", { type: "button", "aria-label": name, title: `${name} (${key})`, onclick: act }, sign);
}

/** Let the page handle arrow keys on the scrubber, so that a step has the same length everywhere. */
function ownKeys(event) {
  if (event.key.startsWith("Arrow") || event.key === "Home" || event.key === "End") event.preventDefault();
}

function roundSeconds(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((times) => times * power).find((step) => step >= least);
}
