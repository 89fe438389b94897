// Drawing of the state of a run at a tick on the canvas of a map, in meters.
import { roundLength } from "./camera.js";
import { layerOf } from "./layers.js";

const UNKNOWN_RADIUS = 0.2;
const images = new WeakMap();

/** Draw all visible layers. `view` has context, width, height (CSS pixels), camera, colors, layers, and marked. */
export function drawRun(view, run, tick) {
  const { context: c, width, height, colors } = view;
  c.fillStyle = colors.unknown;
  c.fillRect(0, 0, width, height);
  if (view.layers.has("map")) for (const robot of run.robots.slice(0, 1)) if (robot.map) drawGrid(view, robot.map, run.column, mapColor(colors));
  drawLines(view);
  for (const robot of run.robots) drawCostmaps(view, robot, run, tick);
  if (view.layers.has("zones")) drawZones(view, run, tick);
  for (const robot of run.robots) {
    if (view.layers.has("plan")) drawPath(view, robot.planAt(tick), colors.plan, 3);
    if (view.layers.has("goals")) drawGoals(view, robot, robot.goalAt(tick));
  }
  if (view.layers.has("things")) for (const thing of run.thingsAt(tick)) drawThing(view, thing);
  drawMarks(view, run, tick);
  run.robots.forEach((robot, number) => drawRobot(view, robot, number, tick, run));
  if (view.marked) ring(view, view.marked, colors.select, 0.35 * view.camera.scale + 8);
  drawScale(view);
}

function drawRobot(view, robot, number, tick, run) {
  const { colors, layers } = view, color = number ? colors.other : colors.truth;
  const believed = robot.beliefAt(tick), true_ = robot.truthAt(tick);
  if (layers.has("truth")) drawTrail(view, robot, tick, color);
  if (layers.has("belief")) drawParticles(view, robot.particlesAt(tick));
  if (layers.has("scan")) for (const points of robot.scansAt(tick)) drawPoints(view, points, colors.scan);
  if (layers.has("local")) drawPath(view, robot.localAt(tick), colors.local, 2.5);
  if (layers.has("truth") && true_) drawHull(view, robot, true_, color, true);
  if (layers.has("belief") && believed) drawBelief(view, robot, believed);
  if (run.robots.length > 1 && true_) label(view, robot.name, true_.x, true_.y, color, 22);
}

/** Add a polygon, whose points are in the frame of a pose, to the path of the canvas. */
function outline(view, points, pose) {
  const { context: c } = view, cos = Math.cos(pose.yaw), sin = Math.sin(pose.yaw);
  c.beginPath();
  for (const [x, y] of points) c.lineTo(...spot(view, pose.x + cos * x - sin * y, pose.y + sin * x + cos * y));
  c.closePath();
}

function spot(view, x, y) {
  return view.camera.pixel(x, y, view.width, view.height);
}

function mapColor(colors) {
  const [free, wall, unknown] = [colors.free, colors.wall, colors.unknown].map(rgb);
  return (value) => (value < 0 ? [...unknown, 255] : [...free.map((part, k) => part + (wall[k] - part) * Math.min(value, 100) / 100), 255]);
}

function costColor(colors) {
  const [low, high] = [rgb(colors.belief), rgb(colors.bad)];
  return (value) => (value <= 0 ? [0, 0, 0, 0] : [...low.map((part, k) => part + (high[k] - part) * value / 100), 60 + value]);
}

function drawGrid(view, grid, column, color, cells = null) {
  const { context: c, camera } = view;
  let image = images.get(grid);
  if (!image || image.theme !== view.theme) {
    image = { theme: view.theme, canvas: painted(grid, cells ?? column(grid.cells), color) };
    images.set(grid, image);
  }
  const [u, v] = spot(view, grid.origin[0], grid.origin[1]), size = grid.resolution * camera.scale;
  c.save();
  c.translate(u, v);
  c.rotate(-grid.origin[2]);
  c.scale(size, -size);
  c.imageSmoothingEnabled = size < 1;
  c.drawImage(image.canvas, 0, 0);
  c.restore();
}

function painted(grid, cells, color) {
  const canvas = document.createElement("canvas");
  canvas.width = grid.width;
  canvas.height = grid.height;
  const context = canvas.getContext("2d"), image = context.createImageData(grid.width, grid.height), known = new Map();
  cells.forEach((value, k) => {
    if (!known.has(value)) known.set(value, color(value));
    image.data.set(known.get(value), 4 * k);
  });
  context.putImageData(image, 0, 0);
  return canvas;
}

