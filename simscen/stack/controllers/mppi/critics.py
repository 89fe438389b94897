"""Critics of MPPI, which score the rollouts (nav2_mppi_controller).

A critic takes its parameters and the critic data, and returns one weighted cost per rollout (n,).
"""

import numpy as np
import numpy.typing as npt

from simscen.model import mppi as model
from simscen.stack.controllers.cumulative_sum import accumulate_rows
from simscen.stack.controllers.mppi.critic_data import CriticData, Mask, distances_in_place
from simscen.stack.controllers.mppi.rollouts import VX, VY, WZ

Floats = npt.NDArray[np.float32]
MIN_TURN_RATE_RAD_S = np.float32(1e-6)
"""rad/s below which a car is not asked for its turning radius."""


HALF_TURN = np.float32(np.pi)


def constraint(spec: model.MppiConstraintCritic, scene: CriticData) -> Floats:
    """m/s too many over the seconds; of a car also meters by which it turns too tightly."""
    velocities, limits = scene.rolled.velocities, scene.limits
    vx, (low, *_), (high, left, _) = velocities[VX], limits.low, limits.high
    excess = np.minimum(np.maximum(vx, np.float32(low)), np.float32(high))
    np.abs(np.subtract(vx, excess, out=excess), out=excess)
    if len(velocities) > VY:
        excess += np.maximum(np.abs(velocities[VY]) - np.float32(left), 0)
    if limits.turning_radius > 0.0:
        turn = np.maximum(np.abs(velocities[WZ]), MIN_TURN_RATE_RAD_S)
        excess += np.maximum(np.float32(limits.turning_radius) - np.abs(vx) / turn, 0)
    return np.asarray(spec.cost_weight * scene.dt * excess.sum(axis=0))


def cost(spec: model.MppiCostCritic, scene: CriticData) -> tuple[Floats, Mask]:
    """Return the mean costmap cost along each rollout, and which rollouts collide."""
    part = slice(None, None, spec.trajectory_point_step)
    x, y, yaw = scene.rolled.x[part], scene.rolled.y[part], scene.rolled.yaw[part]
    spots, whole = scene.spots(x, y), spec.consider_footprint is not False
    hit = scene.hit(scene.gap(spots, yaw, whole), whole)
    price = np.arange(256, dtype=np.float32) * np.float32(scene.plan.length >= spec.near_goal_distance)
    price[spec.near_collision_cost :] = spec.critical_cost
    paid = price.take(scene.costs(spots)).sum(axis=0)
    total = np.where(hit, np.float32(spec.collision_cost), paid)
    if len(scene.moving):
        near, met = scene.meeting
        total += len(x) * (spec.critical_cost * near + spec.collision_cost * met)
    return np.asarray(spec.cost_weight / 254.0 / len(x) * total), hit


def obstacles(spec: model.MppiObstaclesCritic, scene: CriticData) -> tuple[Floats, Mask]:
    """Nearness within the margin, and within the inflation radius compared with the best; and which hit something."""
    x, y, yaw = scene.rolled.x, scene.rolled.y, scene.rolled.yaw
    whole = spec.consider_footprint is not False
    spots = scene.spots(x, y)
    gap = scene.gap(spots, yaw, whole)
    hit = scene.hit(gap, whole)
    near = np.maximum(np.float32(spec.collision_margin_distance) - gap, 0).sum(axis=0)
    total = spec.critical_weight * np.where(hit, np.float32(spec.collision_cost), near)
    if scene.plan.length >= spec.near_goal_distance:
        costs = scene.costs(spots)
        inflated = np.float32(scene.costmap.inflation_radius)
        repulsion = np.where(costs >= 1, inflated - gap, np.float32(0)).sum(axis=0)
        total = total + spec.repulsion_weight * (repulsion - repulsion.min()) / len(x)
    if len(scene.moving):
        near_to, met = scene.meeting
        total = total + spec.critical_weight * (near_to + spec.collision_cost * met)
    return np.asarray(total), hit


def goal(spec: model.MppiGoalCritic, scene: CriticData) -> Floats:
    """Return the mean distance to the end of the plan."""
    x, y, _ = scene.path
    return np.asarray(
        spec.cost_weight * distances_in_place(scene.rolled.x - x[-1], scene.rolled.y - y[-1]).mean(axis=0)
    )


