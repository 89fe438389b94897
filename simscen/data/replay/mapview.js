// Map that can be moved by dragging, wheel, pinch, and keys. Two maps side by side have the same camera.
import { drawRun } from "./draw.js";
import { el, fill } from "./dom.js";

const STEP = 60;

/** Canvas with the map of a run. `told` is called when the user has moved the camera. */
export class MapView {
  constructor(run, camera, told) {
    this.run = run;
    this.camera = camera;
    this.told = told;
    this.pointers = new Map();
    this.spot = el("output", { class: "spot", "aria-hidden": "true" });
    this.canvas = el("canvas", {
      tabindex: "0",
      role: "application",
      "aria-label": `Map of ${run.letter ? `run ${run.letter}` : "the run"}. Arrow keys move it, plus and minus zoom, zero shows all.`,
      onpointerdown: (event) => this.#down(event),
      onpointermove: (event) => this.#move(event),
      onpointerup: (event) => this.#up(event),
      onpointercancel: (event) => this.#up(event),
      onpointerleave: () => (this.spot.textContent = ""),
      onwheel: (event) => this.#wheel(event),
      ondblclick: () => told("fit"),
      onkeydown: (event) => this.#key(event),
    });
    const letter = run.letter ? el("span", { class: `pill letter ${run.outcome}`, "aria-hidden": "true" }, run.letter) : null;
    this.chips = el("div", { class: "chips" });
    this.element = el("div", { class: "map" }, this.canvas, this.spot, el("div", { class: "corner" }, letter, this.chips));
  }

  /** Size of the map in CSS pixels. */
  get size() {
    return [this.canvas.clientWidth, this.canvas.clientHeight];
  }

  draw(tick, { colors, theme, layers, marked }) {
    const [width, height] = this.size, dense = globalThis.devicePixelRatio || 1;
    const across = Math.round(width * dense), along = Math.round(height * dense);
    if (this.canvas.width !== across || this.canvas.height !== along) [this.canvas.width, this.canvas.height] = [across, along];
    const context = this.canvas.getContext("2d");
    context.setTransform(dense, 0, 0, dense, 0, 0);
    this.#tell(tick);
    drawRun({ context, width, height, camera: this.camera, colors, theme, layers, marked }, this.run, tick);
  }

  /** Return the text of the active faults and recoveries. */
  #tell(tick) {
    const going = ["faults", "recoveries"].flatMap((lane) => this.run.going(lane, tick)), key = going.map((event) => event.number).join(" ");
    if (key === this.told_) return;
    this.told_ = key;
    fill(this.chips, ...going.map((event) => el("span", { class: `chip ${event.lane}` }, [event.robot, event.name].filter(Boolean).join(": "))));
  }

  /** Return the rectangle around the known part of the map, the paths, and the goals. */
  bounds() {
    const xs = [], ys = [];
    for (const robot of this.run.robots) {
      for (const way of [robot.truth, robot.belief ?? robot.truth]) {
        xs.push(...minmax(way.x));
        ys.push(...minmax(way.y));
      }
      for (const goal of robot.goals) {
        xs.push(goal.pose[0]);
        ys.push(goal.pose[1]);
      }
      if (robot.map) knownCorners(robot.map, this.run.column).forEach(([x, y]) => (xs.push(x), ys.push(y)));
    }
    return xs.length ? [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)] : [-1, -1, 1, 1];
  }

  zoom(factor) {
    const [width, height] = this.size;
    this.camera.zoom(factor, width / 2, height / 2, width, height);
    this.told("moved");
  }

  #down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
  }

  #move(event) {
    const [width, height] = this.size, [x, y] = this.camera.point(event.offsetX, event.offsetY, width, height);
    this.spot.textContent = `${x.toFixed(2)}, ${y.toFixed(2)} m`;
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.offsetX, event.offsetY], others = [...this.pointers].filter(([id]) => id !== event.pointerId);
    this.pointers.set(event.pointerId, now);
    if (others.length) this.#pinch(others[0][1], before, now);
    else this.camera.pan(now[0] - before[0], now[1] - before[1]);
    this.told("moved");
  }

  #pinch(still, before, now) {
    const apart = (point) => Math.hypot(point[0] - still[0], point[1] - still[1]), [width, height] = this.size;
    this.camera.pan((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
    if (apart(before) > 0) this.camera.zoom(apart(now) / apart(before), (now[0] + still[0]) / 2, (now[1] + still[1]) / 2, width, height);
  }

  #up(event) {
    this.pointers.delete(event.pointerId);
  }

  #wheel(event) {
    event.preventDefault();
    const [width, height] = this.size;
    this.camera.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), event.offsetX, event.offsetY, width, height);
    this.told("moved");
  }

  #key(event) {
    const moves = { ArrowLeft: [STEP, 0], ArrowRight: [-STEP, 0], ArrowUp: [0, STEP], ArrowDown: [0, -STEP] };
    if (!moves[event.key] || event.ctrlKey || event.metaKey || event.altKey || event.shiftKey) return;
    event.preventDefault();
    event.stopPropagation();
    this.camera.pan(...moves[event.key]);
    this.told("moved");
  }
}

function minmax(values) {
  let least = Infinity, most = -Infinity;
  for (const value of values) {
    if (value < least) least = value;
    if (value > most) most = value;
  }
  return least <= most ? [least, most] : [];
}

/** Return the corners of the known part of a map. */
function knownCorners(grid, column) {
  const cells = column(grid.cells);
  let [left, right, low, high] = [grid.width, 0, grid.height, 0];
  for (let k = 0; k < cells.length; k++) {
    if (cells[k] < 0) continue;
    const across = k % grid.width, along = (k - across) / grid.width;
    if (across < left) left = across;
    if (across >= right) right = across + 1;
    if (along < low) low = along;
    if (along >= high) high = along + 1;
  }
  const [ox, oy, yaw] = grid.origin, c = Math.cos(yaw), s = Math.sin(yaw);
  const corners = left < right ? [[left, low], [right, low], [right, high], [left, high]] : [];
  return corners.map(([i, j]) => [i * grid.resolution, j * grid.resolution]).map(([x, y]) => [ox + c * x - s * y, oy + s * x + c * y]);
}