function rgb(text) {
  const number = parseInt(text.slice(1), 16);
  return [number >> 16, (number >> 8) & 255, number & 255];
}

/** Draw grid lines at round coordinates, with their coordinates at the edges. */
function drawLines(view) {
  const { context: c, camera, width, height, colors } = view, step = roundLength(camera.scale, 130);
  const [x0, y1] = camera.point(0, 0, width, height), [x1, y0] = camera.point(width, height, width, height);
  c.strokeStyle = colors.rule;
  c.fillStyle = colors.faint;
  c.lineWidth = 1;
  c.font = "10px system-ui, sans-serif";
  c.globalAlpha = 0.4;
  const digits = step < 1 ? 1 : 0;
  c.beginPath();
  for (let k = Math.ceil(x0 / step); k * step <= x1; k++) {
    const [u] = spot(view, k * step, 0);
    c.moveTo(Math.round(u) + 0.5, 0);
    c.lineTo(Math.round(u) + 0.5, height);
  }
  for (let k = Math.ceil(y0 / step); k * step <= y1; k++) {
    const [, v] = spot(view, 0, k * step);
    c.moveTo(0, Math.round(v) + 0.5);
    c.lineTo(width, Math.round(v) + 0.5);
  }
  c.stroke();
  c.globalAlpha = 1;
  c.textAlign = "center";
  c.textBaseline = "top";
  for (let k = Math.ceil(x0 / step); k * step <= x1; k++) halo(view, (k * step).toFixed(digits), spot(view, k * step, 0)[0], 3, colors.faint);
  c.textAlign = "left";
  c.textBaseline = "middle";
  for (let k = Math.ceil(y0 / step); k * step <= y1; k++) halo(view, (k * step).toFixed(digits), 4, spot(view, 0, k * step)[1], colors.faint);
}

function halo(view, text, u, v, color) {
  const { context: c, colors } = view;
  c.lineWidth = 3;
  c.lineJoin = "round";
  c.strokeStyle = colors.free;
  c.strokeText(text, u, v);
  c.fillStyle = color;
  c.fillText(text, u, v);
}

function label(view, text, x, y, color, down = 0) {
  const { context: c } = view, [u, v] = spot(view, x, y);
  c.font = "600 12px system-ui, sans-serif";
  c.textAlign = "center";
  c.textBaseline = "middle";
  halo(view, text, u, v + down, color);
}

function drawCostmaps(view, robot, run, tick) {
  for (const costmap of robot.costmaps) {
    const grid = view.layers.has(layerOf(costmap)) && costmapAt(costmap, run, tick);
    if (!grid) continue;
    drawGrid(view, grid, run.column, costColor(view.colors), grid.whole);
    if (layerOf(costmap) === "near") drawEdge(view, grid);
  }
}

/** Draw the edge of a costmap that moves with the robot. */
function drawEdge(view, { origin: [x, y, yaw], width, height, resolution }) {
  const { context: c } = view, [across, along] = [width * resolution, height * resolution];
  outline(view, [[0, 0], [across, 0], [across, along], [0, along]], { x, y, yaw });
  c.strokeStyle = view.colors.belief;
  c.lineWidth = 1;
  c.stroke();
}

/** Return the newest complete grid of a costmap, to which the stored differences have been added. */
function costmapAt(costmap, run, tick) {
  let k = costmap.grids.length - 1;
  while (k >= 0 && costmap.grids[k].tick > tick) k--;
  if (k < 0) return null;
  let first = k;
  while (costmap.grids[first].changes && !costmap.grids[first].whole) first--;
  for (let j = first; j <= k; j++) {
    const grid = costmap.grids[j];
    if (grid.whole) continue;
    const cells = run.column(grid.cells);
    grid.whole = grid.changes ? cells.map((value, i) => value + costmap.grids[j - 1].whole[i]) : cells;
  }
  return costmap.grids[k];
}

/** Draw ramps, floors, and enabled zones. Regions of zones that are not enabled now are not drawn. */
function drawZones(view, run, tick) {
  const { colors } = view;
  for (const ground of run.scenery.ground) drawArea(view, ground.outline, colors.ground, "");
  for (const floor of run.scenery.floors) drawArea(view, floor.outline, colors.thing, `friction ${floor.friction}`);
  for (const zone of run.zonesAt(tick)) {
    const color = zone.filter === "keepout" ? colors.bad : colors.zone, said = zone.filter === "keepout" ? "keep out" : `${zone.limit} m/s`;
    if (zone.mask) for (const block of zone.mask.blocks) drawHatched(view, boxOf(zone.mask, block), color, "");
    else if (run.regions[zone.region]) drawHatched(view, run.regions[zone.region], color, `${said}: ${zone.region}`);
  }
}

