"""The critics of nav2_mppi_controller that compare the rollouts with the plan."""

import numpy as np
import numpy.typing as npt

from simscen.model import mppi as model
from simscen.stack.controllers.mppi.critics import wrapped
from simscen.stack.controllers.mppi.scene import Scene, apart
from simscen.stack.controllers.sums import add_up

Floats = npt.NDArray[np.float32]
HALF_TURN = np.float32(np.pi)


def path_align(spec: model.MppiPathAlignCritic, scene: Scene) -> Floats | None:
    """The mean distance from each pose to the point of the plan that is as many meters from the start.

    None where the critic is silent: before the robot has got going, and where the plan is blocked.
    """
    count = scene.furthest
    if count < max(1, spec.offset_from_furthest):
        return None
    free = scene.free_points[:count]
    blocked = count - int(np.count_nonzero(free))
    if blocked > 2 and blocked / count > spec.max_path_occupancy_ratio:
        return None
    part = slice(None, None, spec.trajectory_point_step)
    x, y = scene.rolled.x[part], scene.rolled.y[part]
    along = add_up(apart(x[1:] - x[:-1], y[1:] - y[:-1]))
    along /= np.float32(scene.plan.spacing)
    along += np.float32(0.5)
    point = np.minimum(along.astype(np.int32), count - 1)
    px, py, yaw = scene.path
    off = apart(px.take(point) - x[1:], py.take(point) - y[1:])
    if spec.use_path_orientations:
        off = apart(off, wrapped(yaw.take(point) - scene.rolled.yaw[part][1:]))
    if not blocked:
        return np.asarray(spec.cost_weight * off.mean(axis=0))
    looked_at = free.take(point)
    counted = np.maximum(looked_at.sum(axis=0), 1)
    return np.asarray(spec.cost_weight * (off * looked_at).sum(axis=0) / counted)


def path_follow(spec: model.MppiPathFollowCritic, scene: Scene) -> Floats:
    """The distance from the end of each rollout to a free point beyond the furthest that any reaches."""
    px, py, _ = scene.path
    last = len(px) - 1
    index = min(scene.furthest + spec.offset_from_furthest, last)
    while index < last - 1 and not scene.free_points[index]:
        index += 1
    return np.asarray(spec.cost_weight * np.hypot(scene.rolled.x[-1] - px[index], scene.rolled.y[-1] - py[index]))


def path_angle(spec: model.MppiPathAngleCritic, scene: Scene) -> Floats | None:
    """The angle between the heading at the end of each rollout and the way from there to a point of the plan.

    None where the robot looks there already, but for `max_angle_to_furthest`.
    """
    px, py, yaws = scene.path
    index = min(scene.furthest + spec.offset_from_furthest, len(px) - 1)
    x, y, yaw = px[index], py[index], yaws[index]
    forward_only = spec.mode == 0 or (spec.mode == 1 and scene.limits.low[0] == 0.0)
    off = float(wrapped(np.arctan2(y, x) - np.float32(scene.pose.yaw)))
    if spec.mode == 2 and wrapped(np.arctan2(y, x) - yaw) > HALF_TURN / 2:
        off = np.pi - off
    elif not forward_only and spec.mode == 1:
        off = min(off, np.pi - off)
    if off < spec.max_angle_to_furthest:
        return None
    bearing = np.arctan2(y - scene.rolled.y[-1], x - scene.rolled.x[-1])
    angles = wrapped(bearing - scene.rolled.yaw[-1])
    if spec.mode == 2:
        angles = np.where(wrapped(bearing - yaw) < HALF_TURN / 2, angles, HALF_TURN - angles)
    elif not forward_only:
        angles = np.minimum(angles, HALF_TURN - angles)
    return np.asarray(spec.cost_weight * angles)
