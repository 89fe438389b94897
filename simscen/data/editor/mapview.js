// Map: a canvas that shows the scene, and finds the object at a point.

import { Camera, roundLength } from "./camera.js";
import { bounds, distanceToLine, inside, placed } from "./geometry.js";

const HANDLE = 6, REACH = 11, TURN_PIXELS = 46;
const COLORS = { robot: "robot", estimate: "place", goal: "goal", person: "person", spawn: "thing", obstacle: "wall", object: "thing", wall: "wall",
  door: "zone", ramp: "zone", place: "place", region: "region", keepout: "zone", "speed zone": "zone", trigger: "trigger", path: "thing",
  teleport: "thing", kidnap: "trigger", action: "zone", criterion: "region" };
const BEHIND = ["region", "wall", "ramp", "door", "obstacle", "keepout", "speed zone", "action", "criterion"];
const FALLBACK_FOOTPRINT = Array.from({ length: 16 }, (_, k) => [0.2 * Math.cos((k * Math.PI) / 8), 0.2 * Math.sin((k * Math.PI) / 8)]);

export class MapView {
  constructor(canvas) {
    this.canvas = canvas;
    this.camera = new Camera();
    this.scene = { objects: [], regions: {}, background: null };
    this.background = { id: "", bounds: null };
    this.image = null;
    this.preview = { robots: {} };
    this.selected = "";
    this.handle = -1;
    this.bad = new Map();
    this.size = [0, 0];
    this.fitted = false;
    new ResizeObserver(() => this.resize()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  show(scene) {
    this.scene = scene;
    if (scene.background) {
      this.background = scene.background;
      this.image = null;
      if (scene.background.image) {
        const image = new Image();
        image.onload = () => { this.image = image; this.draw(); };
        image.src = scene.background.image.url;
      }
    }
    if (!this.fitted) this.fit();
    this.draw();
  }

  resize() {
    const { clientWidth: w, clientHeight: h } = this.canvas, dense = devicePixelRatio || 1;
    this.size = [w, h];
    this.canvas.width = Math.round(w * dense);
    this.canvas.height = Math.round(h * dense);
    if (!this.fitted) this.fit();
    this.draw();
  }

  fit() {
    const points = this.scene.objects.flatMap((one) => one.handles.map((handle) => [handle.x, handle.y]));
    const ground = this.background.bounds;
    if (ground) points.push([ground[0], ground[1]], [ground[2], ground[3]]);
    const around = bounds(points);
    if (!around || !this.size[0]) return;
    const [x0, y0, x1, y1] = around;
    this.camera.fit([x0 - 0.5, y0 - 0.5, x1 + 0.5, y1 + 0.5], ...this.size);
    this.fitted = true;
  }

  pixel(x, y) { return this.camera.pixel(x, y, ...this.size); }

  point(event) {
    const box = this.canvas.getBoundingClientRect();
    return this.camera.point(event.clientX - box.left, event.clientY - box.top, ...this.size);
  }

  get object() { return this.scene.objects.find((one) => one.id === this.selected) ?? null; }

  /** Return the outline of a robot from the preview, or a disc before there is a preview. */
  footprint(one) {
    const key = one.kind === "estimate" ? one.id.replace("/initial_estimate", "") : one.id;
    return this.preview.robots[key]?.footprint ?? FALLBACK_FOOTPRINT;
  }

  outlines(one) {
    if (["robot", "estimate", "kidnap"].includes(one.kind)) return [one.kind === "kidnap" ? this.anyFootprint() : this.footprint(one)];
    return one.parts;
  }

  anyFootprint() { return Object.values(this.preview.robots)[0]?.footprint ?? FALLBACK_FOOTPRINT; }

  /** Return the center of the circle of an object: its first handle, or the object that it follows. */
  center(one) {
    if (one.follows) return this.scene.objects.find((other) => other.label === one.follows || other.id === `robots/${one.follows}`)?.handles[0] ?? null;
    return one.handles[0] ?? null;
  }

  line(one) {
    const points = one.handles.map((handle) => [handle.x, handle.y]);
    return one.origin && one.line ? [one.origin, ...points] : points;
  }

  turnKnob(one) {
    const handle = one.handles[Math.max(this.handle, 0)] ?? one.handles[0];
    if (!handle || handle.yaw === null) return null;
    const reach = TURN_PIXELS / this.camera.scale;
    return [handle.x + reach * Math.cos(handle.yaw), handle.y + reach * Math.sin(handle.yaw)];
  }

  radiusKnob(one) {
    const center = one.radius_keys.length ? this.center(one) : null;
    return center ? [center.x + one.radius, center.y] : null;
  }

  /** Return what is at a point: {object, handle, part}; part is "body", "turn", or "radius". Returns null for nothing. */
  hit([x, y]) {
    const reach = REACH / this.camera.scale, near = (point) => point && Math.hypot(point[0] - x, point[1] - y) <= reach;
    const selected = this.object;
    if (selected?.editable) {
      if (near(this.turnKnob(selected))) return { object: selected, handle: Math.max(this.handle, 0), part: "turn" };
      if (near(this.radiusKnob(selected))) return { object: selected, handle: 0, part: "radius" };
    }
    const order = [...this.scene.objects].sort((a, b) => this.rank(b) - this.rank(a));
    for (const one of selected ? [selected, ...order] : order) {
      const handle = one.handles.findIndex((each) => near([each.x, each.y]));
      if (handle >= 0) return { object: one, handle, part: "body" };
    }
    for (const one of order) {
      if (one.handles.length && this.outlines(one).some((part) => inside(placed(part, one.handles[0]), [x, y]))) return { object: one, handle: 0, part: "body" };
      const line = this.line(one), wide = Math.max(one.width / 2, reach * 0.7);
      if (one.line && line.length > 1 && distanceToLine([x, y], line, one.line === "closed") <= wide) return { object: one, handle: -1, part: "body" };
    }
    for (const one of order) {
      if (one.line === "closed" && inside(this.line(one), [x, y])) return { object: one, handle: -1, part: "body" };
    }
    return null;
  }

  rank(one) { return BEHIND.includes(one.kind) ? BEHIND.indexOf(one.kind) - BEHIND.length : 0; }

  draw() {
    const pen = this.canvas.getContext("2d"), [w, h] = this.size, dense = devicePixelRatio || 1;
    if (!w) return;
    const style = getComputedStyle(document.documentElement);
    this.color = (name) => style.getPropertyValue(`--${name}`).trim() || "gray";
    pen.setTransform(dense, 0, 0, dense, 0, 0);
    pen.fillStyle = this.color(this.background.image ? "unknown" : "map");
    pen.fillRect(0, 0, w, h);
    this.drawGround(pen);
    this.drawGrid(pen);
    const order = [...this.scene.objects].sort((a, b) => this.rank(a) - this.rank(b));
    for (const one of order) this.drawObject(pen, one);
    for (const [key, robot] of Object.entries(this.preview.robots)) this.drawPath(pen, key, robot);
    if (this.object) this.drawKnobs(pen, this.object);
    this.drawRuler(pen);
  }

  trace(pen, points, closed) {
    pen.beginPath();
    points.forEach(([x, y], k) => (k ? pen.lineTo(...this.pixel(x, y)) : pen.moveTo(...this.pixel(x, y))));
    if (closed) pen.closePath();
  }

  drawGround(pen) {
    const { image, segments } = this.background;
    if (image && this.image) {
      const [x, y, yaw] = image.origin, [u, v] = this.pixel(x, y), scale = this.camera.scale;
      pen.save();
      pen.translate(u, v);
      pen.rotate(-yaw);
      pen.imageSmoothingEnabled = false;
      pen.globalAlpha = 0.8;
      if (matchMedia("(prefers-color-scheme: dark)").matches) pen.filter = "invert(0.86)";
      pen.drawImage(this.image, 0, -image.size[1] * scale, image.size[0] * scale, image.size[1] * scale);
      pen.restore();
    }
    if (segments) {
      pen.strokeStyle = this.color("wall");
      pen.lineWidth = 1.5;
      pen.beginPath();
      for (const [ax, ay, bx, by] of segments) {
        pen.moveTo(...this.pixel(ax, ay));
        pen.lineTo(...this.pixel(bx, by));
      }
      pen.stroke();
    }
  }

  drawGrid(pen) {
    const step = this.camera.scale >= 14 ? 1 : 10, [w, h] = this.size;
    const [left, top] = this.camera.point(0, 0, w, h), [right, bottom] = this.camera.point(w, h, w, h);
    pen.strokeStyle = this.color("ink");
    pen.globalAlpha = 0.07;
    pen.lineWidth = 1;
    pen.beginPath();
    for (let x = Math.ceil(left / step) * step; x <= right; x += step) { const [u] = this.pixel(x, 0); pen.moveTo(u, 0); pen.lineTo(u, h); }
    for (let y = Math.ceil(bottom / step) * step; y <= top; y += step) { const [, v] = this.pixel(0, y); pen.moveTo(0, v); pen.lineTo(w, v); }
    pen.stroke();
    pen.globalAlpha = 1;
  }

  drawObject(pen, one) {
    const color = this.color(COLORS[one.kind] ?? "thing"), chosen = one.id === this.selected, line = this.line(one);
    pen.strokeStyle = pen.fillStyle = color;
    pen.lineWidth = chosen ? 3 : 1.6;
    pen.globalAlpha = one.editable ? 1 : 0.6;
    this.strength = pen.globalAlpha;
    if (one.region && this.scene.regions[one.region] && (chosen || one.kind !== "criterion")) {
      this.trace(pen, this.scene.regions[one.region], true);
      this.fillAndStroke(pen, 0.16);
    }
    if (one.line && line.length > 1) {
      this.trace(pen, line, one.line === "closed");
      if (one.line === "closed" && one.kind === "region") this.fillAndStroke(pen, chosen ? 0.2 : 0.09);
      else {
        const wide = one.width ? Math.max(one.width * this.camera.scale, 2) : 0;
        if (wide) { pen.lineWidth = wide; pen.globalAlpha = one.kind === "ramp" ? 0.45 : this.strength; }
        else pen.setLineDash([6, 4]);
        pen.stroke();
        pen.globalAlpha = this.strength;
        pen.lineWidth = chosen ? 3 : 1.6;
      }
      pen.setLineDash([]);
    }
    if (one.handles.length) {
      for (const part of this.outlines(one)) {
        this.trace(pen, placed(part, one.handles[0]), true);
        this.fillAndStroke(pen, one.kind === "obstacle" ? 0.55 : one.kind === "estimate" ? 0 : 0.3);
      }
    }
    const center = one.radius ? this.center(one) : null;
    if (center) {
      pen.setLineDash([3, 3]);
      pen.beginPath();
      pen.arc(...this.pixel(center.x, center.y), one.radius * this.camera.scale, 0, 2 * Math.PI);
      this.fillAndStroke(pen, 0.08);
    }
    pen.setLineDash([]);
    pen.globalAlpha = 1;
    one.handles.forEach((handle, k) => this.drawHandle(pen, one, handle, k, chosen));
    this.drawName(pen, one, chosen);
  }

  fillAndStroke(pen, alpha) {
    pen.globalAlpha = alpha * this.strength;
    pen.fill();
    pen.globalAlpha = this.strength;
    pen.stroke();
  }

  drawHandle(pen, one, handle, k, chosen) {
    const [u, v] = this.pixel(handle.x, handle.y);
    if (handle.yaw !== null && !["obstacle", "object", "spawn"].includes(one.kind)) {
      const long = one.kind === "robot" ? 18 : 14;
      pen.lineWidth = 2;
      pen.beginPath();
      pen.moveTo(u, v);
      pen.lineTo(u + long * Math.cos(handle.yaw), v - long * Math.sin(handle.yaw));
      pen.stroke();
    }
    if (!chosen && ["wall", "door", "ramp", "region", "obstacle", "object"].includes(one.kind)) return;
    pen.beginPath();
    pen.arc(u, v, chosen ? HANDLE : HANDLE - 2, 0, 2 * Math.PI);
    pen.fill();
    if (chosen && k === this.handle) { pen.strokeStyle = this.color("select"); pen.lineWidth = 3; pen.stroke(); pen.strokeStyle = pen.fillStyle; }
  }

  drawName(pen, one, chosen) {
    const at = one.handles[0] ?? (one.region && chosen ? { x: this.scene.regions[one.region]?.[0]?.[0], y: this.scene.regions[one.region]?.[0]?.[1] } : null);
    const problem = this.bad.get(one.id);
    if (!at || at.x === undefined) return;
    const [u, v] = this.pixel(at.x, at.y);
    const named = chosen || problem || ["robot", "goal", "person", "spawn", "place", "region", "trigger"].includes(one.kind);
    pen.font = "12px system-ui, sans-serif";
    if (problem) {
      pen.strokeStyle = this.color(problem === "error" ? "bad" : "warn");
      pen.lineWidth = 3;
      pen.beginPath();
      pen.arc(u, v, 15, 0, 2 * Math.PI);
      pen.stroke();
    }
    if (!named || (!chosen && !problem && this.camera.scale < 14)) return;
    const text = problem ? `⚠ ${one.label}` : one.label;
    pen.lineWidth = 3;
    pen.strokeStyle = this.color("map");
    pen.strokeText(text, u + 10, v - 8);
    pen.fillStyle = this.color(problem === "error" ? "bad" : "ink");
    pen.fillText(text, u + 10, v - 8);
  }

  drawKnobs(pen, one) {
    if (!one.editable) return;
    for (const knob of [this.turnKnob(one), this.radiusKnob(one)]) {
      if (!knob) continue;
      const [u, v] = this.pixel(...knob);
      pen.fillStyle = this.color("page");
      pen.strokeStyle = this.color("select");
      pen.lineWidth = 2;
      pen.beginPath();
      pen.arc(u, v, HANDLE, 0, 2 * Math.PI);
      pen.fill();
      pen.stroke();
    }
  }

  drawPath(pen, key, robot) {
    for (const leg of robot.legs) {
      pen.strokeStyle = this.color(leg.length === null ? "bad" : "path");
      pen.lineWidth = 2;
      pen.setLineDash(leg.length === null ? [2, 6] : [9, 5]);
      this.trace(pen, leg.points, false);
      pen.stroke();
    }
    pen.setLineDash([]);
    const goals = this.scene.objects.filter((one) => one.kind === "goal" && one.keys.length === (key === "robot" ? 2 : 4) && one.id.startsWith(key === "robot" ? "goals/" : `${key}/goals/`));
    pen.strokeStyle = this.color("goal");
    pen.lineWidth = 1;
    for (const goal of goals) {
      if (!goal.handles.length) continue;
      this.trace(pen, placed(robot.footprint, goal.handles[0]), true);
      pen.stroke();
    }
  }

  drawRuler(pen) {
    const meters = roundLength(this.camera.scale, 140), wide = meters * this.camera.scale, [w, h] = this.size;
    pen.fillStyle = this.color("ink");
    pen.fillRect(w - wide - 14, h - 14, wide, 3);
    pen.font = "12px system-ui, sans-serif";
    pen.fillText(`${meters} m`, w - wide - 14, h - 20);
  }
}
