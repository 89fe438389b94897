// The modules of the editor's page that need no page, in Node.

import assert from "node:assert/strict";
import { test } from "node:test";

const from = (name) => import(new URL(`../../simscen/data/editor/${name}.js`, import.meta.url));
const { History } = await from("history");
const { bounds, distanceToLine, inside, placed, snapped, wrapped } = await from("geometry");
const { handleEdit, moveByKey, movedHandles } = await from("dragging");
const { addEdits, addable, pointEdit, removalKeys } = await from("templates");

const goal = { id: "goals/0", keys: ["goals", 0], kind: "goal", label: "goal shelf", line: "", whole: false, editable: true, points_keys: [],
  handles: [{ keys: ["goals", 0, "pose"], form: "pose", x: 1, y: 2, yaw: 0, place: "" }] };
const point = (index, x, y) => ({ keys: ["regions", "hall", index], form: "point", x, y, yaw: null, place: "" });
const region = { id: "regions/hall", keys: ["regions", "hall"], kind: "region", label: "hall", line: "closed", whole: true, editable: true, points_keys: ["regions", "hall"],
  handles: [point(0, 0, 0), point(1, 2, 0), point(2, 2, 2), point(3, 0, 2)] };
const scene = { kind: "scenario", inline: false, objects: [goal, region] };

test("undo and redo go back and forth, and a new text ends what was undone", () => {
  const history = new History("a");
  history.push("b");
  history.push("c");
  assert.equal(history.undo(), "b");
  assert.equal(history.undo(), "a");
  assert.equal(history.undo(), null);
  assert.equal(history.redo(), "b");
  history.push("d");
  assert.equal(history.redo(), null);
  assert.equal(history.undo(), "b");
});

test("quick typing is one step, and the same text is none", () => {
  const history = new History("");
  history.push("a", "typing", 0);
  history.push("ab", "typing", 500);
  history.push("abc", "typing", 5000);
  history.push("abc", "typing", 5001);
  assert.equal(history.undo(), "ab");
  assert.equal(history.undo(), "");
});

test("numbers are in steps without noise", () => {
  assert.equal(snapped(0.1 + 0.2, 0.1), 0.3);
  assert.equal(snapped(-1.26, 0.05), -1.25);
  assert.ok(Math.abs(wrapped(1.5 * Math.PI) + Math.PI / 2) < 1e-12);
  assert.equal(bounds([]), null);
  assert.deepEqual(bounds([[1, 5], [3, 2]]), [1, 2, 3, 5]);
});

test("what is near a point is found", () => {
  assert.ok(inside([[0, 0], [2, 0], [2, 2], [0, 2]], [1, 1]));
  assert.ok(!inside([[0, 0], [2, 0], [2, 2], [0, 2]], [3, 1]));
  assert.equal(distanceToLine([1, 1], [[0, 0], [2, 0]]), 1);
  assert.equal(distanceToLine([-1, 1], [[0, 0], [2, 0], [0, 2]], true), 1);
  const [[x, y]] = placed([[1, 0]], { x: 2, y: 3, yaw: Math.PI / 2 });
  assert.ok(Math.abs(x - 2) < 1e-12 && Math.abs(y - 4) < 1e-12);
});

test("a region moves as a whole, or by one corner", () => {
  assert.equal(movedHandles(region, -1).length, 4);
  assert.equal(movedHandles(region, 2).length, 1);
  assert.equal(movedHandles(goal, -1).length, 1);
});

test("a heading is written only if it was turned, or replaces a place", () => {
  assert.deepEqual(handleEdit(goal.handles[0], false), { op: "pose", keys: ["goals", 0, "pose"], x: 1, y: 2 });
  assert.equal(handleEdit({ ...goal.handles[0], place: "dock" }, false).yaw, 0);
  assert.equal(handleEdit({ ...goal.handles[0], yaw: 1 }, true).yaw, 1);
});

test("arrow keys move by 10 cm, with Control by 1 cm, and turn with Shift", () => {
  const moved = structuredClone(goal), press = (key, given = {}) => moveByKey(moved, -1, { key, ...given });
  assert.equal(press("ArrowLeft"), false);
  assert.equal(press("ArrowUp", { ctrlKey: true }), false);
  assert.equal(press("ArrowLeft", { shiftKey: true }), true);
  assert.equal(press("a"), null);
  assert.deepEqual([moved.handles[0].x, moved.handles[0].y], [0.9, 2.01]);
  assert.ok(Math.abs(moved.handles[0].yaw - Math.PI / 36) < 1e-9);
});

test("new things get free names, and only what the file can hold is offered", () => {
  assert.ok(addable(scene, "").includes("Goal") && !addable(scene, "").includes("Obstacle"));
  assert.ok(addable({ ...scene, inline: true }, "hall").includes("Keepout zone in the selected region"));
  assert.deepEqual(addable({ kind: "world", inline: true, objects: [] }, ""), ["Obstacle", "Object that can be pushed", "Wall", "Door", "Place", "Region"]);
  const named = { ...scene, objects: [...scene.objects, { ...goal, label: "goal target" }] };
  assert.deepEqual(addEdits("Goal", named, [1.02, 2], ""), [{ op: "add", keys: ["goals"], value: { name: "target 2", pose: { x: 1, y: 2, yaw: "0 deg" } } }]);
});

test("points are added between others, and a region keeps three", () => {
  assert.deepEqual(pointEdit(region, 1), { op: "add", keys: ["regions", "hall"], index: 2, value: [2, 1] });
  assert.deepEqual(pointEdit(region, -1), { op: "add", keys: ["regions", "hall"], index: 4, value: [0, 1] });
  assert.deepEqual(removalKeys(region, 1), ["regions", "hall", 1]);
  assert.equal(removalKeys({ ...region, handles: region.handles.slice(1) }, 1), null);
  assert.deepEqual(removalKeys(region, -1), ["regions", "hall"]);
});

test("with an action goes its event, but not the other actions", () => {
  const keys = (...more) => ({ ...goal, kind: "person", keys: ["events", 2, ...more] });
  assert.deepEqual(removalKeys(keys("do", "pedestrian"), -1), ["events", 2]);
  const both = { objects: [keys("do", 0, "mark"), keys("do", 1, "pedestrian")] };
  assert.deepEqual(removalKeys(keys("do", 1, "pedestrian"), -1, both), ["events", 2, "do", 1]);
  assert.deepEqual(removalKeys(keys("do", 0, "pedestrian"), -1, { objects: both.objects.slice(0, 1) }), ["events", 2]);
  assert.deepEqual(removalKeys(keys("then", 0, "do", "kidnap"), -1), ["events", 2, "then", 0]);
  assert.equal(removalKeys({ ...goal, kind: "robot", keys: ["robot"] }, -1), null);
});
