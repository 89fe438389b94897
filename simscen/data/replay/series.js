// Samples over time: the sample at a tick, and interpolation between samples.

/** Return the index of the newest sample at `tick`; -1 before the first. */
export function newest(ticks, tick) {
  let low = 0, high = ticks.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (ticks[middle] <= tick) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** Return the pose of {ticks, x, y, yaw} at `tick`, with linear interpolation; null before the first sample.
 *
 * After a pause of more than `gap` ticks or a jump of more than `jump` meters, the older sample is returned instead. */
export function poseAt(poses, tick, gap, jump = 0.5) {
  const k = newest(poses.ticks, tick);
  if (k < 0) return null;
  const here = { x: poses.x[k], y: poses.y[k], yaw: poses.yaw[k] };
  if (k + 1 >= poses.ticks.length || poses.ticks[k + 1] - poses.ticks[k] > gap) return here;
  const dx = poses.x[k + 1] - here.x, dy = poses.y[k + 1] - here.y;
  if (Math.hypot(dx, dy) > jump) return here;
  const share = (tick - poses.ticks[k]) / (poses.ticks[k + 1] - poses.ticks[k]);
  return { x: here.x + share * dx, y: here.y + share * dy, yaw: here.yaw + share * turned(here.yaw, poses.yaw[k + 1]) };
}

/** Return the difference between two headings in (-π, π]. */
export function turned(from, to) {
  return Math.atan2(Math.sin(to - from), Math.cos(to - from));
}

/** Return the half-axes and the heading of the ellipse that contains 95 % of a normal distribution in the plane. */
export function ellipse(xx, xy, yy) {
  const middle = (xx + yy) / 2, spread = Math.hypot((xx - yy) / 2, xy), far = Math.sqrt(5.991);
  return {
    a: far * Math.sqrt(Math.max(middle + spread, 0)),
    b: far * Math.sqrt(Math.max(middle - spread, 0)),
    yaw: Math.atan2(2 * xy, xx - yy) / 2,
  };
}

/** Return the minimum and the maximum of values[from … to) without nan; null if there are no values. */
export function extremes(values, from, to) {
  let least = Infinity, most = -Infinity;
  for (let k = from; k < to; k++) {
    if (values[k] < least) least = values[k];
    if (values[k] > most) most = values[k];
  }
  return least <= most ? { least, most } : null;
}