const STILL = { x: 0, y: 0, yaw: 0 };

function drawArea(view, points, color, said) {
  const { context: c } = view;
  outline(view, points, STILL);
  c.fillStyle = color;
  c.globalAlpha = 0.18;
  c.fill();
  c.globalAlpha = 0.7;
  c.strokeStyle = color;
  c.lineWidth = 1;
  c.stroke();
  c.globalAlpha = 1;
  if (said) label(view, said, ...middle(points), color);
}

function drawHatched(view, points, color, said) {
  const { context: c } = view;
  outline(view, points, STILL);
  c.save();
  c.clip();
  hatch(view, points, color);
  c.restore();
  outline(view, points, STILL);
  c.strokeStyle = color;
  c.lineWidth = 1.5;
  c.setLineDash([6, 4]);
  c.stroke();
  c.setLineDash([]);
  if (said) corner(view, said, points, color);
}

/** Draw a name in the upper left corner of an area, so that its middle stays free. */
function corner(view, text, points, color) {
  const { context: c } = view, [u, v] = spot(view, Math.min(...points.map((p) => p[0])), Math.max(...points.map((p) => p[1])));
  c.font = "600 11px system-ui, sans-serif";
  c.textAlign = "left";
  c.textBaseline = "top";
  halo(view, text, Math.max(u, 0) + 6, Math.max(v, 16) + 5, color);
}

function boxOf({ origin: [ox, oy, yaw], resolution }, [column, row, width, height]) {
  const c = Math.cos(yaw), s = Math.sin(yaw);
  const corners = [[column, row], [column + width, row], [column + width, row + height], [column, row + height]].map(([i, j]) => [i * resolution, j * resolution]);
  return corners.map(([x, y]) => [ox + c * x - s * y, oy + s * x + c * y]);
}

function hatch(view, points, color) {
  const { context: c } = view, pixels = points.map(([x, y]) => spot(view, x, y));
  const us = pixels.map(([u]) => u), vs = pixels.map(([, v]) => v);
  const [u0, u1] = [Math.max(Math.min(...us), 0), Math.min(Math.max(...us), view.width)];
  const [v0, v1] = [Math.max(Math.min(...vs), 0), Math.min(Math.max(...vs), view.height)];
  c.strokeStyle = color;
  c.globalAlpha = 0.35;
  c.lineWidth = 1;
  c.beginPath();
  for (let u = u0 - (v1 - v0); u < u1; u += 9) {
    c.moveTo(u, v1);
    c.lineTo(u + (v1 - v0), v0);
  }
  c.stroke();
  c.globalAlpha = 1;
}

function middle(points) {
  return [0, 1].map((axis) => (Math.min(...points.map((p) => p[axis])) + Math.max(...points.map((p) => p[axis]))) / 2);
}

function drawPath(view, path, color, width) {
  if (!path || path.x.length < 2) return;
  const { context: c } = view;
  c.beginPath();
  path.x.forEach((x, k) => c.lineTo(...spot(view, x, path.y[k])));
  c.strokeStyle = color;
  c.lineWidth = width;
  c.lineJoin = "round";
  c.stroke();
}

function drawGoals(view, robot, active) {
  const { context: c, camera, colors } = view, told = new Map();
  for (const goal of robot.goals) {
    const [x, y, yaw] = goal.pose, [u, v] = spot(view, x, y), now = active?.name === goal.name || active?.name.startsWith(`${goal.name}#`);
    const reach = Math.max(goal.xy * camera.scale, 5);
    c.beginPath();
    c.arc(u, v, reach, 0, 2 * Math.PI);
    c.fillStyle = colors.goal;
    c.globalAlpha = now ? 0.3 : 0.1;
    c.fill();
    c.globalAlpha = 1;
    c.strokeStyle = colors.goal;
    c.lineWidth = now ? 2.5 : 1.2;
    c.stroke();
    if (!goal.via) {
      c.beginPath();
      c.moveTo(u, v);
      c.lineTo(u + (reach + 9) * Math.cos(yaw), v - (reach + 9) * Math.sin(yaw));
      c.stroke();
    }
    const key = `${x} ${y}`;
    told.set(key, [...(told.get(key) ?? []), goal.name]);
    if (told.get(key).length === 1) label(view, goal.name, x, y, colors.goal, -reach - 10);
  }
}

