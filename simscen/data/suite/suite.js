"use strict";
(() => {
  const form = document.getElementById("controls"), list = document.getElementById("runs");
  const groups = [...list.children], runs = [...list.querySelectorAll(".run")];
  const field = name => form.elements[name];
  const statuses = [...form.querySelectorAll("[name=status]")];
  const texts = new Map();
  function words(run) { // collected at the first search, so that a page with thousands of runs opens faster
    if (!texts.has(run)) texts.set(run, run.textContent.toLowerCase() + " " + run.id);
    return texts.get(run);
  }
  const place = new Map([...groups, ...runs].map((one, number) => [one, number]));

  function wanted() {
    const find = field("find").value.toLowerCase().split(/\s+/).filter(Boolean);
    const shown = new Set(statuses.filter(box => box.checked).map(box => box.value));
    const value = name => field(name)?.value || "";
    const theme = value("theme"), tag = value("tag"), stack = value("stack"), variation = value("variation");
    const changed = field("changed")?.checked;
    return run => {
      const data = run.dataset;
      return shown.has(data.status) && (!theme || data.theme === theme) && (!stack || data.stack === stack)
        && (!variation || data.variation === variation) && (!changed || data.changed)
        && (!tag || (data.tags || "").split(" ").includes(tag))
        && find.every(word => words(run).includes(word));
    };
  }

  function rank(order) {
    if (!order) return one => place.get(one);
    const sign = order === "margin" ? 1 : -1;
    return run => run.dataset[order] === undefined ? Infinity : sign * run.dataset[order];
  }

  function arrange(order) {
    const of = rank(order), name = order === "name";
    const compare = (a, b) => (name ? a.id.localeCompare(b.id) : of(a) - of(b)) || place.get(a) - place.get(b);
    const first = new Map();
    for (const group of groups) {
      const own = [...group.querySelectorAll(".run")];
      if (own.length > 1) group.append(...own.sort(compare));
      first.set(group, order ? own.find(run => !run.hidden) || own[0] : group);
    }
    list.append(...[...groups].sort((a, b) => compare(first.get(a), first.get(b))));
  }

  let ordered = "";
  function update() {
    const keep = wanted();
    let shown = 0;
    for (const run of runs) shown += !(run.hidden = !keep(run));
    for (const group of groups) group.hidden = !group.querySelector(".run:not([hidden])");
    const order = field("order").value;
    if (order !== ordered || order) arrange(ordered = order);
    document.getElementById("shown").textContent = shown === runs.length ? "" : `${shown} of ${runs.length} shown`;
    document.getElementById("nothing").hidden = shown > 0 || runs.length === 0;
    remember();
  }

  function remember() {
    const told = new URLSearchParams();
    for (const control of form.elements)
      if (control.type === "checkbox" ? control.checked !== control.defaultChecked : control.value && control.name)
        told.append(control.name, control.type === "checkbox" && control.name === "changed" ? "1" : control.value);
    const hash = told.toString(), run = location.hash.startsWith("#run-") ? location.hash : "";
    history.replaceState(null, "", hash ? "#" + hash : run || location.pathname + location.search);
  }

  function recall() {
    if (location.hash.startsWith("#run-")) return reveal(document.getElementById(decodeURIComponent(location.hash.slice(1))));
    const told = new URLSearchParams(location.hash.slice(1));
    for (const control of form.elements) {
      if (!control.name || !told.has(control.name)) continue;
      if (control.type === "checkbox") control.checked = told.getAll(control.name).includes(control.value) !== control.defaultChecked;
      else control.value = told.get(control.name);
    }
    if (told.has("changed") && field("changed")) field("changed").checked = true;
  }

  function reveal(run) {
    if (!run) return;
    run.open = true;
    const group = run.closest("details.group");
    if (group) group.open = true;
    run.scrollIntoView({ block: "start" });
    run.querySelector("summary").focus({ preventScroll: true });
  }

  function step(forward, failed) {
    const seen = [...list.querySelectorAll(".run:not([hidden])")]
      .filter(run => !failed || ["failed", "error"].includes(run.dataset.status));
    const here = seen.indexOf(document.activeElement?.closest?.(".run"));
    const next = here < 0 ? (forward ? 0 : seen.length - 1) : here + (forward ? 1 : -1);
    reveal(seen[failed ? (next + seen.length) % seen.length : next]);
  }

  function key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
    const does = { "/": () => field("find").focus(), j: () => step(true), k: () => step(false), f: () => step(true, true) };
    if (!does[event.key]) return;
    event.preventDefault();
    does[event.key]();
  }

  function live() {
    const button = document.getElementById("pause");
    let paused = false;
    button.addEventListener("click", () => {
      paused = !paused;
      button.textContent = paused ? "go on" : "pause";
      button.setAttribute("aria-pressed", paused);
    });
    setInterval(() => paused || document.activeElement?.name === "find" || location.reload(), 2000);
  }

  form.hidden = false;
  form.addEventListener("input", update);
  form.addEventListener("submit", event => event.preventDefault());
  document.addEventListener("keydown", key);
  document.getElementById("all").addEventListener("click", () => { form.reset(); update(); field("find").focus(); });
  addEventListener("hashchange", () => location.hash.startsWith("#run-") && recall());
  addEventListener("load", () => requestAnimationFrame(() => location.hash.startsWith("#run-") && recall())); // after the browser has moved the focus
  recall();
  update();
  if (document.documentElement.hasAttribute("data-live")) live();
})();
