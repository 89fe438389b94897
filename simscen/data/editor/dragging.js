// Moving, turning, and resizing objects with the pointer and the keyboard.

import { snapped, wrapped } from "./geometry.js";

const TURN_STEP = (5 * Math.PI) / 180;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** Return the handles that move together: all handles of a wall, a door, or a region; otherwise one. */
export function movedHandles(one, handle) {
  if (one.whole && handle < 0) return one.handles;
  const moved = one.handles[Math.max(handle, 0)];
  return moved ? [moved] : [];
}

/** Return the edit that sets the position of a handle, and its heading if it has changed or is not in the text yet. */
export function handleEdit(handle, turned) {
  const edit = { op: handle.form, keys: handle.keys, x: snapped(handle.x, 0.001), y: snapped(handle.y, 0.001) };
  if (handle.yaw !== null && (turned || handle.place)) edit.yaw = handle.yaw;
  return edit;
}

/** One gesture of the pointer on an object. `edits` are the edits for its movement so far. */
export class Drag {
  constructor(view, hit, point) {
    Object.assign(this, { view, ...hit, from: point, moved: false });
    this.handles = movedHandles(hit.object, hit.handle);
    this.start = this.handles.map(({ x, y, yaw }) => ({ x, y, yaw }));
    this.radius = hit.object.radius;
  }

  get step() { return this.view.camera.scale >= 80 ? 0.01 : 0.05; }

  to([x, y], fine = false) {
    this.moved = true;
    const first = this.handles[0];
    if (this.part === "turn") {
      const angle = Math.atan2(y - first.y, x - first.x);
      first.yaw = wrapped(snapped(angle / TURN_STEP, fine ? 0.2 : 1) * TURN_STEP);
    } else if (this.part === "radius") {
      const center = this.view.center(this.object);
      this.object.radius = Math.max(this.step, snapped(Math.hypot(x - center.x, y - center.y), this.step));
    } else {
      const goal = [this.start[0].x + x - this.from[0], this.start[0].y + y - this.from[1]];
      const dx = snapped(goal[0], this.step) - this.start[0].x, dy = snapped(goal[1], this.step) - this.start[0].y;
      this.handles.forEach((handle, k) => { handle.x = this.start[k].x + dx; handle.y = this.start[k].y + dy; });
    }
  }

  cancel() {
    this.handles.forEach((handle, k) => Object.assign(handle, this.start[k]));
    this.object.radius = this.radius;
  }

  get edits() {
    if (this.part === "radius") return [{ op: "set", keys: this.object.radius_keys, value: this.object.radius }];
    return this.handles.map((handle) => handleEdit(handle, this.part === "turn"));
  }
}

/** Move or turn an object with an arrow key. Returns null if the key does nothing, otherwise whether it was turned. */
export function moveByKey(one, handle, event) {
  const arrow = ARROWS[event.key];
  if (!arrow || event.altKey || event.metaKey) return null;
  const handles = movedHandles(one, handle);
  if (!handles.length) return null;
  if (event.shiftKey) {
    if (!arrow[0] || handles[0].yaw === null) return null;
    handles[0].yaw = wrapped(handles[0].yaw - arrow[0] * TURN_STEP);
    return true;
  }
  const step = event.ctrlKey ? 0.01 : 0.1;
  for (const each of handles) {
    each.x = snapped(each.x + arrow[0] * step, 0.001);
    each.y = snapped(each.y + arrow[1] * step, 0.001);
  }
  return false;
}
