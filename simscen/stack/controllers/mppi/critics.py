"""Critics of MPPI, which compute costs of rollouts (nav2_mppi_controller), and the manager that adds up the costs.

A critic is a function of its parameters and the critic data. A critic returns the costs (n,) of the rollouts: the value
that its docstring describes, times the weight of the critic.
"""

from typing import get_args

import numpy as np

from simscen.core.geometry import Array
from simscen.model import mppi as model
from simscen.stack.controllers.mppi.critic_data import CriticData, considers_footprint, hypot_in_place
from simscen.stack.controllers.mppi.rollouts import VX, VY, WZ, Floats
from simscen.stack.kinematics import accumulate_rows
from simscen.stack.moving_obstacles import Mask

MIN_TURN_RATE_RAD_S = np.float32(1e-6)
"""Minimum turn rate in the computation of turning radii, so that radii stay finite."""
HALF_TURN_RAD = np.float32(np.pi)
MAX_COST = 254.0
"""Maximum cost of a known cell. CostCritic divides costs by this value."""
OPTIONAL_CRITICS = ("ObstaclesCritic", "TwirlingCritic", "VelocityDeadbandCritic")
"""Critics that Nav2 does not enable by default."""
DEFAULT_CRITICS: tuple[model.CriticName, ...] = tuple(
    name for name in get_args(model.CriticName) if name not in OPTIONAL_CRITICS
)
"""Critics that Nav2 enables by default."""


class CriticManager:
    """Evaluates the enabled critics in order, and adds up their costs."""

    def __init__(self, spec: model.Mppi, is_omni: bool) -> None:
        """Take the specification. For a holonomic base (`is_omni`), TwirlingCritic is also a default critic."""
        default = (*DEFAULT_CRITICS, "TwirlingCritic") if is_omni else DEFAULT_CRITICS
        names: tuple[model.CriticName, ...] = default if spec.critics is None else tuple(spec.critics)
        self._spec = spec
        self._names = [name for name in names if getattr(spec, name).enabled]

    def costs(self, data: CriticData) -> tuple[Array, bool]:
        """Return the costs (n,) of the rollouts, and whether any critic finds that all rollouts collide."""
        total = np.zeros(data.rollouts.x.shape[1])
        all_collide = False
        for name in self._names:
            costs, collides = self._evaluate(name, data)
            if costs is not None:
                critic: model.MppiCritic = getattr(self._spec, name)
                total += costs.astype(np.float64) ** critic.cost_power
            if collides is not None:
                all_collide |= bool(collides.all())
        return total, all_collide

    def _evaluate(self, name: model.CriticName, data: CriticData) -> tuple[Floats | None, Mask | None]:
        """Return the costs (n,) of a critic, and which rollouts (n,) collide; None for values it does not compute."""
        spec, length = self._spec, data.plan.length
        costs: Floats | None = None
        match name:
            case "ConstraintCritic":
                costs = constraint_critic(spec.ConstraintCritic, data)
            case "CostCritic":
                return cost_critic(spec.CostCritic, data)
            case "ObstaclesCritic":
                return obstacles_critic(spec.ObstaclesCritic, data)
            case "GoalCritic" if length <= spec.GoalCritic.threshold_to_consider:
                costs = goal_critic(spec.GoalCritic, data)
            case "GoalAngleCritic" if length <= spec.GoalAngleCritic.threshold_to_consider:
                costs = goal_angle_critic(spec.GoalAngleCritic, data)
            case "PathAlignCritic" if length >= spec.PathAlignCritic.threshold_to_consider:
                costs = path_align_critic(spec.PathAlignCritic, data)
            case "PathFollowCritic" if length >= spec.PathFollowCritic.threshold_to_consider:
                costs = path_follow_critic(spec.PathFollowCritic, data)
            case "PathAngleCritic" if length >= spec.PathAngleCritic.threshold_to_consider:
                costs = path_angle_critic(spec.PathAngleCritic, data)
            case "PreferForwardCritic" if length >= spec.PreferForwardCritic.threshold_to_consider:
                costs = prefer_forward_critic(spec.PreferForwardCritic, data)
            case "TwirlingCritic" if length >= data.tolerance:
                costs = twirling_critic(spec.TwirlingCritic, data)
            case "VelocityDeadbandCritic":
                costs = velocity_deadband_critic(spec.VelocityDeadbandCritic, data)
        return costs, None