def goal_angle(spec: model.MppiGoalAngleCritic, scene: CriticData) -> Floats:
    """Return the mean angle to the heading of the goal."""
    off = absolute_angles(scene.rolled.yaw - np.float32(scene.goal_yaw))
    if spec.symmetric_yaw_tolerance:
        off = np.minimum(off, np.float32(np.pi) - off)
    return np.asarray(spec.cost_weight * off.mean(axis=0))


def prefer_forward(spec: model.MppiPreferForwardCritic, scene: CriticData) -> Floats:
    """Return the distance driven backward, in m."""
    return np.asarray(spec.cost_weight * scene.dt * -np.minimum(scene.rolled.velocities[VX], 0).sum(axis=0))


def twirling(spec: model.MppiTwirlingCritic, scene: CriticData) -> Floats:
    """Return the mean turn rate."""
    return np.asarray(spec.cost_weight * np.abs(scene.rolled.velocities[WZ]).mean(axis=0))


def velocity_deadband(spec: model.MppiVelocityDeadbandCritic, scene: CriticData) -> Floats:
    """Return by how much velocities are below the deadband, integrated over time."""
    ahead, sideways, turn = spec.deadband_velocities
    least = {VX: ahead, WZ: turn, VY: sideways}
    short = np.zeros_like(scene.rolled.velocities[VX])
    for axis, velocities in enumerate(scene.rolled.velocities):
        short += np.maximum(np.float32(least[axis]) - np.abs(velocities), 0)
    return np.asarray(spec.cost_weight * scene.dt * short.sum(axis=0))


def absolute_angles(angles: Floats) -> Floats:
    """Angles between two directions: 0 … π."""
    return np.asarray(np.abs((angles + np.float32(np.pi)) % np.float32(2 * np.pi) - np.float32(np.pi)))


def path_align(spec: model.MppiPathAlignCritic, scene: CriticData) -> Floats | None:
    """Return the mean distance between each pose and the plan at the same path length.

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
    along = accumulate_rows(distances_in_place(x[1:] - x[:-1], y[1:] - y[:-1]))
    along /= np.float32(scene.plan.spacing)
    along += np.float32(0.5)
    point = np.minimum(along.astype(np.int32), count - 1)
    px, py, yaw = scene.path
    off = distances_in_place(px.take(point) - x[1:], py.take(point) - y[1:])
    if spec.use_path_orientations:
        off = distances_in_place(off, absolute_angles(yaw.take(point) - scene.rolled.yaw[part][1:]))
    if not blocked:
        return np.asarray(spec.cost_weight * off.mean(axis=0))
    looked_at = free.take(point)
    counted = np.maximum(looked_at.sum(axis=0), 1)
    return np.asarray(spec.cost_weight * (off * looked_at).sum(axis=0) / counted)


def path_follow(spec: model.MppiPathFollowCritic, scene: CriticData) -> Floats:
    """Return the distance from the end of each rollout to a free point beyond the furthest reached one."""
    px, py, _ = scene.path
    last = len(px) - 1
    index = min(scene.furthest + spec.offset_from_furthest, last)
    while index < last - 1 and not scene.free_points[index]:
        index += 1
    return np.asarray(spec.cost_weight * np.hypot(scene.rolled.x[-1] - px[index], scene.rolled.y[-1] - py[index]))


def path_angle(spec: model.MppiPathAngleCritic, scene: CriticData) -> Floats | None:
    """Return the angle between the final heading of each rollout and the direction to a point of the plan.

    None where the robot looks there already, but for `max_angle_to_furthest`.
    """
    px, py, yaws = scene.path
    index = min(scene.furthest + spec.offset_from_furthest, len(px) - 1)
    x, y, yaw = px[index], py[index], yaws[index]
    forward_only = spec.mode == 0 or (spec.mode == 1 and scene.limits.low[0] == 0.0)
    off = float(absolute_angles(np.arctan2(y, x) - np.float32(scene.pose.yaw)))
    if spec.mode == 2 and absolute_angles(np.arctan2(y, x) - yaw) > HALF_TURN / 2:
        off = np.pi - off
    elif not forward_only and spec.mode == 1:
        off = min(off, np.pi - off)
    if off < spec.max_angle_to_furthest:
        return None
    bearing = np.arctan2(y - scene.rolled.y[-1], x - scene.rolled.x[-1])
    angles = absolute_angles(bearing - scene.rolled.yaw[-1])
    if spec.mode == 2:
        angles = np.where(absolute_angles(bearing - yaw) < HALF_TURN / 2, angles, HALF_TURN - angles)
    elif not forward_only:
        angles = np.minimum(angles, HALF_TURN - angles)
    return np.asarray(spec.cost_weight * angles)
