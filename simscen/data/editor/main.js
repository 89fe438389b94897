// The page. The text of the file is the only state; the map, the list, and the forms are derived from it.

import { Refused, ask } from "./api.js";
import { el, fill } from "./dom.js";
import { Drag, handleEdit, movedHandles, moveByKey } from "./dragging.js";
import { Form } from "./form.js";
import { History } from "./history.js";
import { MapView } from "./mapview.js";
import { ObjectList, positionText } from "./objectlist.js";
import { RunPanel } from "./runpanel.js";
import { addEdits, addable, isPoint, pointEdit, removalKeys } from "./templates.js";
import { TextPane } from "./textpane.js";

const CHECK_DELAY_MS = 250, KEY_PAUSE_MS = 150;
const $ = (id) => document.getElementById(id);

class Page {
  constructor(opened) {
    Object.assign(this, { name: opened.name, kind: opened.kind, version: opened.version });
    this.savedText = opened.is_new ? null : opened.text;
    this.history = new History(opened.text);
    this.scene = { objects: [], regions: {}, kind: opened.kind };
    this.selected = "";
    this.handle = -1;
    this.problems = [];
    this.bad = new Map();
    this.queue = Promise.resolve();
    this.waiting = 0;  // edits in the queue
    this.placing = "";
    this.view = new MapView($("map"));
    this.list = new ObjectList($("list"), (id) => this.select(id));
    this.form = new Form($("details"), (edits, what) => this.edit(edits, what));
    this.textPane = new TextPane($("text"), $("gutter"), $("problems"), $("count"), (text) => this.changed(text, "typing"), (line) => this.selectLine(line));
    this.runs = new RunPanel($("runpanel"), (text) => this.say(text), (line) => { this.showTab("text"); this.textPane.goTo(line, 1); });
    this.runs.stack = opened.stack;
    if (opened.stack) $("runstack").textContent = `Runs use the stack ${opened.stack}, not the one in the text.`;
    $("name").textContent = opened.name;
    document.title = `${opened.name} – simscen edit`;
    if (this.kind !== "scenario") $("run").hidden = $("runtab").hidden = true;
    this.listen();
    this.textPane.setText(opened.text);
  }

  get text() { return this.history.text; }
  get object() { return this.scene.objects.find((one) => one.id === this.selected) ?? null; }
  get isSaved() { return this.text === this.savedText; }

  say(text) { $("live").textContent = ""; setTimeout(() => { $("live").textContent = text; }, 50); }

  /** Make a text the current one, and update the map, the list, and the forms. */
  async changed(text, group = "") {
    this.history.push(text, group);
    await this.refresh();
  }

  async refresh() {
    this.textPane.setText(this.text);
    this.showState();
    const text = this.text;
    clearTimeout(this.checking);
    this.checking = setTimeout(() => this.check(), CHECK_DELAY_MS);
    try {
      const scene = await ask("scene", { text, known: this.view.background.id });
      if (text !== this.text) return;
      if (this.drag || this.keyMove || this.waiting) { this.isStale = true; return; }  // an object that is being moved would jump back
      this.isStale = false;
      this.scene = scene;
      this.view.show(scene);
      $("facts").classList.remove("bad");
    } catch (error) {
      this.refused(error);
    }
    if (text === this.text) await this.showSelection();
    document.documentElement.dataset.ready = "";
  }

  /** Request the problems and the paths of the current text. */
  async check() {
    const text = this.text;
    try {
      const [found] = await Promise.all([ask("problems", { text }), this.showPreview([])]);
      if (text !== this.text) return;
      this.problems = found.problems;
      this.bad = new Map();
      for (const one of this.problems) if (one.object && this.bad.get(one.object) !== "error") this.bad.set(one.object, one.severity);
      this.view.bad = this.bad;
      this.textPane.showProblems(this.problems);
      this.list.show(this.scene, this.selected, this.bad);
      this.view.draw();
      document.documentElement.dataset.checked = String(this.history.before.length);
    } catch (error) {
      this.refused(error);
    }
  }

  /** Show the paths and clearances after some edits. During a request, only the last further one waits. */
  async showPreview(edits) {
    if (this.previewing) { this.nextPreview = edits; return; }
    this.previewing = true;
    try {
      this.view.preview = await ask("preview", { text: this.text, edits });
      this.showFacts();
      this.view.draw();
    } catch (error) {
      this.refused(error);
    }
    this.previewing = false;
    const next = this.nextPreview;
    this.nextPreview = undefined;
    if (next) await this.showPreview(next);
  }

