"""From a `*.world.yaml` to a world: walls with clean corners, obstacles, things that move, doors."""

import math
from collections.abc import Iterable
from dataclasses import replace

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.motion_paths import pose_at
from simscen.core.geometry.shapes import Body, Box, Solid
from simscen.model.world import Door, Movable, Obstacle, Ramp, Wall, WorldSpec
from simscen.worlds.geometry.prisms import plan_rectangle
from simscen.worlds.geometry.wall_prisms import wall_solids


def build_own(
    spec: WorldSpec,
    name: str,
    grid: OccupancyGrid | None = None,
    base: World | None = None,
    notes: tuple[str, ...] = (),
) -> World:
    """The world of a specification; `name` is used where it has none.

    `grid` is the loaded `map`, which becomes walls `map_height` tall and stays the robot's map; `notes` are what its
    loader had to say; `base` is the imported `sdf`. What the specification adds comes after theirs, and its places
    and regions win over those of the base.
    """
    base = base or World(name, ())
    solids = [*base.solids]
    if grid is not None:
        from simscen.worlds.maps.map_walls import walls_of

        solids += walls_of(grid, spec.map_height)
    for number, wall in enumerate(spec.walls, start=1):
        solids += wall_solids(_corners(wall), wall.thickness, wall.height, wall.called(number))
    solids += [_standing(obstacle) for obstacle in spec.obstacles]
    solids += [_rising(ramp) for ramp in spec.ramps]
    bodies = (*base.bodies, *map(_movable, spec.objects), *map(_door, spec.doors))
    places = {**base.places, **{key: place.pose for key, place in spec.places.items()}}
    regions = {key: tuple((x, y) for x, y in corners) for key, corners in spec.regions.items()}
    return replace(
        base,
        name=spec.name or name,
        solids=tuple(solids),
        bodies=bodies,
        places=places,
        regions={**base.regions, **regions},
        friction=spec.friction,
        doors={door.name: _ways(door) for door in spec.doors},
        bounds=_bounds(solids, bodies, places.values(), grid),
        grid=grid or base.grid,
        notes=(*base.notes, *notes),
    )


def door_poses(hinge: tuple[float, float], post: tuple[float, float]) -> tuple[Pose2, Pose2]:
    """Where the panel of a door is when closed and when open: it turns 90° anticlockwise about its hinge."""
    yaw = math.atan2(post[1] - hinge[1], post[0] - hinge[0])
    return Pose2(*hinge, yaw), Pose2(*hinge, yaw).compose(Pose2(0.0, 0.0, math.pi / 2))


def _ways(door: Door) -> tuple[Pose2, Pose2]:
    """Where its panel is when closed and when open."""
    (hx, hy), (px, py) = door.points
    closed, opened = door_poses((hx, hy), (px, py))
    if door.motion == "swing":
        return closed, opened
    return closed, closed.compose(Pose2(-(door.travel or math.hypot(px - hx, py - hy)), 0.0))


def _corners(wall: Wall) -> list[tuple[float, float]]:
    return [(x, y) for x, y in wall.points]


def _standing(obstacle: Obstacle) -> Solid:
    solid = obstacle.solid(obstacle.name)
    return replace(solid, pose=Pose3.planar(obstacle.pose.pose, solid.pose.z), friction=obstacle.friction)


def _rising(ramp: Ramp) -> Solid:
    from simscen.worlds.geometry.ramp_wedges import wedge

    (ax, ay), (bx, by) = ramp.start, ramp.end
    return wedge((ax, ay), (bx, by), ramp.width, ramp.height, ramp.name, ramp.friction)


def _movable(thing: Movable) -> Body:
    pose, path = thing.pose.pose, None
    if thing.move is not None:
        path = thing.move.path(pose, thing.move.start)
        pose = pose if thing.move.keyframes is None else pose_at(path, 0.0)
    return Body(thing.name, (thing.solid(thing.name),), Pose3.planar(pose), thing.mass, path)


def _door(door: Door) -> Body:
    (hinge_x, hinge_y), (post_x, post_y) = door.points
    closed, opened = _ways(door)
    width = math.hypot(post_x - hinge_x, post_y - hinge_y)
    panel = Solid(Box((width, door.thickness, door.height)), Pose3(x=width / 2, z=door.height / 2), door.name)
    return Body(door.name, (panel,), Pose3.planar(closed if door.closed else opened))


def _bounds(
    solids: Iterable[Solid], bodies: Iterable[Body], places: Iterable[Pose2], grid: OccupancyGrid | None
) -> tuple[float, float, float, float]:
    """What holds all there is, as (min x, min y, max x, max y); zeros for nothing at all."""
    corners = [(place.x, place.y) for place in places]
    covered = [plan_rectangle(solid) for solid in solids]
    covered += [plan_rectangle(solid, body.pose) for body in bodies for solid in body.solids]
    corners += [corner for left, low, right, high in covered for corner in ((left, low), (right, high))]
    if grid is not None:
        corners += _corners_of(grid)
    if not corners:
        return (0.0, 0.0, 0.0, 0.0)
    xs, ys = zip(*corners, strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def _corners_of(grid: OccupancyGrid) -> list[tuple[float, float]]:
    height, width = (cells * grid.resolution for cells in grid.shape)
    local = ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height))
    return [grid.origin.compose(Pose2(x, y))[:2] for x, y in local]
