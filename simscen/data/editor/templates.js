// Kinds of objects that can be added to a file, and the edits that add or remove them.

import { snapped } from "./geometry.js";

/** Return a name that no object has yet, such as "goal 2". */
function freeName(scene, base) {
  const taken = new Set(scene.objects.flatMap((one) => [one.label, one.label.replace(/^goal /, ""), String(one.keys.at(-1) ?? "")]));
  if (!taken.has(base)) return base;
  for (let number = 2; ; number++) if (!taken.has(`${base} ${number}`)) return `${base} ${number}`;
}

const event = (name, when, action) => ({ name, when, do: action });

/** Kinds of objects by name. `make(scene, x, y, region)` returns the edits; `needs` is "inline" (a world in this file) or "region". */
const THINGS = {
  Goal: { scenario: true, make: (scene, x, y) => [{ op: "add", keys: goalKeys(scene), value: { name: freeName(scene, "target"), pose: { x, y, yaw: "0 deg" } } }] },
  Person: { scenario: true, make: (scene, x, y) => {
    const name = freeName(scene, "person");
    return addEvent(event(`${name} walks`, { time: "0 s" }, { pedestrian: { name, pose: { x, y }, goals: [[snapped(x + 2, 0.01), y]] } }));
  } },
  "Box that appears": { scenario: true, make: (scene, x, y) => {
    const name = freeName(scene, "box");
    return addEvent(event(`${name} appears`, { time: "5 s" }, { spawn: { name, box: [0.5, 0.5, 1], pose: { x, y, yaw: "0 deg" } } }));
  } },
  "Trigger near a point": { scenario: true, make: (scene, x, y) => {
    const name = freeName(scene, "robot comes near");
    return addEvent(event(name, { robot_within: { of: [x, y], distance: "1 m" } }, { mark: { name: `${name} mark` } }));
  } },
  "Trigger in the selected region": { scenario: true, needs: "region", make: (scene, x, y, region) => {
    const name = freeName(scene, `robot in ${region}`);
    return addEvent(event(name, { robot_in: { region } }, { mark: { name: `${name} mark` } }));
  } },
  "Keepout zone in the selected region": { scenario: true, needs: "region", make: (scene, x, y, region) => [{ op: "add", keys: ["stack", "keepout"], value: region }] },
  "Speed zone in the selected region": { scenario: true, needs: "region", make: (scene, x, y, region) => [{ op: "add", keys: ["stack", "speed_zones"], value: { region, speed_limit: "0.2 m/s" } }] },
  Obstacle: { needs: "inline", make: (scene, x, y) => inWorld(scene, "obstacles", { name: freeName(scene, "obstacle"), box: [0.5, 0.5, 1], pose: { x, y, yaw: "0 deg" } }) },
  "Object that can be pushed": { needs: "inline", make: (scene, x, y) => inWorld(scene, "objects", { name: freeName(scene, "object"), box: [0.4, 0.4, 0.4], pose: { x, y, yaw: "0 deg" }, mass: "2 kg" }) },
  Wall: { needs: "inline", make: (scene, x, y) => inWorld(scene, "walls", { name: freeName(scene, "new wall"), points: [[x, y], [snapped(x + 1, 0.01), y]] }) },
  Door: { needs: "inline", make: (scene, x, y) => inWorld(scene, "doors", { name: freeName(scene, "door"), points: [[x, y], [snapped(x + 1, 0.01), y]] }) },
  Place: { needs: "inline", make: (scene, x, y) => [{ op: "set", keys: [...worldKeys(scene), "places", freeName(scene, "place")], value: { x, y } }] },
  Region: { needs: "inline", make: (scene, x, y) => [{ op: "set", keys: [...worldKeys(scene), "regions", freeName(scene, "region")], value: square(x, y) }] },
};

function square(x, y) {
  return [[x - 0.5, y - 0.5], [x + 0.5, y - 0.5], [x + 0.5, y + 0.5], [x - 0.5, y + 0.5]].map((corner) => corner.map((axis) => snapped(axis, 0.01)));
}

function worldKeys(scene) { return scene.kind === "world" ? [] : ["world"]; }

function inWorld(scene, key, value) { return [{ op: "add", keys: [...worldKeys(scene), key], value }]; }

function addEvent(value) { return [{ op: "add", keys: ["events"], value }]; }

/** Return the keys of the goals of the only robot, or of the first of several robots. */
function goalKeys(scene) {
  const robot = scene.objects.find((one) => one.kind === "robot");
  return robot && robot.keys[0] === "robots" ? [...robot.keys, "goals"] : ["goals"];
}

/** Return the kinds of objects that can be added now. `region` is the selected region, or "". */
export function addable(scene, region) {
  return Object.entries(THINGS)
    .filter(([, thing]) => (!thing.scenario || scene.kind === "scenario") && (thing.needs !== "inline" || scene.inline) && (thing.needs !== "region" || region))
    .map(([name]) => name);
}

/** Return the edits that add an object at a point. */
export function addEdits(name, scene, [x, y], region) {
  return THINGS[name].make(scene, snapped(x, 0.05), snapped(y, 0.05), region);
}

/** Return the keys of the value that Delete removes for an object or one of its points; null if it cannot be removed. */
export function removalKeys(one, handle, scene = { objects: [] }) {
  const least = one.kind === "person" ? 0 : one.line === "closed" ? 3 : 2;
  const points = one.handles.filter((each) => isPoint(one, each));
  if (one.points_keys.length && handle >= 0 && isPoint(one, one.handles[handle])) return points.length > least ? one.handles[handle].keys : null;
  if (["robot", "settings"].includes(one.kind) || !one.editable) return null;
  if (one.keys[0] === "events") {
    const inSequence = one.keys[2] === "then";
    const own = one.keys.slice(0, inSequence ? 4 : 2), rest = one.keys.slice(own.length);
    const actions = new Set(scene.objects.filter((other) => [...own, "do"].every((key, k) => other.keys[k] === key)).map((other) => other.keys[own.length + 1]));
    return rest[0] === "do" && typeof rest[1] === "number" && actions.size > 1 ? [...own, "do", rest[1]] : own;
  }
  if (one.kind === "trigger") return null;
  return one.keys;
}

/** Return whether a handle is one of the points in the list of the object. */
export function isPoint(one, handle) {
  return Boolean(handle) && one.points_keys.length > 0 && handle.keys.length === one.points_keys.length + 1 && one.points_keys.every((key, k) => handle.keys[k] === key);
}

/** Return the edit that adds a point after the selected one, or at the end of the line. */
export function pointEdit(one, handle) {
  const points = one.handles.filter((each) => isPoint(one, each)), chosen = one.handles[handle];
  const at = isPoint(one, chosen) ? points.indexOf(chosen) : points.length - 1;
  const here = points[at] ?? one.handles[0], next = points[at + 1] ?? (one.line === "closed" ? points[0] : null);
  const [x, y] = next ? [(here.x + next.x) / 2, (here.y + next.y) / 2] : [here.x + 1, here.y];
  const point = [snapped(x, 0.01), snapped(y, 0.01)];
  return { op: "add", keys: one.points_keys, index: at + 1, value: here.form === "keyframe" ? null : point };
}
