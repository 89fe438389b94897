// Samples over time: which one counts at a tick, and what lies between two of them.

/** The number of the newest sample at `tick`; -1 before the first. */
export function newest(ticks, tick) {
  let low = 0, high = ticks.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (ticks[middle] <= tick) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** Poses {ticks, x, y, yaw}: where it is at `tick`, between samples on the straight line; null before the first.
 *
 * A pause of more than `gap` ticks and a jump of more than `jump` meters are no motion: the older sample holds. */
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

/** The shorter turn from one heading to another. */
export function turned(from, to) {
  return Math.atan2(Math.sin(to - from), Math.cos(to - from));
}

/** The half-axes and the heading of the ellipse that holds 95 % of a normal distribution in the plane. */
export function ellipse(xx, xy, yy) {
  const middle = (xx + yy) / 2, spread = Math.hypot((xx - yy) / 2, xy), far = Math.sqrt(5.991);
  return {
    a: far * Math.sqrt(Math.max(middle + spread, 0)),
    b: far * Math.sqrt(Math.max(middle - spread, 0)),
    yaw: Math.atan2(2 * xy, xx - yy) / 2,
  };
}

/** The least and the greatest of values[from … to), nan left out; null where there is none. */
export function extremes(values, from, to) {
  let least = Infinity, most = -Infinity;
  for (let k = from; k < to; k++) {
    if (values[k] < least) least = values[k];
    if (values[k] > most) most = values[k];
  }
  return least <= most ? { least, most } : null;
}