  /** Show the length of the path and the clearance at the selected stop below the map. */
  showFacts() {
    const preview = this.view.preview, parts = [];
    if (preview.reason) parts.push(preview.reason);
    for (const [key, robot] of Object.entries(preview.robots)) {
      const name = key === "robot" ? "" : `${key.split("/")[1]}: `, missing = robot.legs.filter((leg) => leg.length === null).length;
      const length = robot.legs.reduce((sum, leg) => sum + (leg.length ?? 0), 0);
      if (robot.legs.length) parts.push(missing ? `${name}no path to ${missing} of ${robot.legs.length} goals` : `${name}shortest path ${length.toFixed(2)} m`);
      const stop = this.stopOf(key);
      const clearance = stop < 0 ? null : robot.clearances[stop];
      if (clearance !== null && clearance !== undefined) parts.push(`clearance ${clearance.toFixed(2)} m`);
    }
    $("facts").textContent = parts.join(" · ");
  }

  /** Return the number of the selected stop of a robot: 0 is its start; -1 if none is selected. */
  stopOf(key) {
    const goals = key === "robot" ? "goals" : `${key}/goals`;
    if (this.selected === key) return 0;
    return this.selected.startsWith(`${goals}/`) ? Number(this.selected.slice(goals.length + 1)) + 1 : -1;
  }

  refused(error) {
    if (!(error instanceof Refused)) throw error;
    $("facts").textContent = error.message;
    $("facts").classList.add("bad");
  }

  /** Change values of the text after all earlier changes have been made. */
  edit(edits, what = "", group = "") {
    this.waiting++;
    this.queue = this.queue.then(async () => {
      this.waiting--;
      for (let tries = 0; tries < 3; tries++) {
        const text = this.text;
        try {
          const changed = (await ask("edit", { text, edits })).text;
          if (text !== this.text) continue;
          await this.changed(changed, group);
          if (what) this.say(what);
        } catch (error) {
          await this.refresh();
          this.refused(error);
          this.say(error.message);
        }
        return;
      }
    });
    return this.queue;
  }

  select(id, handle = -1) {
    this.selected = id;
    this.handle = handle;
    return this.showSelection();
  }

  /** Select the object that a line of the text defines. */
  selectLine(line) {
    const found = this.scene.objects.filter((one) => one.at === line && one.editable).at(-1);
    if (found && found.id !== this.selected) this.select(found.id);
  }

  async showSelection() {
    if (this.selected && !this.object) this.selected = "";
    const one = this.object;
    if (this.handle >= (one?.handles.length ?? 0)) this.handle = -1;
    Object.assign(this.view, { selected: this.selected, handle: this.handle });
    this.view.draw();
    this.list.show(this.scene, this.selected, this.bad);
    this.showAdder();
    this.showFacts();
    this.textPane.mark(one?.at ?? 0);
    if (!one) return this.form.show("Nothing is selected", null, false, [el("p", { class: "quiet" }, "Select an object on the map or in the list to see its values.")]);
    const text = this.text;
    try {
      const form = one.editable ? await ask("form", { text, keys: one.keys }) : null;
      if (this.object === one && text === this.text) this.form.show(`${one.label}${positionText(one)}`, form, one.editable, this.tools(one));
    } catch (error) {
      this.refused(error);
    }
  }

  /** Return buttons for the selected object: its points, adding a point, and removing the object. */
  tools(one) {
    if (!one.editable) return [this.elsewhere(one)];
    const points = one.handles.length > 1 ? one.handles.map((_, k) => el("button", { "aria-pressed": k === this.handle ? "true" : "false", onclick: () => this.select(one.id, k), "aria-label": `Point ${k + 1} of ${one.handles.length}` }, String(k + 1))) : [];
    const canAdd = one.points_keys.length && (one.kind === "person" || one.handles[0]?.form !== "keyframe");
    const removable = removalKeys(one, this.handle, this.scene), isOnePoint = this.handle >= 0 && isPoint(one, one.handles[this.handle]);
    return [el("div", { class: "row" }, points.length ? el("span", {}, "Points") : null, ...points,
      canAdd ? el("button", { onclick: () => this.edit([pointEdit(one, this.handle)], "point added") }, "Add a point") : null,
      removable ? el("button", { onclick: () => this.remove() }, isOnePoint ? "Delete this point" : "Delete") : null)];
  }

  /** Return a note on the file that contains an object if the edited file only refers to it. */
  elsewhere(one) {
    const isWorld = one.keys[0] === "world" && this.scene.world_page;
    if (!isWorld) return el("p", {}, "This is written in a file that this one extends. Edit that file to change it.");
    return el("p", {}, "This is written in the world file. ", el("a", { href: this.scene.world_page, target: "_blank" }, `Edit ${this.scene.world_file}`));
  }

