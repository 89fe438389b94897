"""Checks for unreachable trigger areas, keepout regions on goals, goals that are already reached, and loose bounds."""

import math
from collections.abc import Iterator
from itertools import pairwise

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.polygons import depth_inside_polygon, transform_polygon
from simscen.loading.checks.event_feasibility import MAX_SPEED_RATIO
from simscen.loading.checks.placement import blocked_poses
from simscen.loading.checks.registry import WORLD, CheckProblem
from simscen.loading.checks.route_search import robot_routes, trigger_areas
from simscen.loading.checks.scene import START, Scene
from simscen.worlds.geometry.overlaps import polygons_overlap


def _start_is_blocked(scene: Scene) -> bool:
    return START in scene.cached(blocked_poses)


@WORLD.check("SC050")
def unreachable_triggers(scene: Scene) -> Iterator[CheckProblem]:
    """Find events and faults that wait for the robot in an area that the robot cannot reach within the time limit."""
    if _start_is_blocked(scene) or scene.loaded.may_do():  # actions of installed packages may take the robot anywhere
        return
    starts, robot, limit = scene.start_poses, scene.loaded.robot.spec, scene.loaded.spec.time_limit
    for keys, name, description, corners, distance, is_required in scene.cached(trigger_areas):
        center = Pose2(*(sum(values) / len(corners) for values in zip(*corners, strict=True)))
        if not scene.cached(robot_routes).can_enter(starts, center, distance):
            message = f"`{name}` can never happen: no route leads the robot to {description}"
            yield CheckProblem(keys, message, is_warning=not is_required)
        elif robot is not None and min(map(distance, starts)) > MAX_SPEED_RATIO * robot.top_speed * limit:
            top_speed = f"at {robot.top_speed:g} m/s, its top speed,"
            reason = f"{top_speed} the robot does not reach {description} within the time limit"
            yield CheckProblem(keys, f"`{name}` can never happen: {reason}", is_warning=not is_required)


@WORLD.check("SC051")
def keepout_regions_on_goals(scene: Scene) -> Iterator[CheckProblem]:
    """Find keepout criteria that apply to the whole run, and whose region contains the start or a goal."""
    if _start_is_blocked(scene):
        return
    for index, entry in enumerate(scene.loaded.spec.pass_):
        if entry.kind != "keepout" or entry.chosen.region is None or entry.chosen.while_on:
            continue
        region, keys = entry.chosen.region, ("pass", index, "keepout", "region")
        corners = scene.world.regions[region]
        if polygons_overlap(corners, transform_polygon(scene.start, scene.size.footprint)):
            yield CheckProblem(keys, f"keepout can never hold: the robot starts in `{region}`")
            continue
        inside = [
            goal.name
            for _, goal in scene.expected_goals
            if depth_inside_polygon(goal.pose, corners) > goal.xy_tolerance
        ]
        if inside:
            yield CheckProblem(keys, f"keepout cannot hold if goal `{inside[0]}` is reached: it is in `{region}`")


@WORLD.check("SC055", severity="warning")
def goals_reached_at_once(scene: Scene) -> Iterator[CheckProblem]:
    """Find goals that are already reached when they are sent."""
    if _start_is_blocked(scene):
        return
    goals = [(keys, goal) for keys, goal in scene.expected_goals if keys[0] == "goals"]
    poses = [scene.start, *(goal.pose for _, goal in goals)]
    for (before, _), (keys, goal) in zip(pairwise(poses), goals, strict=True):
        turned = abs(wrap(before.yaw - goal.pose.yaw))
        if before.distance(goal.pose) <= goal.xy_tolerance and turned <= goal.yaw_tolerance:
            message = f"the robot is already within the tolerances of goal `{goal.name}` when it is sent there"
            yield CheckProblem(keys, message)


@WORLD.check("SC052", severity="warning")
def loose_localization_bounds(scene: Scene) -> Iterator[CheckProblem]:
    """Find bounds on the localization error that are larger than the diagonal of the world."""
    if _start_is_blocked(scene):
        return
    left, bottom, right, top = scene.world.bounds
    diagonal = math.hypot(right - left, top - bottom)
    for index, entry in enumerate(scene.loaded.spec.pass_):
        for key in ("max", "rmse", "final") if entry.kind == "localization_error" else ():
            bound = getattr(entry.chosen, key)
            if bound is not None and 0 < diagonal < bound:
                message = f"localization_error can hardly fail: the diagonal of the world is {diagonal:.1f} m"
                yield CheckProblem(("pass", index, "localization_error", key), message)
