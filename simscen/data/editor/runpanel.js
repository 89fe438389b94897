// Panel for running the text, with the verdicts and the replay page.

import { Refused, ask } from "./api.js";
import { el, fill } from "./dom.js";

const SIGNS = { pass: "✓", fail: "✗", inconclusive: "?", error: "!" };
const POLL_MS = 300;

export class RunPanel {
  constructor(element, say, goToLine) {
    Object.assign(this, { element, say, goToLine });
    this.number = 0;
    this.stack = "";
  }

  async start(text) {
    fill(this.element, el("p", {}, "Starting…"));
    try {
      const run = await ask("run", { text });
      this.number = run.run;
      await this.follow(run);
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      fill(this.element, el("p", { class: "bad" }, error.message));
      this.say(error.message);
    }
  }

  async follow(run) {
    const number = run.run;
    while (run.state === "running" && number === this.number) {
      const stop = el("button", { onclick: () => ask("run-stop", { run: number }) }, "Stop");
      const shown = this.element.querySelector("progress");
      if (shown) shown.value = run.seconds;
      else fill(this.element, el("p", {}, el("progress", { max: run.limit, value: run.seconds, "aria-label": "Simulated time" }), " ", stop));
      await new Promise((resolve) => setTimeout(resolve, POLL_MS));
      run = await ask("run-status", { run: number });
    }
    if (number === this.number) this.finish(run);
  }

  finish(run) {
    const good = run.state === "passed" || run.state === "failed-as-expected", page = `runs/${run.run}/replay.html`;
    const rows = run.verdicts.map((one) => el("tr", {}, el("td", { class: one.status === "pass" ? "good" : "bad" }, `${SIGNS[one.status] ?? "?"} ${one.status}`),
      el("td", {}, one.line ? el("button", { onclick: () => this.goToLine(one.line) }, one.id) : one.id), el("td", {}, one.text)));
    const what = this.stack ? `The run with the stack ${this.stack}` : "The run";
    const head = `${what} ${run.state === "error" ? "could not be completed" : run.state === "canceled" ? "was stopped" : run.state} after ${run.seconds.toFixed(1)} s simulated${run.message ? `: ${run.message}` : ""}`;
    fill(this.element, el("p", { id: "outcome", class: good ? "good" : "bad" }, head), rows.length ? el("table", { "aria-label": "Verdicts" }, el("tbody", {}, ...rows)) : null,
      run.replay ? el("p", {}, el("a", { href: page, target: "_blank", rel: "noreferrer" }, "Open the replay in a new tab")) : null,
      run.replay ? el("iframe", { src: page, title: "Replay of the run" }) : null);
    this.say(head);
  }
}