  remove() {
    const one = this.object, keys = one && removalKeys(one, this.handle, this.scene);
    if (!keys) return;
    const what = this.handle >= 0 && keys.length > one.keys.length ? "point deleted" : `${one.label} deleted`;
    if (what !== "point deleted") this.selected = "";
    this.handle = -1;
    this.edit([{ op: "remove", keys }], what);
  }

  showAdder() {
    const region = this.object?.kind === "region" ? this.object.label : this.object?.region ?? "";
    const names = addable(this.scene, region), before = $("add").value;
    if (names.join() !== this.added) fill($("add"), ...names.map((name) => el("option", { value: name }, name)));
    this.added = names.join();
    if (names.includes(before)) $("add").value = before;
    $("place").disabled = !names.length;
  }

  /** Add an object of the chosen kind at a point, and select it. */
  async add(point) {
    const region = this.object?.kind === "region" ? this.object.label : this.object?.region ?? "";
    const name = $("add").value, before = new Set(this.scene.objects.map((one) => one.id));
    this.setPlacing("");
    await this.edit(addEdits(name, this.scene, point, region), `${name} added`);
    const found = this.scene.objects.filter((one) => !before.has(one.id)), shown = found.find((one) => one.handles.length) ?? found[0];
    if (shown) await this.select(shown.id);
  }

  setPlacing(name) {
    this.placing = name;
    $("place").textContent = name ? "At the center" : "Place";
    $("map").style.cursor = name ? "crosshair" : "";
    if (name) { $("facts").textContent = `Click where to place: ${name}. Escape cancels.`; this.say($("facts").textContent); }
  }

  /** Write a move by keys that is not in the text yet. */
  async flush() {
    this.keyMove?.write();
    await this.queue;
  }

  async undo() { await this.flush(); if (this.history.undo() !== null) { this.say("undone"); this.refresh(); } }
  async redo() { await this.flush(); if (this.history.redo() !== null) { this.say("redone"); this.refresh(); } }

  async save(overwrite = false) {
    await this.flush();
    const text = this.text;
    try {
      this.version = (await ask("save", { text, version: this.version, overwrite })).version;
      this.savedText = text;
      this.say(`${this.name} saved`);
    } catch (error) {
      if (error.status === 409) return this.showConflict(error);
      this.refused(error);
      this.say(error.message);
    }
    this.showState();
  }

  showConflict(error) {
    $("conflicttext").textContent = error.message;
    $("conflict").showModal();
  }

  async reload() {
    try {
      const opened = await ask("reload");
      this.version = opened.version;
      this.savedText = opened.text;
      await this.changed(opened.text);
    } catch (error) {
      this.refused(error);
    }
  }

  showState() {
    $("undo").disabled = !this.history.before.length;
    $("redo").disabled = !this.history.after.length;
    $("saved").textContent = this.isSaved ? "saved" : "not saved";
  }

  showTab(name) {
    for (const each of ["text", "run"]) {
      $(`${each}tab`).setAttribute("aria-selected", each === name ? "true" : "false");
      $(`${each}panel`).hidden = each !== name;
    }
  }

  listen() {
    $("undo").onclick = () => this.undo();
    $("redo").onclick = () => this.redo();
    $("save").onclick = () => this.save();
    $("run").onclick = async () => { this.showTab("run"); await this.flush(); this.runs.start(this.text); };
    $("texttab").onclick = () => this.showTab("text");
    $("runtab").onclick = () => this.showTab("run");
    $("place").onclick = () => (this.placing ? this.add([this.view.camera.x, this.view.camera.y]) : this.setPlacing($("add").value));
    $("add").onchange = () => this.placing && this.setPlacing($("add").value);
    $("reload").onclick = () => { $("conflict").close(); this.reload(); };
    $("overwrite").onclick = () => { $("conflict").close(); this.save(true); };
    $("cancel").onclick = () => $("conflict").close();
    $("nearer").onclick = () => this.zoom(1.25);
    $("farther").onclick = () => this.zoom(0.8);
    $("fit").onclick = () => { this.view.fit(); this.view.draw(); };
    addEventListener("keydown", (event) => this.key(event), true);
    addEventListener("focus", () => this.refresh());  // the world file may have changed in another tab
    addEventListener("beforeunload", (event) => { if (!this.isSaved) event.preventDefault(); });
    this.listenToPointer($("map"));
  }

  zoom(factor, u = this.view.size[0] / 2, v = this.view.size[1] / 2) {
    this.view.camera.zoom(factor, u, v, ...this.view.size);
    this.view.draw();
  }

