// Data of a run: positions of robots and objects at a tick, and what happened.
import { ellipse, newest, poseAt } from "./series.js";

const SCAN_AGE = 0.5, LOCAL_AGE = 1.0, MOTION_GAP = 0.15;

/** Recorded run. `letter` is "A" or "B" if there are two. */
export class Run {
  constructor(data, column, letter) {
    Object.assign(this, data);
    this.letter = letter;
    this.column = column;
    this.seconds = this.end / this.rate;
    this.robots = data.robots.map((robot) => new Robot(robot, this));
    this.things = new Map(data.things.map((thing) => [thing.name, readAll(column, thing)]));
    this.shapes = new Map(Object.entries(data.scenery.things));
    this.title = [data.scenario, data.variation].filter(Boolean).join(" ");
    this.events.forEach((event, number) => (event.number = number));
    this.verdicts.forEach((verdict, number) => (verdict.number = number));
  }

  tick(seconds) {
    return Math.min(Math.max(seconds, 0) * this.rate, this.end);
  }

  /** Return the movable objects that exist at a tick: name, outlines in the frame of the object, and pose. */
  thingsAt(tick) {
    const found = [];
    for (const name of new Set([...this.shapes.keys(), ...this.things.keys(), ...this.spawned.map((one) => one.name)])) {
      const shown = this.#thing(name, tick);
      if (shown) found.push(shown);
    }
    return found;
  }

  #thing(name, tick) {
    const spawns = this.spawned.filter((one) => one.name === name), spawn = spawns.filter((one) => one.tick <= tick).at(-1);
    const known = this.shapes.get(name);
    if (spawns.length && !spawn && !known) return null;
    const since = spawn ? spawn.tick : 0;
    if (this.gone.some(([gone, when]) => gone === name && when >= since && when <= tick)) return null;
    const track = this.things.get(name);
    const at = track && poseAt(track, tick, MOTION_GAP * this.rate);
    const rest = spawn ? spawn.pose : known?.pose;
    const pose = at ?? (rest ? { x: rest[0], y: rest[1], yaw: rest[2] } : null);
    return pose && { name, pose, parts: (spawn ?? known)?.parts ?? null, person: (spawn ?? known)?.person ?? false, brought: Boolean(spawn?.tick) };
  }

  /** Return the intervals of a lane that contain a tick. */
  going(lane, tick) {
    return this.events.filter((event) => event.lane === lane && event.until !== undefined && event.tick <= tick && tick < event.until);
  }

  /** Return the zones that are enabled at a tick: those of the start, changed by the events until then. */
  zonesAt(tick) {
    const zones = new Map(this.scenery.zones.map((zone) => [`${zone.filter} ${zone.region}`, zone]));
    for (const event of this.events) {
      if (event.tick > tick) break;
      if (event.kind !== "zone.switched") continue;
      const about = event.about ?? {};
      const key = `${about.filter} ${event.name}`, known = this.scenery.zones.find((zone) => `${zone.filter} ${zone.region}` === key);
      if (about.enabled) zones.set(key, { ...known, region: event.name, filter: about.filter, limit: about.speed_limit ?? known?.limit ?? 0 });
      else zones.delete(`${about.filter} ${event.name}`);
    }
    return [...zones.values()];
  }

  /** Return the violated findings, the most severe first: verdict, finding, and tick. */
  get failures() {
    const order = { error: 0, fail: 0, inconclusive: 1 };
    return this.verdicts
      .flatMap((verdict) => verdict.findings.map((finding) => ({ verdict, finding })))
      .filter(({ finding }) => finding.status !== "pass")
      .sort((a, b) => (a.verdict.severity === "warn") - (b.verdict.severity === "warn") || order[a.finding.status] - order[b.finding.status]);
  }

  /** Return the data of a signal for all robots that have it. */
  strip(name) {
    return this.robots.map((robot) => robot.strips.get(name)).filter(Boolean);
  }
}

/** Return the changes of a behavior tree in order: tick, node, previous status, and status. */
function changesOf(column, tree) {
  if (!tree) return [];
  const [node, before, status] = [tree.node, tree.before, tree.status].map(column);
  return Array.from(column(tree.ticks), (tick, k) => ({ tick, node: tree.nodes[node[k]], before: tree.statuses[before[k]], status: tree.statuses[status[k]] }));
}

/** Data of one robot of a run. */
class Robot {
  constructor(data, run) {
    Object.assign(this, data);
    this.run = run;
    const { column } = run;
    this.truth = readAll(column, data.truth);
    this.belief = data.belief && readAll(column, data.belief);
    this.plans = paths(column, data.plans);
    this.local = paths(column, data.local);
    this.changes = changesOf(column, data.tree);
    this.strips = new Map(data.strips.map((strip) => [strip.name, new Strip(strip, this, column)]));
  }

