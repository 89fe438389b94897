// Points and outlines in the plane, in meters.

/** Return a number rounded to a multiple of a step, without floating-point noise. */
export function snapped(value, step) {
  return Number((Math.round(value / step) * step).toFixed(4));
}

/** Return the points of an outline at a pose. */
export function placed(points, { x, y, yaw }) {
  const c = Math.cos(yaw ?? 0), s = Math.sin(yaw ?? 0);
  return points.map(([u, v]) => [x + c * u - s * v, y + s * u + c * v]);
}

/** Return whether a point is inside a polygon. */
export function inside(polygon, [x, y]) {
  let odd = false;
  for (let k = 0, j = polygon.length - 1; k < polygon.length; j = k++) {
    const [ax, ay] = polygon[k], [bx, by] = polygon[j];
    if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) odd = !odd;
  }
  return odd;
}

/** Return the distance of a point from a segment. */
export function distanceToSegment([x, y], [ax, ay], [bx, by]) {
  const dx = bx - ax, dy = by - ay, length = dx * dx + dy * dy;
  const t = length ? Math.min(Math.max(((x - ax) * dx + (y - ay) * dy) / length, 0), 1) : 0;
  return Math.hypot(x - ax - t * dx, y - ay - t * dy);
}

/** Return the distance of a point from an open or closed polyline. */
export function distanceToLine(point, line, closed = false) {
  let least = Infinity;
  for (let k = 1; k < line.length; k++) least = Math.min(least, distanceToSegment(point, line[k - 1], line[k]));
  if (closed && line.length > 2) least = Math.min(least, distanceToSegment(point, line[line.length - 1], line[0]));
  return least;
}

/** Return the equivalent angle in (-π, π]. */
export function wrapped(angle) {
  const turned = angle % (2 * Math.PI);
  return turned > Math.PI ? turned - 2 * Math.PI : turned <= -Math.PI ? turned + 2 * Math.PI : turned;
}

/** Return the rectangle [x0, y0, x1, y1] around points; null without points. */
export function bounds(points) {
  if (!points.length) return null;
  const xs = points.map(([x]) => x), ys = points.map(([, y]) => y);
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
}
