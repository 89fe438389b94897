// The maths of the replay page's modules, with node's own test runner.
import assert from "node:assert/strict";
import test from "node:test";
import { deflateRawSync } from "node:zlib";

const FOLDER = new URL("../../simscen/data/replay/", import.meta.url);
const load = (name) => import(new URL(`${name}.js`, FOLDER).href);

test("what zlib deflates is inflated again, stored, fixed and dynamic", async () => {
  const { inflate } = await load("inflate");
  for (const size of [0, 1, 70, 5_000, 200_000]) {
    const bytes = Uint8Array.from({ length: size }, (_, k) => (k * k + (k >> 5)) % 251);
    for (const level of [0, 1, 6, 9]) assert.deepEqual(inflate(deflateRawSync(bytes, { level })), bytes);
    assert.deepEqual(inflate(deflateRawSync(bytes, { strategy: 4 })), bytes); // fixed codes
  }
  assert.throws(() => inflate(deflateRawSync(new Uint8Array(999)).subarray(0, 3)), /cut short/);
  assert.throws(() => inflate(Uint8Array.of(7)), /not deflated/);
});

test("the newest sample counts", async () => {
  const { newest } = await load("series");
  assert.deepEqual([-1, 0, 5, 10, 99].map((tick) => newest([0, 10, 20], tick)), [-1, 0, 0, 1, 2]);
});

test("between samples it is on the straight line, the shorter way round; over pauses and jumps the older sample holds", async () => {
  const { poseAt } = await load("series");
  const poses = { ticks: [0, 10, 100, 110], x: [0, 0.2, 0.2, 5], y: [0, 0, 0, 0], yaw: [3.1, -3.1, 0, 0] };
  const half = poseAt(poses, 5, 20);
  assert.ok(Math.abs(half.x - 0.1) < 1e-12 && Math.abs(Math.abs(half.yaw) - Math.PI) < 1e-9);
  assert.equal(poseAt(poses, 60, 20).x, 0.2);
  assert.equal(poseAt(poses, 105, 20).x, 0.2);
  assert.equal(poseAt(poses, -1, 20), null);
});

test("an ellipse holds 95 % of what its covariance says", async () => {
  const { ellipse } = await load("series");
  const { a, b, yaw } = ellipse(0.04, 0, 0.01);
  assert.ok(Math.abs(a - 0.2 * 2.4477) < 1e-3 && Math.abs(b - 0.1 * 2.4477) < 1e-3 && yaw === 0);
  assert.ok(Math.abs(ellipse(1, 0.5, 1).yaw - Math.PI / 4) < 1e-12);
});

test("pixels become points and points pixels; what is under the pointer stays when it zooms", async () => {
  const { Camera, roundLength } = await load("camera");
  const camera = new Camera(2, 3, 50);
  const [u, v] = camera.pixel(4, 1, 800, 600);
  assert.deepEqual(camera.point(u, v, 800, 600), [4, 1]);
  camera.zoom(3, u, v, 800, 600);
  const [x, y] = camera.point(u, v, 800, 600);
  assert.ok(Math.hypot(x - 4, y - 1) < 1e-9);
  camera.fit([0, 0, 10, 2], 800, 600, 0);
  assert.equal(camera.scale, 80);
  assert.deepEqual([roundLength(100, 160), roundLength(40, 160), roundLength(3, 160)], [1, 2, 50]);
});

test("an address names a time and what is selected, and nonsense names nothing", async () => {
  const { fromHash, toHash } = await load("link");
  assert.equal(toHash(12.4, null), "#t=12.4");
  assert.deepEqual(fromHash(toHash(3.25, { kind: "v", number: 2 })), { time: 3.25, selected: { kind: "v", number: 2 } });
  for (const hash of ["", "#", "#t=", "#t=abc", "#t=-1", "#t=Infinity", "#v=x", "#e=-1", "#<script>"]) assert.deepEqual(fromHash(hash), { time: null, selected: null });
});

