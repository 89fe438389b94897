"""What MPPI's rollouts are judged by: the critics of nav2_mppi_controller but for those that look at the plan.

A critic takes its part of the specification and the scene, and returns what it measures (n,) times its weight.
"""

import numpy as np
import numpy.typing as npt

from simscen.model import mppi as model
from simscen.stack.controllers.mppi.rollouts import VX, VY, WZ
from simscen.stack.controllers.mppi.scene import Mask, Scene, apart

Floats = npt.NDArray[np.float32]
ALMOST_STRAIGHT = np.float32(1e-6)
"""rad/s below which a car is not asked for its turning radius."""


def constraint(spec: model.MppiConstraintCritic, scene: Scene) -> Floats:
    """m/s too many over the seconds; of a car also meters by which it turns too tightly."""
    velocities, limits = scene.rolled.velocities, scene.limits
    vx, (low, *_), (high, left, _) = velocities[VX], limits.low, limits.high
    excess = np.minimum(np.maximum(vx, np.float32(low)), np.float32(high))
    np.abs(np.subtract(vx, excess, out=excess), out=excess)
    if len(velocities) > VY:
        excess += np.maximum(np.abs(velocities[VY]) - np.float32(left), 0)
    if limits.turning_radius > 0.0:
        turn = np.maximum(np.abs(velocities[WZ]), ALMOST_STRAIGHT)
        excess += np.maximum(np.float32(limits.turning_radius) - np.abs(vx) / turn, 0)
    return np.asarray(spec.cost_weight * scene.dt * excess.sum(axis=0))


def cost(spec: model.MppiCostCritic, scene: Scene) -> tuple[Floats, Mask]:
    """The mean cost of the costmap along each rollout; and which rollouts hit something."""
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


def obstacles(spec: model.MppiObstaclesCritic, scene: Scene) -> tuple[Floats, Mask]:
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


def goal(spec: model.MppiGoalCritic, scene: Scene) -> Floats:
    """The mean distance to the plan's end, once that is near."""
    x, y, _ = scene.path
    return np.asarray(spec.cost_weight * apart(scene.rolled.x - x[-1], scene.rolled.y - y[-1]).mean(axis=0))


def goal_angle(spec: model.MppiGoalAngleCritic, scene: Scene) -> Floats:
    """The mean angle to the goal's heading, once the plan's end is near."""
    off = wrapped(scene.rolled.yaw - np.float32(scene.goal_yaw))
    if spec.symmetric_yaw_tolerance:
        off = np.minimum(off, np.float32(np.pi) - off)
    return np.asarray(spec.cost_weight * off.mean(axis=0))


def prefer_forward(spec: model.MppiPreferForwardCritic, scene: Scene) -> Floats:
    """Meters driven backward."""
    return np.asarray(spec.cost_weight * scene.dt * -np.minimum(scene.rolled.velocities[VX], 0).sum(axis=0))


def twirling(spec: model.MppiTwirlingCritic, scene: Scene) -> Floats:
    """The mean turn rate."""
    return np.asarray(spec.cost_weight * np.abs(scene.rolled.velocities[WZ]).mean(axis=0))


def velocity_deadband(spec: model.MppiVelocityDeadbandCritic, scene: Scene) -> Floats:
    """What the velocities fall short of those that move the base, over the seconds."""
    ahead, sideways, turn = spec.deadband_velocities
    least = {VX: ahead, WZ: turn, VY: sideways}
    short = np.zeros_like(scene.rolled.velocities[VX])
    for axis, velocities in enumerate(scene.rolled.velocities):
        short += np.maximum(np.float32(least[axis]) - np.abs(velocities), 0)
    return np.asarray(spec.cost_weight * scene.dt * short.sum(axis=0))


def wrapped(angles: Floats) -> Floats:
    """Angles between two directions: 0 … π."""
    return np.asarray(np.abs((angles + np.float32(np.pi)) % np.float32(2 * np.pi) - np.float32(np.pi)))
