"""What the built world tells about triggers, criteria and goals: places that no robot comes to, or is at already."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

from simscen.core.geometry import Pose2, wrap
from simscen.core.polygons import deep_inside, distance_to_polygon
from simscen.core.problems import Problem
from simscen.core.world import Polygon
from simscen.criteria.keepout import Keepout
from simscen.criteria.localization_error import LocalizationError
from simscen.loading.checks.events import FASTER, top_speed
from simscen.run.worldchecks.reachability import start_poses
from simscen.run.worldchecks.routes import RobotRoutes
from simscen.run.worldchecks.scene import Keys, Scene
from simscen.triggers.robot_in import RobotIn
from simscen.triggers.robot_within import RobotWithin
from simscen.triggers.trigger import Test
from simscen.worlds.overlap import placed, polygons_overlap

Distance = Callable[[Pose2], float]


def check_regions(scene: Scene, ways: RobotRoutes) -> list[Problem]:
    """Errors for what can never happen or hold, warnings for what is so from the start."""
    checks = (_never_there(scene, ways), _kept_out(scene), _there_already(scene), _lost_in_here(scene))
    return [problem for check in checks for problem in check]


def trigger_positions(scene: Scene) -> list[Pose2]:
    """Corners of all that triggers wait for the robot to come to."""
    return [Pose2(x, y) for *_, corners, _ in _waits(scene) for x, y in corners]


def _never_there(scene: Scene, ways: RobotRoutes) -> Iterator[Problem]:
    """Triggers that wait for the robot where it cannot come."""
    starts, robot = start_poses(scene), scene.loaded.robot.spec
    for keys, name, what, corners, distance in _waits(scene):
        towards = Pose2(*(sum(values) / len(corners) for values in zip(*corners, strict=True)))
        message = ""
        if not ways.come_to(starts, towards, distance):
            message = f"no way leads the robot to {what}"
        elif (
            robot is not None and min(map(distance, starts)) > FASTER * top_speed(robot) * scene.loaded.spec.time_limit
        ):
            message = f"at its top speed of {top_speed(robot):g} m/s the robot is not at {what} within the time limit"
        if message and not scene.does():  # an action of an installed package may take the robot anywhere
            yield scene.loaded.problem(keys, "SC050", f"`{name}` can never happen: {message}")


def _waits(scene: Scene) -> Iterator[tuple[Keys, str, str, Polygon, Distance]]:
    """Where triggers wait for the robot: keys, event or fault, place in words and as corners, how far it is."""
    spec = scene.loaded.spec
    listed: list[tuple[Keys, str, Test | None]] = [((*step.keys, "when"), step.name, step.when) for step in spec.steps]
    listed += [(("faults", k, "when"), fault.label, fault.when) for k, fault in enumerate(spec.faults)]
    for keys, name, test in listed:
        for below, needed in _needed(scene, test, keys) if test is not None else ():
            match needed.chosen if needed.kind in ("robot_in", "robot_within") else None:
                case RobotIn(region=region):
                    corners = scene.world.regions[region]
                    yield below, name, f"region `{region}`", corners, _from_region(corners, 0.0)
                case RobotWithin(region=str(region), distance=reach):
                    corners = scene.world.regions[region]
                    yield below, name, f"within {reach:g} m of region `{region}`", corners, _from_region(corners, reach)
                case RobotWithin(of=[x, y], distance=reach):
                    what = f"within {reach:g} m of ({x:g}, {y:g})"
                    yield below, name, what, ((x, y),), _from_point(Pose2(x, y), reach)
                case _:
                    pass


def _needed(scene: Scene, test: Test, keys: Keys) -> Iterator[tuple[Keys, Test]]:
    """The conditions on the robot that must all become true for a test to."""
    if not scene.loaded.concerns(test.robot):
        return
    if test.all is not None:
        for k, part in enumerate(test.all):
            yield from _needed(scene, part, (*keys, "all", k))
    elif test.any is None and test.not_ is None:
        yield (*keys, test.kind), test


def _from_region(corners: Polygon, reach: float) -> Distance:
    return lambda pose: distance_to_polygon(pose, corners) - reach


def _from_point(point: Pose2, reach: float) -> Distance:
    return lambda pose: pose.distance(point) - reach


def _kept_out(scene: Scene) -> Iterator[Problem]:
    """Regions to keep out of that hold the start or a goal."""
    for index, entry in enumerate(scene.loaded.spec.pass_):
        if not isinstance(entry.chosen, Keepout) or entry.chosen.region is None:
            continue
        region, keys = entry.chosen.region, ("pass", index, "keepout", "region")
        corners = scene.world.regions[region]
        if polygons_overlap(corners, placed(scene.outline, scene.start)):
            yield scene.loaded.problem(keys, "SC051", f"keepout can never hold: the robot starts in `{region}`")
            continue
        inside = [goal.name for _, goal in scene.targets if deep_inside(goal.pose, corners) > goal.xy_tolerance]
        if inside:
            message = f"keepout can never hold while goal `{inside[0]}` is reached, which lies in `{region}`"
            yield scene.loaded.problem(keys, "SC051", message)


def _there_already(scene: Scene) -> Iterator[Problem]:
    """Goals within whose tolerances the robot is when it is sent to them."""
    own = [(keys, goal) for keys, goal in scene.targets if keys[0] == "goals"]
    poses = [scene.start, *(goal.pose for _, goal in own)]
    for (before, _), (keys, goal) in zip(pairwise(poses), own, strict=True):
        turned = abs(wrap(before.yaw - goal.pose.yaw))
        if before.distance(goal.pose) <= goal.xy_tolerance and turned <= goal.yaw_tolerance:
            message = f"the robot is at goal `{goal.name}` when it is sent there, within the goal's tolerances"
            yield replace(scene.loaded.problem(keys, "SC055", message), severity="warning")


def _lost_in_here(scene: Scene) -> Iterator[Problem]:
    """Localization errors that are larger than the world."""
    left, low, right, high = scene.world.bounds
    across = math.hypot(right - left, high - low)
    for index, entry in enumerate(scene.loaded.spec.pass_):
        for key in ("max", "rmse", "final") if isinstance(entry.chosen, LocalizationError) else ():
            bound = getattr(entry.chosen, key)
            if bound is not None and 0 < across < bound:
                message = f"localization_error can hardly fail: the world is {across:.1f} m across"
                keys = ("pass", index, "localization_error", key)
                yield replace(scene.loaded.problem(keys, "SC052", message), severity="warning")