function drawThing(view, thing) {
  const { context: c, colors } = view, color = thing.person ? colors.person : colors.thing;
  const parts = thing.parts?.length ? thing.parts : [circle(UNKNOWN_RADIUS)];
  for (const part of parts) {
    outline(view, part, thing.pose);
    c.globalAlpha = 0.4;
    c.fillStyle = color;
    c.fill();
    c.globalAlpha = 1;
    c.strokeStyle = color;
    c.lineWidth = 1.5;
    c.stroke();
  }
  if (thing.person) drawHeading(view, thing.pose, color, 0.3);
  nameThing(view, thing, parts, color);
}

/** Draw the name of an object above it. Names of objects of the world, such as doors, are small and faint. */
function nameThing(view, thing, parts, color) {
  const { context: c, colors } = view, cos = Math.cos(thing.pose.yaw), sin = Math.sin(thing.pose.yaw);
  const corners = parts.flat().map(([x, y]) => spot(view, thing.pose.x + cos * x - sin * y, thing.pose.y + sin * x + cos * y));
  const us = corners.map(([u]) => u);
  c.font = thing.brought ? "600 12px system-ui, sans-serif" : "10px system-ui, sans-serif";
  c.textAlign = "center";
  c.textBaseline = "bottom";
  halo(view, thing.name, (Math.min(...us) + Math.max(...us)) / 2, Math.min(...corners.map(([, v]) => v)) - 4, thing.brought ? color : colors.faint);
}

function drawHeading(view, pose, color, length) {
  const { context: c } = view;
  c.beginPath();
  c.moveTo(...spot(view, pose.x, pose.y));
  c.lineTo(...spot(view, pose.x + length * Math.cos(pose.yaw), pose.y + length * Math.sin(pose.yaw)));
  c.strokeStyle = color;
  c.lineWidth = 2;
  c.stroke();
}

function circle(radius) {
  return Array.from({ length: 24 }, (_, k) => [radius * Math.cos((k * Math.PI) / 12), radius * Math.sin((k * Math.PI) / 12)]);
}

/** Draw the true path of a robot: its past strong, its future faint. */
function drawTrail(view, robot, tick, color) {
  const { context: c } = view, { ticks, x, y } = robot.truth;
  for (const past of [false, true]) {
    c.beginPath();
    for (let k = 0; k < ticks.length; k++) {
      if (past && ticks[k] > tick) break;
      const jumped = k && Math.hypot(x[k] - x[k - 1], y[k] - y[k - 1]) > 0.5;
      if (k && !jumped) c.lineTo(...spot(view, x[k], y[k]));
      else c.moveTo(...spot(view, x[k], y[k]));
    }
    c.strokeStyle = color;
    c.globalAlpha = past ? 0.85 : 0.22;
    c.lineWidth = past ? 1.8 : 1.5;
    c.setLineDash(past ? [] : [2, 4]);
    c.stroke();
  }
  c.setLineDash([]);
  c.globalAlpha = 1;
}

function drawHull(view, robot, pose, color, solid) {
  const { context: c, colors } = view, hull = robot.footprint.length > 2 ? robot.footprint : circle(UNKNOWN_RADIUS);
  outline(view, hull, pose);
  c.fillStyle = color;
  c.globalAlpha = solid ? 0.85 : 0.12;
  c.fill();
  c.globalAlpha = 1;
  c.strokeStyle = solid ? colors.free : color;
  c.lineWidth = solid ? 1.5 : 2;
  c.setLineDash(solid ? [] : [5, 3]);
  c.stroke();
  c.setLineDash([]);
  const nose = Math.max(...hull.map(([x]) => x)), side = Math.max(...hull.map(([, y]) => y));
  outline(view, [[0.3 * nose, -0.45 * side], [0.9 * nose, 0], [0.3 * nose, 0.45 * side]], pose);
  c.fillStyle = solid ? colors.free : color;
  c.fill();
}

function drawBelief(view, robot, believed) {
  const { context: c, camera, colors } = view, [u, v] = spot(view, believed.x, believed.y), { a, b, yaw } = believed.ellipse;
  c.beginPath();
  c.ellipse(u, v, Math.max(a * camera.scale, 1), Math.max(b * camera.scale, 1), -yaw, 0, 2 * Math.PI);
  c.fillStyle = colors.belief;
  c.globalAlpha = 0.16;
  c.fill();
  c.globalAlpha = 1;
  c.strokeStyle = colors.belief;
  c.lineWidth = 1;
  c.stroke();
  drawHull(view, robot, believed, colors.belief, false);
}

