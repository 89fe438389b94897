// Parameters of an external stack by node. For two runs, also the parameters that differ between them.
import { el, fill } from "./dom.js";

/** Return all parameters of the runs: robot and node, name, whether it is a main parameter, and its value in each run. */
export function parametersOf(runs) {
  const found = new Map();
  const reporting = runs.filter((run) => run.robots.some((robot) => robot.parameters.length));
  reporting.forEach((run, number) => {
    for (const robot of run.robots) {
      for (const { node, values } of robot.parameters) {
        for (const [name, value, isMain] of values) {
          const key = JSON.stringify([robot.name, node, name]);
          if (!found.has(key)) found.set(key, { node: robot.name ? `${robot.name}: ${node}` : node, name, isMain, values: reporting.map(() => null) });
          found.get(key).values[number] = value;
        }
      }
    }
  });
  return { letters: reporting.length > 1 ? reporting.map((run) => run.letter) : [""], rows: [...found.values()] };
}

/** List of parameters with a filter. Its rows are made when it is first shown. */
export class ParameterList {
  constructor(runs) {
    const { letters, rows } = parametersOf(runs);
    Object.assign(this, { letters, rows });
    this.missing = runs.flatMap((run) => run.robots.flatMap((robot) => robot.parameters)).reduce((sum, { values, total }) => sum + total - values.length, 0);
    this.filter = el("input", { type: "search", placeholder: "Filter: tolerance, inflation …", "aria-label": "Filter the parameters", oninput: () => this.#search() });
    this.count = el("span", { class: "quiet", role: "status" });
    this.body = el("div");
    this.elements = [el("div", { class: "bar" }, this.filter, this.count), this.body];
  }

  /** Make the rows if they do not exist yet. */
  show() {
    if (this.groups) return;
    const differing = this.letters.length > 1 ? this.rows.filter((row) => new Set(row.values).size > 1) : [];
    const first = this.letters.length > 1 ? group(`Different in ${this.letters.join(" and ")}`, differing, this.letters, true) : group("Main parameters", this.rows.filter((row) => row.isMain), this.letters, true);
    const nodes = [...new Set(this.rows.map((row) => row.node))].map((node) => group(node, this.rows.filter((row) => row.node === node), this.letters, false));
    this.first = first;
    this.groups = nodes;
    const rest = this.missing ? el("p", { class: "quiet" }, `${this.missing} more parameters are in the log (metadata simscen.stack) and in stack.json.`) : null;
    fill(this.body, first.element, ...nodes.map((one) => one.element), rest);
    this.#search();
  }

  #search() {
    const words = this.filter.value.toLowerCase().split(/\s+/).filter(Boolean), searching = words.length > 0;
    if (!this.groups) return;
    this.first.element.hidden = searching || !this.first.rows.length;
    let hits = 0;
    for (const { element, rows } of this.groups) {
      let own = 0;
      for (const { line, search } of rows) {
        line.hidden = !words.every((word) => search.includes(word));
        own += !line.hidden;
      }
      element.hidden = !own;
      if (searching !== Boolean(this.searching)) element.open = searching;
      hits += own;
    }
    this.searching = searching;
    this.count.textContent = searching ? `${hits} of ${this.rows.length}` : `${this.rows.length} in ${this.groups.length} nodes`;
  }
}

/** A collapsible group of rows; with `named`, the rows are below the names of their nodes. */
function group(title, rows, letters, named) {
  let node = "";
  const made = rows.map((row) => ({ line: parameterLine(row, letters), search: `${row.node} ${row.name} ${row.values.join(" ")}`.toLowerCase(), row }));
  const lines = made.flatMap(({ line, row }) => {
    const head = named && row.node !== node ? [el("h3", {}, row.node)] : [];
    node = row.node;
    return [...head, line];
  });
  const element = el("details", { class: "parameters", open: named }, el("summary", {}, title, el("span", { class: "quiet" }, ` ${rows.length}`)), ...lines);
  return { element, rows: made };
}

function parameterLine({ name, values }, letters) {
  const isSame = new Set(values).size === 1;
  const shown = isSame ? [el("span", { class: "set" }, values[0])] : values.map((value, k) => el("span", { class: "set" }, el("span", { class: "quiet" }, `${letters[k]} `), value ?? "–"));
  return el("p", { class: `parameter${isSame ? "" : " differs"}` }, el("span", { class: "name" }, name), ...shown);
}