  listenToPointer(map) {
    const pointers = new Map();
    let drag = null, pan = null;
    const spread = () => { const [a, b] = [...pointers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
    map.addEventListener("pointerdown", (event) => {
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      map.setPointerCapture(event.pointerId);
      map.focus();
      if (pointers.size === 2) { drag?.cancel(); drag = this.drag = null; pan = spread(); return; }
      const point = this.view.point(event);
      if (this.placing) { this.add(point); return; }
      const hit = event.button === 0 ? this.view.hit(point) : null;
      pan = [event.clientX, event.clientY];
      if (!hit) return;
      if (hit.object.id !== this.selected || (hit.part === "body" && hit.handle !== this.handle)) this.select(hit.object.id, hit.object.handles.length > 1 ? hit.handle : -1);
      if (hit.object.editable && hit.object.handles.length) { drag = new Drag(this.view, hit, point); this.drag = drag; }
    });
    map.addEventListener("pointermove", (event) => {
      if (!pointers.has(event.pointerId)) return;
      const before = pointers.get(event.pointerId);
      if (pointers.size === 2) {
        const was = spread();
        pointers.set(event.pointerId, [event.clientX, event.clientY]);
        const box = map.getBoundingClientRect(), [a, b] = [...pointers.values()];
        this.zoom(spread() / was, (a[0] + b[0]) / 2 - box.left, (a[1] + b[1]) / 2 - box.top);
        return;
      }
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      if (drag) {
        const far = Math.hypot(event.clientX - pan[0], event.clientY - pan[1]) > 3;
        if (!drag.moved && !far) return;
        drag.to(this.view.point(event), event.shiftKey);
        this.view.draw();
        this.showPreview(drag.edits);
      } else {
        this.view.camera.pan(event.clientX - before[0], event.clientY - before[1]);
        this.view.draw();
      }
    });
    const end = (event) => {
      pointers.delete(event.pointerId);
      const done = drag;
      drag = this.drag = null;
      if (done?.moved && !done.cancelled && event.type === "pointerup") this.edit(done.edits, `${done.object.label}${positionText(done.object)}`);
      else if (done?.moved && !done.cancelled) done.cancel();
      if (this.isStale && !(done?.moved && !done.cancelled)) this.refresh();
      this.view.draw();
    };
    map.addEventListener("pointerup", end);
    map.addEventListener("pointercancel", end);
    map.addEventListener("wheel", (event) => {
      event.preventDefault();
      const box = map.getBoundingClientRect();
      this.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), event.clientX - box.left, event.clientY - box.top);
    }, { passive: false });
  }

  key(event) {
    const command = event.ctrlKey || event.metaKey, letter = event.key.toLowerCase();
    const act = (action) => { event.preventDefault(); action(); };
    if (command && letter === "s") return act(() => this.save());
    if (command && letter === "z" && !isField(event.target)) return act(() => (event.shiftKey ? this.redo() : this.undo()));
    if (command && letter === "y" && !isField(event.target)) return act(() => this.redo());
    if (event.key === "Escape") {
      if (this.placing) return act(() => { this.setPlacing(""); this.showFacts(); });
      if (this.drag) return act(() => { this.drag.cancel(); this.drag.cancelled = true; this.view.draw(); this.showPreview([]); });
      return undefined;
    }
    if (!(event.target === $("map") || $("list").contains(event.target))) return undefined;
    const one = this.object;
    if (event.target === $("map") && (event.key === "+" || event.key === "-")) return act(() => this.zoom(event.key === "+" ? 1.25 : 0.8));
    if (!one || !one.editable) return undefined;
    if (event.key === "Delete" || event.key === "Backspace") return act(() => this.remove());
    const turned = moveByKey(one, this.handle, event);
    return turned === null ? undefined : act(() => this.movedByKey(one, turned));
  }

  /** Show a move by a key at once, and write it to the text when no key was pressed for a while. */
  movedByKey(one, turned) {
    this.view.draw();
    const target = `${one.id} ${this.handle}`;
    if (this.keyMove && this.keyMove.target !== target) this.keyMove.write();
    clearTimeout(this.keyMove?.timer);
    const anyTurn = turned || Boolean(this.keyMove?.turned);
    const edits = movedHandles(one, this.handle).map((handle) => handleEdit(handle, anyTurn));
    const write = () => {
      clearTimeout(this.keyMove?.timer);
      this.keyMove = null;
      this.edit(edits, `${one.label}${positionText(one)}`, `keys ${target}`);
    };
    this.keyMove = { target, write, turned: anyTurn, timer: setTimeout(write, KEY_PAUSE_MS) };
    this.showPreview(edits);
  }
}

/** Return whether an element has an undo of its own: a field of a form, but not the text of the file. */
function isField(element) {
  return element !== $("text") && ["INPUT", "TEXTAREA"].includes(element.tagName);
}

try {
  globalThis.editor = new Page(await ask("open"));
  await globalThis.editor.refresh();
} catch (error) {
  $("facts").textContent = error.message;
  throw error;
}