const STACK = {
  letter: "", rate: 100, robots: [{
    name: "", lines: [[150, "error", "controller_server", "No progress"], [10, "info", "amcl", "created"]],
    changes: [[0, "Root", "idle", "running"], [0, "FollowPath", "idle", "running"], [20, "IsStuck", "idle", "failure"], [150, "FollowPath", "running", "failure"],
      [150, "FollowPath", "failure", "idle"], [150, "Spin", "idle", "running"], [200, "Spin", "running", "idle"]].map(([tick, node, before, status]) => ({ tick, node, before, status })),
    parameters: [{ node: "/amcl", total: 2, values: [["max_particles", "2000", true], ["z_hit", "0.5", false]] }],
  }],
};

test("the nodes of a behavior tree run from their change to running to their next change", async () => {
  const { runningAt } = await load("stacklog");
  const at = (tick) => runningAt(STACK.robots[0], tick);
  assert.deepEqual([-1, 0, 149, 150, 200].map(at), [[], ["Root", "FollowPath"], ["Root", "FollowPath"], ["Root", "Spin"], ["Root"]]);
});

test("the log of a stack is in order of time, with durations, resets and problems", async () => {
  const { entriesOf } = await load("stacklog");
  const entries = entriesOf([STACK]);
  assert.deepEqual(entries.map(({ seconds }) => seconds), [0, 0, 0.1, 0.2, 1.5, 1.5, 1.5, 1.5, 2]);
  assert.deepEqual(entries.filter(({ took }) => took !== undefined).map(({ node, said, took }) => [node, said, took]), [["FollowPath", "failure", 1.5], ["Spin", "halted", 0.5]]);
  assert.deepEqual(entries.filter(({ problem }) => problem).map(({ node, said }) => `${node} ${said}`), ["FollowPath failure", "controller_server error: No progress"]);
  assert.deepEqual(entries.filter(({ minor }) => minor).map(({ node, said }) => `${node} ${said}`), ["IsStuck failure", "FollowPath idle"]);
});

test("a recovery node with the name of its action becomes idle before it ends, as in Nav2 Jazzy", async () => {
  const { entriesOf, runningAt } = await load("stacklog");
  const node = "ComputePathToPose", changes = [[0, "idle", "running"], [0, "idle", "running"], [30, "running", "failure"], [30, "failure", "idle"], [30, "running", "idle"], [30, "idle", "success"], [40, "success", "idle"]];
  const robot = { name: "", lines: [], parameters: [], changes: changes.map(([tick, before, status]) => ({ tick, node, before, status })) };
  assert.deepEqual([29, 30].map((tick) => runningAt(robot, tick)), [[node], []]);
  const steps = entriesOf([{ letter: "", rate: 100, robots: [robot] }]).filter(({ minor }) => !minor);
  assert.deepEqual(steps.map(({ said, took, problem }) => [said, took, Boolean(problem)]), [["running", undefined, false], ["running", undefined, false], ["failure", 0.3, true], ["success", 0.3, false]]);
});

test("the parameters of two runs are side by side, and a run without parameters is left out", async () => {
  const { parametersOf } = await load("parameters");
  const run = (letter, ...values) => ({ letter, robots: [{ name: "", parameters: values.length ? [{ node: "/amcl", total: values.length, values }] : [] }] });
  const both = parametersOf([run("A", ["z_hit", "0.5", false]), run("B", ["z_hit", "0.7", false], ["beams", "60", false])]);
  assert.deepEqual(both.letters, ["A", "B"]);
  assert.deepEqual(both.rows.map(({ name, values }) => [name, values]), [["z_hit", ["0.5", "0.7"]], ["beams", [null, "60"]]]);
  assert.deepEqual(parametersOf([run("A"), run("B", ["z_hit", "0.7", false])]).rows.map(({ values }) => values), [["0.7"]]);
});