def constraint_critic(spec: model.MppiConstraintCritic, data: CriticData) -> Floats:
    """Return the integral over time of the amount by which velocities exceed their limits.

    For a car, the excess includes the amount in m by which the turning radius is too small.
    """
    velocities, limits = data.rollouts.velocities, data.limits
    vx, (low, *_), (high, lateral, _) = velocities[VX], limits.low, limits.high
    excess = np.minimum(np.maximum(vx, np.float32(low)), np.float32(high))
    np.abs(np.subtract(vx, excess, out=excess), out=excess)
    if len(velocities) > VY:
        excess += np.maximum(np.abs(velocities[VY]) - np.float32(lateral), 0)
    if limits.turning_radius > 0.0:
        turn_rate = np.maximum(np.abs(velocities[WZ]), MIN_TURN_RATE_RAD_S)
        excess += np.maximum(np.float32(limits.turning_radius) - np.abs(vx) / turn_rate, 0)
    return np.asarray(spec.cost_weight * data.dt * excess.sum(axis=0))


def cost_critic(spec: model.MppiCostCritic, data: CriticData) -> tuple[Floats, Mask]:
    """Return the mean costmap cost along each rollout, relative to MAX_COST, and which rollouts collide.

    Near obstacles, `critical_cost` replaces the cost of a cell. In a collision, `collision_cost` replaces the sum of
    costs. Moving obstacles add costs.
    """
    steps = slice(None, None, spec.trajectory_point_step)
    x, y, yaw = data.rollouts.x[steps], data.rollouts.y[steps], data.rollouts.yaw[steps]
    points, consider_footprint = data.lookup(x, y), considers_footprint(spec)
    collides = data.collides(data.clearance(points, yaw, consider_footprint), consider_footprint)
    score = np.arange(256, dtype=np.float32) * np.float32(data.plan.length >= spec.near_goal_distance)
    score[spec.near_collision_cost :] = spec.critical_cost
    along = score.take(data.costs(points)).sum(axis=0)
    total = np.where(collides, np.float32(spec.collision_cost), along)
    if len(data.moving):
        proximity, collision = data.moving_obstacle_costs
        total += len(x) * (spec.critical_cost * proximity + spec.collision_cost * collision)
    return np.asarray(spec.cost_weight / MAX_COST / len(x) * total), collides


def obstacles_critic(spec: model.MppiObstaclesCritic, data: CriticData) -> tuple[Floats, Mask]:
    """Return costs for small distances to obstacles, and which rollouts collide.

    Within the collision margin, the cost increases linearly as the distance decreases. Within the inflation radius, a
    repulsion cost is added, reduced by the minimum over all rollouts.
    """
    x, y, yaw = data.rollouts.x, data.rollouts.y, data.rollouts.yaw
    points, consider_footprint = data.lookup(x, y), considers_footprint(spec)
    clearance = data.clearance(points, yaw, consider_footprint)
    collides = data.collides(clearance, consider_footprint)
    near = np.maximum(np.float32(spec.collision_margin_distance) - clearance, 0).sum(axis=0)
    total = spec.critical_weight * np.where(collides, np.float32(spec.collision_cost), near)
    if data.plan.length >= spec.near_goal_distance:
        inflation_radius = np.float32(data.costmap.inflation_radius)
        repulsion = np.where(data.costs(points) >= 1, inflation_radius - clearance, np.float32(0)).sum(axis=0)
        total = total + spec.repulsion_weight * (repulsion - repulsion.min()) / len(x)
    if len(data.moving):
        proximity, collision = data.moving_obstacle_costs
        total = total + spec.critical_weight * (proximity + spec.collision_cost * collision)
    return np.asarray(total), collides


def goal_critic(spec: model.MppiGoalCritic, data: CriticData) -> Floats:
    """Return the mean distance in m to the end of the plan."""
    x, y, _ = data.path
    distance = hypot_in_place(data.rollouts.x - x[-1], data.rollouts.y - y[-1])
    return np.asarray(spec.cost_weight * distance.mean(axis=0))


def goal_angle_critic(spec: model.MppiGoalAngleCritic, data: CriticData) -> Floats:
    """Return the mean angle in rad between the headings of each rollout and the heading of the goal.

    With `symmetric_yaw_tolerance`, the opposite heading is as good.
    """
    angle = absolute_angles(data.rollouts.yaw - np.float32(data.goal_yaw))
    if spec.symmetric_yaw_tolerance:
        angle = np.minimum(angle, HALF_TURN_RAD - angle)
    return np.asarray(spec.cost_weight * angle.mean(axis=0))


def prefer_forward_critic(spec: model.MppiPreferForwardCritic, data: CriticData) -> Floats:
    """Return the distance in m that each rollout drives backward."""
    return np.asarray(spec.cost_weight * data.dt * -np.minimum(data.rollouts.velocities[VX], 0).sum(axis=0))


