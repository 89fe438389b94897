"""Check of goals that no route leads to: a sealed room, or a gap that is narrower than the robot."""

import math
from collections.abc import Iterator
from typing import NamedTuple

from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import Solid
from simscen.loading.checks.placement import blocked_poses
from simscen.loading.checks.regions import robot_routes
from simscen.loading.checks.registry import Finding
from simscen.loading.checks.scene import START, WORLD, Scene
from simscen.worlds.geometry.overlaps import first_solid_in_disc

NO_ROUTE_HINT = "widen the gap, or expect the failure with `result: {status: FAILED, error_code: NO_VALID_PATH}`"
GAP_EDGE_M = 0.03
"""Distance from the edge of a gap within which the solid is searched that forms it."""


class Gap(NamedTuple):
    """The widest gap on the way to a goal: in words, and its position in m."""

    description: str
    position: tuple[float, float]


def closed_gaps(scene: Scene) -> list[tuple[Finding, Gap]]:
    """Return a finding for each goal without a route, and the gap that is too narrow.

    It is an error if fixed walls block the goal, and a warning if the robot might pass or push what blocks it.
    """
    blocked = scene.cached(blocked_poses)
    if START in blocked:
        return []
    routes, starts, world = scene.cached(robot_routes), scene.start_poses, scene.world.solids
    solids = (*world, *scene.immovable_bodies) if scene.immovable_bodies else world
    found = []
    for keys, goal in scene.targets:
        if keys in blocked or routes.is_reachable(starts, goal.pose, solids):
            continue
        gap = _widest_gap(scene, goal.pose, solids)
        message = f"goal `{goal.name}` cannot be reached from the start: {gap.description}"
        if solids is not world and routes.is_reachable(starts, goal.pose, world):
            finding = Finding(keys, message, "no event opens, moves or removes it", warning=True)
        elif scene.may_do():
            finding = Finding(keys, message, "unless an action of an installed package opens a route", warning=True)
        elif len(scene.certain_walls) < len(world) and routes.is_reachable(starts, goal.pose, scene.certain_walls):
            finding = Finding(keys, message, _ramp_hint(scene), warning=True)
        else:
            finding = Finding(keys, message, NO_ROUTE_HINT)
        found.append((finding, gap))
    return found


@WORLD.check("SC302")
def check_reachability(scene: Scene) -> Iterator[Finding]:
    """Find goals that no route leads to."""
    return (finding for finding, _ in scene.cached(closed_gaps))


def _ramp_hint(scene: Scene) -> str:
    """Return when a goal may be reachable after all: a solid that is not upright may be a ramp."""
    from simscen.loading.builders import load_robot
    from simscen.sim.body.robot_body import compute_climb_limits

    slope = math.degrees(compute_climb_limits(load_robot(scene.loaded)[1]).slope)
    climbs = f"climbs slopes up to {slope:.1f}°" if slope else "cannot climb slopes"
    return f"unless a tilted solid there is a ramp that the robot can climb; this robot {climbs}"


def _widest_gap(scene: Scene, goal: Pose2, solids: tuple[Solid, ...]) -> Gap:
    from simscen.worlds.geometry.triangulation import merge_solids
    from simscen.worlds.routes.narrow_gaps import narrowest_gap

    routes = scene.cached(robot_routes)
    gap = narrowest_gap(merge_solids(solids), routes.bounds, (scene.start, goal), scene.size.inscribed, routes.z_range)
    position = f"({gap.x:.2f}, {gap.y:.2f})"
    sides = gap.sides or ((gap.x, gap.y), (gap.x, gap.y))
    names = [first_solid_in_disc(solids, side, GAP_EDGE_M, routes.z_range) for side in sides]
    if gap.width <= 0:
        what = f"`{names[0]}`" if names[0] else "a wall"
        return Gap(f"{what} closes the last route at {position}", (gap.x, gap.y))
    between = f" between `{names[0]}` and `{names[1]}`" if names[0] and names[1] else ""
    robot_width = f"the robot is at least {2 * scene.size.inscribed:.2f} m wide"
    return Gap(f"the widest gap is {gap.width:.2f} m wide at {position}{between}, but {robot_width}", (gap.x, gap.y))
