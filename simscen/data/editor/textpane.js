// Text of the file beside the map, with line numbers and problems.

import { el, fill } from "./dom.js";

const LINE = 18;

export class TextPane {
  constructor(area, gutter, list, count, changed, clicked) {
    Object.assign(this, { area, gutter, list, count });
    this.problems = [];
    this.line = 0;
    area.addEventListener("input", () => changed(area.value));
    area.addEventListener("scroll", () => { gutter.scrollTop = area.scrollTop; });
    area.addEventListener("click", () => clicked(this.caretLine));
  }

  get caretLine() { return this.area.value.slice(0, this.area.selectionStart).split("\n").length; }

  /** Show another text. The caret and the scroll position stay where they are. */
  setText(text) {
    if (this.area.value === text) return;
    const { scrollTop, scrollLeft } = this.area, before = this.area.value, caret = this.area.selectionStart;
    let same = 0;
    while (same < Math.min(before.length, text.length) && before[same] === text[same]) same++;
    this.area.value = text;
    const moved = caret <= same ? caret : Math.max(same, Math.min(caret + text.length - before.length, text.length));
    this.area.setSelectionRange(moved, moved);
    Object.assign(this.area, { scrollTop, scrollLeft });
    this.drawGutter();
  }

  showProblems(problems) {
    this.problems = problems;
    const errors = problems.filter((one) => one.severity === "error").length;
    const words = [[errors, "error"], [problems.length - errors, "warning"]].filter(([number]) => number).map(([number, what]) => `${number} ${what}${number > 1 ? "s" : ""}`);
    this.count.textContent = words.length ? words.join(", ") : "No problems";
    fill(this.list, ...problems.map((one) => el("li", {}, el("button", { onclick: () => this.goTo(one.line, one.col) },
      el("span", { class: one.severity === "error" ? "bad" : "quiet" }, `${one.where} ${one.severity} ${one.code}: `), one.message, one.hint ? el("span", { class: "quiet" }, ` (${one.hint})`) : null))));
    this.drawGutter();
  }

  /** Mark a line, and scroll to it without taking the focus. */
  mark(line) {
    this.line = line;
    this.drawGutter();
    if (!line) return;
    const top = (line - 1) * LINE, height = this.area.clientHeight;
    if (top < this.area.scrollTop || top > this.area.scrollTop + height - 3 * LINE) this.area.scrollTop = Math.max(0, top - height / 3);
  }

  goTo(line, col) {
    if (!line) return;
    const lines = this.area.value.split("\n"), start = lines.slice(0, line - 1).reduce((sum, one) => sum + one.length + 1, 0) + Math.max(col - 1, 0);
    this.area.focus();
    this.area.setSelectionRange(start, start);
    this.mark(line);
  }

  drawGutter() {
    const worst = new Map();
    for (const one of this.problems) if (one.line && worst.get(one.line) !== "error") worst.set(one.line, one.severity);
    const total = this.area.value.split("\n").length;
    const lines = Array.from({ length: total }, (_, k) => el("span", { class: worst.get(k + 1) ?? (k + 1 === this.line ? "here" : null) }, String(k + 1)));
    fill(this.gutter, ...lines, el("span", {}, " "));
    this.gutter.scrollTop = this.area.scrollTop;
  }
}