function drawParticles(view, cloud) {
  if (!cloud) return;
  const { context: c, colors, camera } = view, reach = Math.min(0.12 * camera.scale, 9);
  c.strokeStyle = colors.belief;
  c.globalAlpha = 0.45;
  c.lineWidth = 1;
  c.beginPath();
  cloud.x.forEach((x, k) => {
    const [u, v] = spot(view, x, cloud.y[k]);
    c.moveTo(u, v);
    c.lineTo(u + reach * Math.cos(cloud.yaw[k]), v - reach * Math.sin(cloud.yaw[k]));
  });
  c.stroke();
  c.globalAlpha = 1;
}

function drawPoints(view, points, color) {
  const { context: c } = view, size = Math.min(Math.max(view.camera.scale * 0.04, 2), 5);
  c.fillStyle = color;
  for (let k = 0; k < points.length; k += 2) {
    const [u, v] = spot(view, points[k], points[k + 1]);
    c.fillRect(u - size / 2, v - size / 2, size, size);
  }
}

/** Draw collisions that have begun, violations, and a ring around the selected one. */
function drawMarks(view, run, tick) {
  const { colors } = view;
  for (const event of run.events) {
    if (event.kind === "collision.started" && event.place && event.tick <= tick) star(view, event.place, colors.bad);
    if (event.kind === "mark" && event.tick <= tick) label(view, `⚑ ${event.name}`, ...spotOf(run, event), colors.fault, -14);
  }
  for (const { verdict, finding } of run.failures) {
    if (finding.place) crossed(view, finding.place, verdict.severity === "warn" ? colors.odd : colors.bad);
  }
}

function spotOf(run, event) {
  const robot = run.robots.find((one) => one.name === (event.robot ?? "")) ?? run.robots[0], pose = robot.placeAt(event.tick);
  return event.place ?? [pose.x, pose.y];
}

function star(view, [x, y], color) {
  const { context: c } = view, [u, v] = spot(view, x, y);
  c.beginPath();
  for (let k = 0; k < 16; k++) {
    const reach = k % 2 ? 5 : 11, angle = (k * Math.PI) / 8;
    c.lineTo(u + reach * Math.cos(angle), v + reach * Math.sin(angle));
  }
  c.closePath();
  c.fillStyle = color;
  c.fill();
  c.strokeStyle = view.colors.free;
  c.lineWidth = 1;
  c.stroke();
}

/** Draw a cross on a pin, so that the object at this position remains visible. */
function crossed(view, [x, y], color) {
  const { context: c } = view, [u, foot] = spot(view, x, y), v = foot - Math.max(0.35 * view.camera.scale, 10) - 16;
  c.beginPath();
  c.moveTo(u, foot);
  c.lineTo(u, v);
  c.strokeStyle = color;
  c.lineWidth = 1.5;
  c.stroke();
  c.beginPath();
  c.arc(u, foot, 2.5, 0, 2 * Math.PI);
  c.fillStyle = color;
  c.fill();
  c.beginPath();
  c.arc(u, v, 10, 0, 2 * Math.PI);
  c.fillStyle = view.colors.free;
  c.fill();
  c.strokeStyle = color;
  c.lineWidth = 2;
  c.stroke();
  c.lineWidth = 3;
  c.beginPath();
  for (const [a, b] of [[-4, -4], [-4, 4]]) {
    c.moveTo(u + a, v + b);
    c.lineTo(u - a, v - b);
  }
  c.stroke();
}

function ring(view, [x, y], color, reach) {
  const { context: c } = view, [u, v] = spot(view, x, y);
  c.beginPath();
  c.arc(u, v, Math.max(reach, 17), 0, 2 * Math.PI);
  c.strokeStyle = color;
  c.lineWidth = 3;
  c.stroke();
}

function drawScale(view) {
  const { context: c, camera, colors, height } = view, length = roundLength(camera.scale, 160), wide = length * camera.scale;
  const u = 40, v = height - 16;
  c.strokeStyle = colors.ink;
  c.lineWidth = 2;
  c.beginPath();
  c.moveTo(u, v - 4);
  c.lineTo(u, v);
  c.lineTo(u + wide, v);
  c.lineTo(u + wide, v - 4);
  c.stroke();
  c.font = "11px system-ui, sans-serif";
  c.textAlign = "center";
  c.textBaseline = "bottom";
  halo(view, `${length} m`, u + wide / 2, v - 3, colors.ink);
}