  /** Return the true pose; null if the log does not contain it. */
  truthAt(tick) {
    if (!this.truth.ticks.length) return null;
    return poseAt(this.truth, tick, 3 * this.run.rate) ?? { x: this.truth.x[0], y: this.truth.y[0], yaw: this.truth.yaw[0] };
  }

  /** Return the true pose, without it the estimated pose, and without both the origin. */
  placeAt(tick) {
    return this.truthAt(tick) ?? this.beliefAt(tick) ?? { x: 0, y: 0, yaw: 0 };
  }

  /** Return the estimated pose, its 95 % ellipse, and the age of the estimate in s. */
  beliefAt(tick) {
    if (!this.belief) return null;
    const k = newest(this.belief.ticks, tick);
    if (k < 0) return null;
    const pose = poseAt(this.belief, tick, this.run.rate);
    const { xx, xy, yy } = this.belief;
    return { ...pose, ...{ ellipse: ellipse(xx[k], xy[k], yy[k]) }, age: (tick - this.belief.ticks[k]) / this.run.rate };
  }

  planAt(tick) {
    return pathAt(this.plans, tick, Infinity);
  }

  localAt(tick) {
    return pathAt(this.local, tick, LOCAL_AGE * this.run.rate);
  }

  /** Return the newest scan of each lidar as points x, y, x, y, … on the map, according to the estimated pose. */
  scansAt(tick) {
    return this.scans.flatMap((lidar) => {
      const { column } = this.run, k = newest(column(lidar.ticks), tick);
      if (k < 0 || tick - column(lidar.ticks)[k] > Math.max(SCAN_AGE * this.run.rate, 1.5 * pace(column(lidar.ticks)))) return [];
      const when = column(lidar.measured)[k], pose = this.beliefAt(when) ?? this.placeAt(when);
      return [hits(lidar, column(lidar.ranges).subarray(k * lidar.beams, (k + 1) * lidar.beams), pose)];
    });
  }

  /** Return the x, y, and yaw arrays of the newest particle cloud. */
  particlesAt(tick) {
    if (!this.particles) return null;
    const { column } = this.run, ticks = column(this.particles.ticks), k = newest(ticks, tick);
    if (k < 0 || tick - ticks[k] > Math.max(this.run.rate * 2, 1.5 * pace(ticks))) return null;
    const numbers = column(this.particles.numbers);
    let from = 0;
    for (let before = 0; before < k; before++) from += numbers[before];
    const cut = (name) => column(this.particles[name]).subarray(from, from + numbers[k]);
    return { x: cut("x"), y: cut("y"), yaw: cut("yaw") };
  }

  /** Return the goal to which the robot drives; null between goals. */
  goalAt(tick) {
    const events = this.run.events.filter((one) => one.kind === "goal.accepted" && (one.robot ?? "") === this.name && one.tick <= tick);
    const event = events.at(-1);
    return event && (event.until === undefined || tick < event.until) ? event : null;
  }
}

/** Signal over time: at the ticks of the robot, or at ticks of its own. */
class Strip {
  constructor(data, robot, column) {
    Object.assign(this, data);
    this.robot = robot;
    this.where = { ticks: data.ticks ?? robot.clock, values: data.values };
    this.column = column;
  }

  get clock() {
    return this.column(this.where.ticks);
  }

  get samples() {
    return this.column(this.where.values);
  }

  at(tick) {
    return this.samples[Math.max(newest(this.clock, tick), 0)];
  }
}

function readAll(column, table) {
  return Object.fromEntries(Object.entries(table).map(([key, value]) => [key, Array.isArray(value) && key !== "parts" ? column(value) : value]));
}

function paths(column, table) {
  if (!table) return null;
  const numbers = column(table.numbers), begins = new Float64Array(numbers.length + 1);
  numbers.forEach((number, k) => (begins[k + 1] = begins[k] + number));
  return { ticks: column(table.ticks), begins, x: column(table.x), y: column(table.y) };
}

function pathAt(table, tick, oldest) {
  const k = table ? newest(table.ticks, tick) : -1;
  if (k < 0 || tick - table.ticks[k] > oldest) return null;
  return { x: table.x.subarray(table.begins[k], table.begins[k + 1]), y: table.y.subarray(table.begins[k], table.begins[k + 1]) };
}

function pace(ticks) {
  return ticks.length > 1 ? (ticks[ticks.length - 1] - ticks[0]) / (ticks.length - 1) : 0;
}

function hits(lidar, ranges, pose) {
  const [mx, my, turn] = lidar.mount, c = Math.cos(pose.yaw), s = Math.sin(pose.yaw);
  const x = pose.x + c * mx - s * my, y = pose.y + s * mx + c * my, points = [];
  for (let k = 0; k < ranges.length; k++) {
    if (!(ranges[k] >= lidar.least && ranges[k] <= lidar.most)) continue;
    const angle = pose.yaw + turn + lidar.first + k * lidar.step;
    points.push(x + ranges[k] * Math.cos(angle), y + ranges[k] * Math.sin(angle));
  }
  return points;
}