def twirling_critic(spec: model.MppiTwirlingCritic, data: CriticData) -> Floats:
    """Return the mean absolute turn rate in rad/s."""
    return np.asarray(spec.cost_weight * np.abs(data.rollouts.velocities[WZ]).mean(axis=0))


def velocity_deadband_critic(spec: model.MppiVelocityDeadbandCritic, data: CriticData) -> Floats:
    """Return the integral over time of the amount by which absolute velocities are below the deadband."""
    vx, vy, wz = spec.deadband_velocities
    deadband = {VX: vx, WZ: wz, VY: vy}
    deficit = np.zeros_like(data.rollouts.velocities[VX])
    for axis, velocities in enumerate(data.rollouts.velocities):
        deficit += np.maximum(np.float32(deadband[axis]) - np.abs(velocities), 0)
    return np.asarray(spec.cost_weight * data.dt * deficit.sum(axis=0))


def absolute_angles(angles: Floats) -> Floats:
    """Return the absolute values of angles, wrapped to 0 … π."""
    return np.asarray(np.abs((angles + np.float32(np.pi)) % np.float32(2 * np.pi) - np.float32(np.pi)))


def path_align_critic(spec: model.MppiPathAlignCritic, data: CriticData) -> Floats | None:
    """Return the mean distance in m between the poses of each rollout and the plan at the same path length.

    Return None if the rollouts cover too little of the plan, or if obstacles cover too much of this part.
    """
    count = data.furthest_point
    if count < max(1, spec.offset_from_furthest):
        return None
    free = data.free_points[:count]
    occupied = count - int(np.count_nonzero(free))
    if occupied > 2 and occupied / count > spec.max_path_occupancy_ratio:
        return None
    steps = slice(None, None, spec.trajectory_point_step)
    x, y = data.rollouts.x[steps], data.rollouts.y[steps]
    index = accumulate_rows(hypot_in_place(x[1:] - x[:-1], y[1:] - y[:-1]))
    index /= np.float32(data.plan.spacing)
    index += np.float32(0.5)
    point = np.minimum(index.astype(np.int32), count - 1)
    path_x, path_y, path_yaw = data.path
    distance = hypot_in_place(path_x.take(point) - x[1:], path_y.take(point) - y[1:])
    if spec.use_path_orientations:
        angle = absolute_angles(path_yaw.take(point) - data.rollouts.yaw[steps][1:])
        distance = hypot_in_place(distance, angle)
    if not occupied:
        return np.asarray(spec.cost_weight * distance.mean(axis=0))
    is_free = free.take(point)
    free_count = np.maximum(is_free.sum(axis=0), 1)
    return np.asarray(spec.cost_weight * (distance * is_free).sum(axis=0) / free_count)


def path_follow_critic(spec: model.MppiPathFollowCritic, data: CriticData) -> Floats:
    """Return the distance in m from the end of each rollout to a free point of the plan beyond all rollouts."""
    x, y, _ = data.path
    last = len(x) - 1
    index = min(data.furthest_point + spec.offset_from_furthest, last)
    while index < last - 1 and not data.free_points[index]:
        index += 1
    return np.asarray(spec.cost_weight * np.hypot(data.rollouts.x[-1] - x[index], data.rollouts.y[-1] - y[index]))


def path_angle_critic(spec: model.MppiPathAngleCritic, data: CriticData) -> Floats | None:
    """Return the angle in rad between the final heading of each rollout and the direction to a point of the plan.

    The point is beyond all rollouts. Return None if the direction from the robot to the point differs from the current
    heading by less than `max_angle_to_furthest`.
    """
    path_x, path_y, path_yaw = data.path
    index = min(data.furthest_point + spec.offset_from_furthest, len(path_x) - 1)
    x, y, yaw = path_x[index], path_y[index], path_yaw[index]
    forward_only = spec.mode == 0 or (spec.mode == 1 and data.limits.low[0] == 0.0)
    angle = float(absolute_angles(np.arctan2(y, x) - np.float32(data.pose.yaw)))
    if spec.mode == 2 and absolute_angles(np.arctan2(y, x) - yaw) > HALF_TURN_RAD / 2:
        angle = np.pi - angle
    elif not forward_only and spec.mode == 1:
        angle = min(angle, np.pi - angle)
    if angle < spec.max_angle_to_furthest:
        return None
    bearing = np.arctan2(y - data.rollouts.y[-1], x - data.rollouts.x[-1])
    angles = absolute_angles(bearing - data.rollouts.yaw[-1])
    if spec.mode == 2:
        angles = np.where(absolute_angles(bearing - yaw) < HALF_TURN_RAD / 2, angles, HALF_TURN_RAD - angles)
    elif not forward_only:
        angles = np.minimum(angles, HALF_TURN_RAD - angles)
    return np.asarray(spec.cost_weight * angles)
